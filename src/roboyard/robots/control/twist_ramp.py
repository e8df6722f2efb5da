"""Ramp a base from one twist to another within its acceleration limits and without tipping over.

A twist that would tip the robot in a steady curve is driven slower on the same curve; so is every twist
between, which can be worse than both ends (straight ahead at full speed, then a slow tight curve). The
remaining margin of the support polygon limits the change. See `roboyard.robots.stability.zmp`.
"""

from __future__ import annotations

from collections.abc import Callable

from roboyard.robots.control.controller import GroupState
from roboyard.transforms import Array


def next_twist(now: Array, target: Array, state: GroupState, limited: Callable[[Array], Array]) -> Array:
    """Return the (3,) twist of the next step (m/s, m/s, rad/s).

    Args:
        now: (3,) present twist of the base in its own axes (m/s, m/s, rad/s).
        target: (3,) commanded twist, in the same units.
        state: of the base's joints; with `balance` for a robot that may tip over.
        limited: limits a (3,) change of twist to the one possible within `state.dt`.
    """
    is_steady_and_straight = target[2] == 0.0 and now[2] == 0.0 and bool((target == now).all())
    balance = None if state.balance is None or is_steady_and_straight else state.balance()
    if balance is None:
        return now + limited(target - now)
    ahead = now + limited(target * balance.steady(target) - now)
    change = limited(ahead * balance.steady(ahead) - now)
    return now + change * balance.stable_change(now, change / state.dt)
