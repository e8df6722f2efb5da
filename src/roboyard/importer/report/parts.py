"""The parts of a robot in colours: at rest on a floor, as it will stand, beside the vendor's zero pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from html import escape

import numpy as np

from roboyard.description.model import Link
from roboyard.description.robot_model import RobotModel
from roboyard.importer.report.pictures import drawn_shape, resting_frames
from roboyard.kinematics.description_poses import forward_kinematics, vector_joints
from roboyard.morphology.part_colours import colours_of_links, parts_of
from roboyard.rendering import RenderShape
from roboyard.reports.html import figure
from roboyard.reports.pictures import RGBA, SceneView, gathered
from roboyard.shapes import primitives
from roboyard.transforms import Array

WIDTH, HEIGHT = 460, 480
FLOOR: RGBA = (0.86, 0.88, 0.91, 1.0)
SENSOR: RGBA = (0.86, 0.16, 0.16, 1.0)
MARKER = 0.02
"""Radius of a sensor's marker, as a share of the robot's size."""


def view_of_parts(robot: RobotModel, frames: Mapping[str, Array], *, floor: bool) -> SceneView:
    """Return a view of the robot in the colours of its parts, with its sensors as red spheres.

    Args:
        robot: the robot.
        frames: (4, 4) pose of each link in the root link's frame.
        floor: whether to lay a plate under the lowest point.
    """
    colours, up = colours_of_links(robot.description, robot.semantic), np.asarray(robot.semantic.up)
    links = [
        (link.name, frames[link.name], partial(_shapes, link, colours[link.name]))
        for link in robot.description.links
    ]
    points = gathered(links).points()
    if not len(points):
        return gathered(())
    size = float(np.ptp(points, axis=0).max())
    for number, (_, name) in enumerate(sensor_links(robot)):
        if name in frames:
            links.append((f"sensor {number}", frames[name], partial(_marker, MARKER * size)))
    if floor:
        links.append(("floor", _plate_pose(points, up), partial(_plate, points, size)))
    return gathered(links)


def sensor_links(robot: RobotModel) -> tuple[tuple[str, str], ...]:
    """Return name and link of each camera, lidar and IMU."""
    found = [(f"{s.kind} {s.name}", s.optical_link or s.link) for s in robot.semantic.sensors]
    known = {link for _, link in found}
    found += [(s.kind, s.link) for s in robot.sensors if s.kind != "visual_sphere" and s.link not in known]
    return tuple(found)


def rest_frames(robot: RobotModel) -> dict[str, Array]:
    """Return the (4, 4) pose of each link in the root link's frame in the rest posture."""
    rest = robot.semantic.rest
    posture = {j.name: rest[j.name] for j in vector_joints(robot.description) if j.name in rest}
    return forward_kinematics(robot.description, posture)


def parts_section(robot: RobotModel) -> list[str]:
    """Return the section of the page: the robot as it will stand, the vendor's zero pose, and a legend."""
    shown = []
    for frames, caption, floor in (
        (rest_frames(robot), "as it will stand: rest posture on a floor", True),
        (resting_frames(robot.description), "the vendor's zero pose", False),
    ):
        view = view_of_parts(robot, frames, floor=floor)
        if not view.is_empty:
            around = view.points()
            shown.append(figure(view.picture(around=around, width=WIDTH, height=HEIGHT), caption, WIDTH))
    if not shown:
        return []
    entries = [(part.name, part.rgba, ", ".join(part.joints)) for part in parts_of(robot.semantic)]
    entries += [(name, SENSOR, f"on {link}") for name, link in sensor_links(robot)]
    legend = "".join(
        f'<li><span style="background:{_css(rgba)}"></span><b>{escape(name)}</b> '
        f"<code>{escape(_short(text))}</code></li>"
        for name, rgba, text in entries
    )
    none = '<p class="dim">No part was recognised.</p>'
    return [
        "<h2>Its parts</h2>",
        f'<div class="parts"><div class="pictures">{"".join(shown)}</div>',
        f"<ul>{legend}</ul></div>" if entries else f"{none}</div>",
    ]


def _css(rgba: RGBA) -> str:
    red, green, blue = (round(255 * value) for value in rgba[:3])
    return f"rgb({red},{green},{blue})"


def _short(text: str, limit: int = 90) -> str:
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _shapes(link: Link, rgba: RGBA, frame: int) -> Iterator[RenderShape]:
    for shape in link.visuals or link.collisions:
        made = drawn_shape(shape, frame, rgba)
        if made is not None:
            yield made


def _marker(radius: float, frame: int) -> Iterator[RenderShape]:
    yield RenderShape(
        mesh=primitives.sphere(radius, segments=16),
        position=np.zeros(3),
        rotation=np.eye(3),
        frame=frame,
        owner=(0, frame),
        rgba=SENSOR,
    )


def _plate(points: Array, size: float, frame: int) -> Iterator[RenderShape]:
    half = 0.6 * float(np.ptp(points, axis=0)[:2].max()) + 0.05 * size
    yield RenderShape(
        mesh=primitives.box(half, half, 0.004 * size),
        position=np.array([0.0, 0.0, -0.004 * size]),
        rotation=np.eye(3),
        frame=frame,
        owner=(0, frame),
        rgba=FLOOR,
    )


def _plate_pose(points: Array, up: Array) -> Array:
    """Return the (4, 4) pose of a plate under the lowest of (n, 3) points, its z axis along `up`."""
    axis = up / np.linalg.norm(up)
    side = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    side = side / np.linalg.norm(side)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(side, axis), side, axis], axis=1)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    lowest = float((points @ axis).min())
    pose[:3, 3] = middle + (lowest - middle @ axis) * axis
    return pose
