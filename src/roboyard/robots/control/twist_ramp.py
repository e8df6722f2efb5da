"""How a base comes from one twist to another: no faster than it may, and upright.

A twist that would tip the robot in a steady curve is driven slower on the same curve; so is every twist on
the way there, which can be worse than both ends (straight ahead at full speed, then a slow tight curve). What
is left of the footing bears the change. See `roboyard.robots.stability.zmp`.
"""

from __future__ import annotations

from collections.abc import Callable

from roboyard.robots.control.controller import GroupState
from roboyard.transforms import Array


def next_twist(now: Array, wanted: Array, state: GroupState, limited: Callable[[Array], Array]) -> Array:
    """The twist to drive at next.

    Args:
        now: (3,) m/s, m/s, rad/s of the base in its own axes.
        wanted: the same, where it is to come.
        state: of the base's joints; with `balance` for a robot that may tip over.
        limited: what of a change of twist may be done within `state.dt`.
    """
    is_steady_and_straight = wanted[2] == 0.0 and now[2] == 0.0 and bool((wanted == now).all())
    balance = None if state.balance is None or is_steady_and_straight else state.balance()
    if balance is None:
        return now + limited(wanted - now)
    ahead = now + limited(wanted * balance.steady(wanted) - now)
    change = limited(ahead * balance.steady(ahead) - now)
    return now + change * balance.bearable(now, change / state.dt)
