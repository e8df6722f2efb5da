"""`arm7/arm7.urdf`: a seven-joint arm on a fixed foot; all collision shapes are primitives.

Joints alternate between the axis of the arm and the one across it without offsets: shoulder and wrist are
spherical, the elbow swivels between them. Reach 0.9 m from the shoulder.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from assets.files import obj
from assets.mesh import Mesh, merge
from assets.palette import pick
from assets.solids import arrayed, disc, drum, loft, revolve, ring
from assets.urdf import HEADER, Joint, Link, Shape, cylinder, document, mesh, mesh_inertial, sphere_inertial

HALF = pi / 2


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One joint and the link after it."""

    rise: float
    """From the joint before, along the straight arm; m"""
    across: bool
    """Turns about the arm's y axis instead of its own length."""
    length: float
    """Of the link's body, from this joint towards the next; m"""
    radius: float
    mass: float
    reach: float
    """Limit on both sides; rad"""
    effort: float
    velocity: float


STAGES = (
    Stage(rise=0.16, across=False, length=0.18, radius=0.068, mass=4.0, reach=2.9, effort=180, velocity=2.0),
    Stage(rise=0.18, across=True, length=0.2, radius=0.064, mass=4.0, reach=2.0, effort=180, velocity=2.0),
    Stage(rise=0.2, across=False, length=0.2, radius=0.058, mass=3.0, reach=2.9, effort=120, velocity=2.5),
    Stage(rise=0.2, across=True, length=0.19, radius=0.054, mass=2.6, reach=2.2, effort=120, velocity=2.5),
    Stage(rise=0.19, across=False, length=0.18, radius=0.048, mass=1.8, reach=2.9, effort=60, velocity=3.5),
    Stage(rise=0.18, across=True, length=0.08, radius=0.044, mass=1.3, reach=2.1, effort=40, velocity=3.5),
    Stage(rise=0.08, across=False, length=0.05, radius=0.036, mass=0.4, reach=3.0, effort=30, velocity=4.0),
)


def build() -> dict[str, bytes]:
    """Return every file of the robot by its path under the assets folder."""
    files: dict[str, bytes] = {}

    def add(name: str, solid: Mesh) -> None:
        files[f"arm7/meshes/{name}.obj"] = obj(solid, header=f"{HEADER}. Seven-joint arm: {name}.")

    add("foot", _foot())
    add("foot_trim", _foot_trim())
    for number, stage in enumerate(STAGES, start=1):
        add(f"link{number}", _shell(stage, number))
        add(f"link{number}_trim", _trim(stage, number))
    links, joints = _robot()
    about = "Seven-joint arm; straight up at zero, every axis offset-free."
    files["arm7/arm7.urdf"] = document("arm7", links, joints, pick("shell", "graphite", "amber"), about)
    return files


def _robot() -> tuple[list[Link], list[Joint]]:
    foot = Link(
        name="link0",
        inertial=mesh_inertial(5.0, _foot()),
        visuals=[Shape(geometry=mesh("meshes/foot.obj"), material="shell"),
                 Shape(geometry=mesh("meshes/foot_trim.obj"), material="graphite")],
        collisions=[Shape(geometry=cylinder(0.1, 0.03), xyz="0 0 0.015"),
                    Shape(geometry=cylinder(0.07, 0.12), xyz="0 0 0.09")],
    )  # fmt: skip
    links, joints = [foot], []
    for number, stage in enumerate(STAGES, start=1):
        frame = (-HALF, 0.0, 0.0) if stage.across else (0.0, 0.0, 0.0)
        before_across = number > 1 and STAGES[number - 2].across
        # The parent frame is rotated by -90 degrees about x where its joint axis is across the arm.
        xyz = (0.0, -stage.rise, 0.0) if before_across else (0.0, 0.0, stage.rise)
        rpy = (HALF, 0.0, 0.0) if before_across else frame
        limit = {
            "lower": -stage.reach,
            "upper": stage.reach,
            "effort": stage.effort,
            "velocity": stage.velocity,
        }
        joints.append(
            Joint(
                name=f"joint{number}", kind="revolute", parent=f"link{number - 1}", child=f"link{number}",
                xyz=xyz, rpy=rpy, axis="0 0 1", limit=limit, dynamics={"damping": 0.5, "friction": 0.1},
            )
        )  # fmt: skip
        links.append(
            Link(
                name=f"link{number}",
                inertial=mesh_inertial(stage.mass, _shell(stage, number)),
                visuals=[Shape(geometry=mesh(f"meshes/link{number}.obj"), material="shell"),
                         Shape(geometry=mesh(f"meshes/link{number}_trim.obj"),
                               material="amber" if stage.across else "graphite")],
                collisions=_collisions(stage, number),
            )
        )  # fmt: skip
    tool = Joint(name="tool_joint", kind="fixed", parent="link7", child="tool", xyz=(0, 0, STAGES[-1].length))
    return [
        *links,
        Link(name="tool", inertial=sphere_inertial(0.02, 0.01), note="Frame of the flange, z out."),
    ], [*joints, tool]


