"""A robot as HTML for notebooks: a picture, its controllers, its joints."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from html import escape

import numpy as np

from roboyard.robots.portrait import WIDTH, render_portrait
from roboyard.robots.robot_body import RobotBody

MAX_JOINTS = 40
"""Joints listed at most."""


def robot_html(robot: RobotBody) -> str:
    """Return self-contained HTML with a picture of a robot and tables of its controllers and joints."""
    from roboyard.rendering import png_bytes

    picture = b64encode(png_bytes(render_portrait(robot))).decode()
    owner = {name: group.name for group in robot.groups.values() for name in group.joints}
    slices = robot.controller_action_idx
    groups = [
        (name, type(controller).__name__, _span(slices[name]))
        for name, controller in robot.controllers.items()
    ]
    rows = zip(
        robot.joint_names,
        robot.joint_positions,
        robot.limits.lower,
        robot.limits.upper,
        robot.joint_velocities,
        strict=True,
    )
    joints = [
        (name, owner.get(name, ""), _number(q), f"{_number(low)} to {_number(high)}", _number(v))
        for name, q, low, high, v in list(rows)[:MAX_JOINTS]
    ]
    if robot.n_dof > MAX_JOINTS:
        joints.append((f"... and {robot.n_dof - MAX_JOINTS} more", "", "", "", ""))
    summary = f"{robot.n_dof} joints, {robot.action_dim} action numbers; {', '.join(robot.capabilities)}"
    return (
        f"<p><b>{escape(robot.name)}</b>: {escape(summary)}</p>"
        f'<img alt="the robot" width="{WIDTH}" src="data:image/png;base64,{picture}">'
        + _table(("group", "controller", "in the action"), groups)
        + _table(("joint", "group", "position, rad or m", "limits", "velocity, rad/s or m/s"), joints)
    )


def _span(part: slice) -> str:
    return f"{part.start} to {part.stop - 1}" if part.stop > part.start else ""


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "none"


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"
