"""Joint sliders: they set positions while paused, and targets of the drives while playing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.page.callbacks import of_pages

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.joint import Joint

FREE_RANGE = {"continuous": math.pi, "revolute": math.pi, "prismatic": 1.0}
"""Half the range of the slider of a joint without limits (rad or m)."""
WIGGLE_TICKS = 40
"""Ticks for the motion of a joint to its limits and back."""


class JointPanel:
    """The sliders of one robot."""

    def __init__(self, gui: Any, body: Body, do: Callable[[Callable[[], None]], None]) -> None:
        """Add the sliders; `do` queues a request for the simulation thread."""
        self._body = body
        self._do = do
        self.sliders: dict[str, Any] = {}
        self.is_playing = False
        self.is_held = True
        """Whether drives hold the joints while playing."""
        self._followers = _followers(body)
        for joint in body.joints:
            if joint.is_scalar:
                self.sliders[joint.name] = self._add(gui, joint)

    @property
    def followers(self) -> frozenset[str]:
        """Names of the mimic joints."""
        return frozenset(self._followers)

    def _add(self, gui: Any, joint: Joint) -> Any:
        lower, upper = slider_range(joint)
        unit = "m" if joint.type == "prismatic" else "rad"
        limit = joint.limit
        hints = [f"{joint.type}, {unit}"]
        hints.append("no limits" if joint.limits is None else range_text(joint, lower, upper))
        if limit is not None and limit.effort is not None:
            hints.append(f"effort {limit.effort:.4g}")
        if limit is not None and limit.velocity is not None:
            hints.append(f"velocity {limit.velocity:.4g}")
        follows = joint.name in self._followers
        if follows:
            leader, multiplier, offset = self._followers[joint.name]
            hints.append(f"follows {leader}: {multiplier:.4g} q + {offset:.4g}")
        moving = upper > lower
        slider = gui.add_slider(
            joint.name,
            min=lower,
            max=upper if moving else lower + 1e-3,
            step=max(round((upper - lower) / 1000, 4), 1e-4),
            initial_value=float(np.clip(joint.position, lower, upper)),
            hint="; ".join(hints),
            disabled=follows or not moving,
            marks=tuple((place, shown(joint, place)) for place in (lower, upper)) if moving else None,
        )

        def moved(event: Any) -> None:
            value = float(event.target.value)
            self._do(lambda: self.move(joint.name, value))

        slider.on_update(of_pages(moved))
        return slider

    def move(self, name: str, value: float) -> None:
        """Set the position of a joint, or the target of its drive while playing (rad or m)."""
        self._put(name, value)
        for follower in self._followers:
            if follower != name and follower in self.sliders:
                target = self._target(follower)
                self.sliders[follower].value = target
                self._put(follower, target)

    def _put(self, name: str, value: float) -> None:
        joint = self._body.joint(name)
        if not self.is_playing:
            joint.position = value
            joint.velocity = 0.0
        elif self.is_held and name not in self._followers:
            joint.drive_position(value)

    def _target(self, name: str) -> float:
        """Return the value of a slider; of a mimic joint, that computed from its leader's slider."""
        if name in self._followers:
            leader, multiplier, offset = self._followers[name]
            if leader in self.sliders and leader != name:
                return multiplier * self._target(leader) + offset
        return float(self.sliders[name].value)

    def play(self, playing: bool) -> None:
        """Switch between playing and paused."""
        self.is_playing = playing
        if playing:
            self.hold(self.is_held)
        else:
            self.show_positions()

    def hold(self, held: bool) -> None:
        """Let the drives hold the joints at their positions, or disable the drives."""
        self.is_held = held
        if not self.is_playing:
            return
        for name in self.sliders:
            if name in self._followers:
                continue
            joint = self._body.joint(name)
            if held:
                joint.drive_position(float(joint.position))
                self.sliders[name].value = self._shown(joint)
            else:
                joint.disable_drive()

    def show_positions(self) -> None:
        """Set the sliders to the joint positions."""
        for name, slider in self.sliders.items():
            slider.value = self._shown(self._body.joint(name))

    def _shown(self, joint: Joint) -> float:
        return float(np.clip(joint.position, *slider_range(joint)))

    def wiggle(self) -> Iterator[str]:
        """Move each joint to both limits and back, one step per `next`; yields the joint's name."""
        before = {name: float(self._body.joint(name).position) for name in self.sliders}
        for name in self.sliders:
            joint = self._body.joint(name)
            lower, upper = slider_range(joint)
            if name in self._followers or upper <= lower:
                continue
            start = before[name]
            for tick in range(WIGGLE_TICKS + 1):
                way = math.sin(2 * math.pi * tick / WIGGLE_TICKS)
                place = start + way * (upper - start) if way >= 0 else start + way * (start - lower)
                self.sliders[name].value = float(np.clip(place, lower, upper))
                self.move(name, place)
                yield name
            self.sliders[name].value = float(np.clip(start, lower, upper))
        for name, place in before.items():
            self._body.joint(name).position = place
        self.show_positions()


def slider_range(joint: Joint) -> tuple[float, float]:
    """Return the (lower, upper) range of a slider: the joint's limits, else ±pi rad or ±1 m."""
    limits = joint.limits
    if limits is None:
        half = FREE_RANGE[joint.type]
        return -half, half
    return limits


def shown(joint: Joint, value: float) -> str:
    """Return a position as a person reads it: a turn in degrees, a slide in m."""
    return f"{value:.3g} m" if joint.type == "prismatic" else f"{math.degrees(value):.0f}°"


def range_text(joint: Joint, lower: float, upper: float) -> str:
    """Return a range in rad, with degrees, or in m."""
    text = f"from {lower:.4g} to {upper:.4g}"
    if joint.type == "prismatic":
        return f"{text} m"
    return f"{text} rad ({shown(joint, lower)} to {shown(joint, upper)})"


def _followers(body: Body) -> dict[str, tuple[str, float, float]]:
    """Return each mimic joint with its leader, multiplier and offset."""
    if body.description is None:
        return {}
    return {
        joint.name: (joint.mimic.joint, joint.mimic.multiplier, joint.mimic.offset)
        for joint in body.description.joints
        if joint.mimic is not None
    }