def _placed(solid: Mesh, stage: Stage) -> Mesh:
    """Return the mesh of an arm along z in the link's frame."""
    return solid.moved(rpy=(HALF, 0, 0)) if stage.across else solid


def _collisions(stage: Stage, number: int) -> list[Shape]:
    last = number == len(STAGES)
    low = 0.0 if last else stage.radius * (0.9 if stage.across else 0.4)
    high = stage.length if last else stage.length - STAGES[number].radius * 0.9
    if high - low < 0.02:
        low, high = 0.0, stage.length * 0.6
    middle, length = (low + high) / 2, high - low
    if stage.across:
        barrel = Shape(geometry=cylinder(stage.radius * 0.8, length), xyz=(0, -middle, 0), rpy=(HALF, 0, 0))
        return [Shape(geometry=cylinder(stage.radius, stage.radius * 1.9)), barrel]
    return [Shape(geometry=cylinder(stage.radius, length), xyz=(0, 0, middle))]


def _foot() -> Mesh:
    return revolve([(0.094, 0.0), (0.1, 0.006), (0.1, 0.022), (0.094, 0.03), (0.074, 0.045), (0.07, 0.07),
                  (0.07, 0.146), (0.066, 0.152)], 48)  # fmt: skip


def _foot_trim() -> Mesh:
    bolts = arrayed(drum(0.006, 0.02, 0.034, 0.001, 8, 1).moved((0.086, 0, 0)), 8)
    return merge(bolts, ring(0.0705, 0.01, 0.139, 0.147, 48))


def _shell(stage: Stage, number: int) -> Mesh:
    """Return the body from this joint to the drum of the next one."""
    r = stage.radius
    end = STAGES[number].radius if number < len(STAGES) else r
    if number == len(STAGES):
        return drum(r, 0.0, stage.length, 0.005, 36)
    if stage.across:
        gap = 0.003 if number == 6 else end * 0.45
        rows = [
            (0.0, 0, 0, r * 0.78, r * 0.8, r * 0.6),
            (stage.length * 0.45, 0, 0, r * 0.82, r * 0.8, r * 0.7),
            disc(stage.length - gap, end),
        ]
        return _placed(
            merge(loft(rows, 6, 0.008, 2), drum(r, -r * 0.84, r * 0.84, 0.01, 40).moved(rpy=(HALF, 0, 0))),
            stage,
        )
    rows = [disc(-r * 0.42 if number > 1 else -0.005, r * 0.98), disc(r * 0.5, r),
            (stage.length - end * 0.9, 0, 0, end * 0.95, end * 0.72, end * 0.7),
            (stage.length + end * 0.55, 0, 0, end * 0.7, end * 0.66, end * 0.6)]  # fmt: skip
    return loft(rows, 6, 0.008, 2)


def _trim(stage: Stage, number: int) -> Mesh:
    r = stage.radius
    if stage.across:
        cap = drum(r * 0.72, r * 0.8, r * 0.94, 0.004, 36)
        return merge(cap, cap.scaled(1, 1, -1))
    if number == len(STAGES):
        holes = arrayed(
            drum(0.003, stage.length - 0.002, stage.length + 0.002, 0.001, 8, 1).moved((0.025, 0, 0)), 6
        )
        return merge(ring(r + 0.001, 0.006, 0.012, 0.02, 36), holes)
    return ring(r + 0.0012, 0.008, r * 0.3, r * 0.3 + 0.012, 40)
