"""How a robot shows itself in a notebook: a picture, its controllers, its joints."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from roboyard.robots.robot import Robot

MOST_JOINTS = 40


def robot_html(robot: Robot) -> str:
    """HTML with a picture of a robot and tables of its controllers and joints; needs no server."""
    from roboyard.rendering import png_bytes
    from roboyard.robots.pictures import WIDTH, portrait

    picture = b64encode(png_bytes(portrait(robot))).decode()
    owner = {name: group.name for group in robot.groups.values() for name in group.joints}
    places = robot.controller_action_idx
    groups = [
        (name, type(controller).__name__, _span(places[name]))
        for name, controller in robot.controllers.items()
    ]
    rows = zip(
        robot.joint_names, robot.joints.q, robot.limits.lower, robot.limits.upper, robot.joints.v, strict=True
    )
    joints = [
        (name, owner.get(name, ""), _number(q), f"{_number(low)} to {_number(high)}", _number(v))
        for name, q, low, high, v in list(rows)[:MOST_JOINTS]
    ]
    if robot.n_dof > MOST_JOINTS:
        joints.append((f"... and {robot.n_dof - MOST_JOINTS} more", "", "", "", ""))
    told = f"{robot.n_dof} joints, {robot.action_dim} numbers in an action; {', '.join(robot.capabilities)}"
    return (
        f"<p><b>{escape(robot.name)}</b>: {escape(told)}</p>"
        f'<img alt="the robot" width="{WIDTH}" src="data:image/png;base64,{picture}">'
        + _table(("group", "controller", "in the action"), groups)
        + _table(("joint", "group", "at, rad or m", "limits", "speed, 1/s"), joints)
    )


def _span(place: slice) -> str:
    return f"{place.start} to {place.stop - 1}" if place.stop > place.start else ""


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "none"


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"
