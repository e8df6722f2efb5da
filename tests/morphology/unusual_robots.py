"""Robots that files draw in unusual ways: wheels without joints, bases of rails, chains from the top down."""

from __future__ import annotations

from museum import BODY, base, chain, swivel, wheel
from small_robots import joint, link, robot

from roboyard.description import RobotDescription

ARM = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0")
DIFF_DRIVE = '<gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so"/></gazebo>'


def fixed_wheel(name: str, parent: str, xyz: str) -> str:
    """A wheel on a fixed joint, named as one."""
    return wheel(f"{name}_wheel", parent, xyz).replace('type="continuous"', 'type="fixed"')


def wheels_without_joints(plugin: str = "", *, arm: bool = False) -> RobotDescription:
    """Two wheels that nothing can turn, and a caster; or an arm on such a base."""
    parts = [base(), fixed_wheel("left", "b", "0 0.25 0.1"), fixed_wheel("right", "b", "0 -0.25 0.1"), plugin]
    if arm:
        return robot(*parts, *chain("a", "b", "0 0 0.2", ARM, "0.1 0 0.1"))
    caster = [swivel("caster", "b", "-0.25 0 0.1"), wheel("4", "caster", "-0.03 0 -0.05", radius=0.05)]
    return robot(*parts, *caster)


def trolley() -> RobotDescription:
    """A body on four wheels that nothing can turn."""
    corners = ((0.2, 0.25), (0.2, -0.25), (-0.2, 0.25), (-0.2, -0.25))
    return robot(base(), *(fixed_wheel(f"w{k}", "b", f"{x} {y} 0.1") for k, (x, y) in enumerate(corners)))


def carriage() -> RobotDescription:
    """Two driven wheels on one part that steers without limits, and two balls of three joints each."""
    parts = [link("b", BODY, 20, origin="0 0 0.15"), swivel("s", "b", "0 0 0.1")]
    parts += [wheel("1", "s", "-0.1 0.2 0"), wheel("2", "s", "-0.1 -0.2 0")]
    for name, y in (("l", 0.1), ("r", -0.1)):
        above = "b"
        for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1")):
            shape = "sphere 0.05" if k == 2 else ""
            place = f"0.2 {y} 0.05" if k == 0 else "0 0 0"
            parts.append(link(f"{name}{k}", shape, 0.1))
            parts.append(joint(f"j{name}{k}", above, f"{name}{k}", kind="continuous", xyz=place, axis=axis))
            above = f"{name}{k}"
    return robot(*parts)


def on_rails(travel: float) -> RobotDescription:
    """An arm on a turn and a slide without shapes; with little travel it is a gantry."""
    return robot(
        link("w"),
        link("r"),
        joint("turn", "w", "r", kind="continuous"),
        link("b", BODY, 20, origin="0 0 0.15"),
        joint("go", "r", "b", kind="prismatic", axis="1 0 0", limits=(-travel, travel)),
        *chain("a", "b", "0 0 0.2", ARM, "0.1 0 0.1"),
    )


def hung_from_the_top() -> RobotDescription:
    """A torso, the root, with two arms; a chain of three joints leads down to the body on wheels."""
    return robot(
        link("top", "box 0.2 0.3 0.4", 10, origin="0 0 1.2"),
        *chain("h", "top", "0 0 1", ("0 0 1", "0 1 0", "0 1 0"), "0 0 -0.28"),
        link("cart", BODY, 20),
        joint("fix", "h2", "cart", kind="fixed", xyz="0 0 -0.26"),
        wheel("1", "cart", "0 0.25 -0.05"),
        wheel("2", "cart", "0 -0.25 -0.05"),
        *chain("x", "top", "0 0.2 1.3", (*ARM, "1 0 0"), "0.15 0 0"),
        *chain("y", "top", "0 -0.2 1.3", (*ARM, "1 0 0"), "0.15 0 0"),
    )


def head_above_the_first_joint() -> RobotDescription:
    """An arm of seven joints on the floor; a screen turns on its second link."""
    return robot(
        link("b", "box 0.3 0.3 0.1", 20),
        *chain("a", "b", "0 0 0.1", ("0 0 1", *ARM, "1 0 0"), "0.15 0 0.05"),
        link("screen", "box 0.02 0.2 0.1", 1),
        joint("head_pan", "a0", "screen", xyz="0 0 0.6"),
    )


def steering_for_show() -> RobotDescription:
    """A car with a third steering joint in the middle that carries no wheel."""
    return robot(
        base(),
        swivel("s0", "b", "0.25 0.25 0.1", limits=(-0.6, 0.6)),
        wheel("0", "s0", "0 0 0"),
        swivel("s1", "b", "0.25 -0.25 0.1", limits=(-0.6, 0.6)),
        wheel("1", "s1", "0 0 0"),
        wheel("2", "b", "-0.25 0.25 0.1"),
        wheel("3", "b", "-0.25 -0.25 0.1"),
        link("front_steer", "box 0.02 0.02 0.3", 0.1),
        joint("front_steer_joint", "b", "front_steer", xyz="0.2 0 0.3"),
    )


def suction_cups(name: str = "suction_cup", *, state: str = "") -> RobotDescription:
    """A body with four parts on fixed joints; and a joint, with a shape or without, that says if it holds."""
    parts = [link("b", "box 0.1 0.1 0.05", 1)]
    for k in range(4):
        parts.append(link(f"{name}_{k}", "cylinder 0.01 0.02", 0.01))
        parts.append(joint(f"j{k}", "b", f"{name}_{k}", kind="fixed", xyz=f"{0.02 * k} 0 0.05"))
    if state:
        parts += [link("state", state.removeprefix("none"), 0.01), joint("gripper", "b", "state")]
    return robot(*parts)


def single_jaw_arm() -> RobotDescription:
    """An arm whose last link is the fixed jaw of its gripper; the other one opens with rising positions."""
    return robot(
        link("b", "box 0.2 0.2 0.1", 5),
        *chain("a", "b", "0 0 0.1", ARM, "0 0 0.2"),
        link("tool", "box 0.02 0.02 0.14", 0.1, origin="0.02 0 0.07"),
        joint("fix", "a4", "tool", kind="fixed", xyz="0 0 0.2"),
        link("jaw", "box 0.02 0.02 0.12", 0.05, origin="-0.02 0 0.06"),
        joint("jaw_joint", "tool", "jaw", xyz="0 0 0.02", axis="0 -1 0", limits=(-0.1, 1.5)),
    )


def jaw_beside_a_short_one() -> RobotDescription:
    """The same with a fixed jaw half as long, limits as far either way, and names that say jaw twice."""
    return robot(
        link("b", "box 0.2 0.2 0.1", 5),
        *chain("a", "b", "0 0 0.1", ARM, "0 0 0.2"),
        link("fixed_jaw", "box 0.02 0.02 0.07", 0.1, origin="0.02 0 0.035"),
        joint("fix", "a4", "fixed_jaw", kind="fixed", xyz="0 0 0.2"),
        link("fixed_jaw_tip"),
        joint("tip", "fixed_jaw", "fixed_jaw_tip", kind="fixed", xyz="0.02 0 0.07"),
        link("moving_jaw", "box 0.02 0.02 0.12", 0.05, origin="-0.02 0 0.06"),
        joint("gripper", "fixed_jaw", "moving_jaw", xyz="0 0 0.02", axis="0 -1 0", limits=(-1.1, 1.1)),
    )


def scissors() -> RobotDescription:
    """An arm with two blades on one axle that follow the joint of a frame without a shape, closed at zero."""
    parts = [link("b", "box 0.2 0.2 0.1", 5), *chain("a", "b", "0 0 0.1", ARM, "0 0 0.2")]
    parts += [link("frame"), joint("jaw", "a4", "frame", xyz="0 0 0.1", limits=(0, 1.5))]
    for name, axis in (("jaw_1", "1 0 0"), ("jaw_2", "-1 0 0")):
        follow = '<mimic joint="jaw" multiplier="0.5"/>'
        parts += [link(name, "box 0.005 0.003 0.04", 0.01, origin="0 0 0.02")]
        parts += [joint(f"{name}_joint", "a4", name, xyz="0 0 0.1", axis=axis, mimic=follow)]
    return robot(*parts)


def gears_beside_a_neck() -> RobotDescription:
    """Two arms and a head of two joints, with the gear that turns it on a joint of its own before it."""
    parts = [link("b", "box 0.2 0.3 0.6", 20, origin="0 0 0.3")]
    parts += [link("spur_gear", "cylinder 0.02 0.01", 0.01)]
    parts += [joint("neck_yaw_drive", "b", "spur_gear", xyz="-0.02 0 0.6")]
    parts += [link("neck", "cylinder 0.03 0.05", 0.1), joint("neck_yaw_driven", "b", "neck", xyz="0 0 0.62")]
    parts += [link("head", "box 0.1 0.12 0.1", 0.5, origin="0 0 0.05")]
    parts += [joint("neck_pitch", "neck", "head", xyz="0 0 0.05", axis="0 1 0")]
    for side, y in (("left", 0.2), ("right", -0.2)):
        parts += chain(f"{side}_arm", "b", f"0 {y} 0.5", ("0 1 0", "1 0 0", "0 0 1", "0 1 0"), "0 0 -0.15")
    return robot(*parts)


def gripper_of_springs() -> RobotDescription:
    """Two fingers without shapes that one motor turns, a spring in each of them beside the motor's joint."""
    parts = [link("b", "box 0.2 0.2 0.1", 5), *chain("a", "b", "0 0 0.1", ARM, "0 0 0.2")]
    parts += [link("dummy"), joint("motor", "a4", "dummy", xyz="0 0 0.2", axis="1 0 0", limits=(-0.5, 1.0))]
    for side, y, axis in (("left", 0.03, "-1 0 0"), ("right", -0.03, "1 0 0")):
        follow = '<mimic joint="motor" multiplier="1"/>'
        first, spring, tip = (f"{side}_{part}_finger" for part in ("proximal", "spring", "distal"))
        start = f"0 {y} 0.2"
        parts += [link(first), joint(f"j{first}", "a4", first, xyz=start, axis=axis, mimic=follow)]
        parts += [link(spring), joint(f"j{spring}", first, spring, axis=axis, limits=(0, 0.7))]
        parts += [link(tip), joint(f"j{tip}", spring, tip, kind="fixed", xyz="0 0 0.08")]
    return robot(*parts)


def underactuated_hand() -> RobotDescription:
    """A palm with three fingers of three joints, of which the outer two follow the first."""
    parts = [link("p", "box 0.09 0.03 0.08", 0.3)]
    for k, name in enumerate("cde"):
        finger = chain(name, "p", f"{0.03 * k - 0.03} 0 0.04", ("1 0 0",) * 3, "0 0 0.03")
        parts += [part.replace('"0.04', '"0.01') for part in finger]
        for outer in (1, 2):
            at = next(i for i, part in enumerate(parts) if part.startswith(f'<joint name="j{name}{outer}"'))
            parts[at] = parts[at].replace("</joint>", f'<mimic joint="j{name}0"/></joint>')
    return robot(*parts)


def fingers_with_linkages() -> RobotDescription:
    """A palm whose fingers have joints without limits and a bar beside each, by name all fingers."""
    parts = [link("p", "box 0.09 0.03 0.08", 0.3)]
    for k in range(3):
        above, place = "p", f"{0.03 * k - 0.03} 0 0.04"
        for n in range(2):
            child = f"finger_{k}_link_{n}"
            parts.append(link(child, "box 0.01 0.01 0.03", 0.02, origin="0 0 0.015"))
            parts.append(
                joint(f"finger_{k}_joint_{n}", above, child, kind="continuous", xyz=place, axis="1 0 0")
            )
            above, place = child, "0 0 0.03"
        bar = f"finger_{k}_bar_link"
        parts.append(link(bar, "box 0.005 0.005 0.03", 0.01, origin="0 0 0.015"))
        parts.append(
            joint(
                f"finger_{k}_bar",
                "p",
                bar,
                kind="continuous",
                xyz=f"{0.03 * k - 0.03} 0.01 0.04",
                axis="1 0 0",
            )
        )
    return robot(*parts)


def motors_beside_legs() -> RobotDescription:
    """Four legs of two joints without limits, named as legs; beside each hip a round motor."""
    parts = [link("b", "box 0.6 0.3 0.05", 10)]
    for k, (x, y) in enumerate(((0.25, 0.2), (0.25, -0.2), (-0.25, 0.2), (-0.25, -0.2))):
        parts.append(wheel(f"m{k}", "b", f"{x - 0.1} {y} 0", radius=0.08))
        above, place = "b", f"{x} {y} 0"
        for name in ("upper_leg", "lower_leg"):
            child = f"{name}_{k}"
            parts.append(link(child, "box 0.2 0.03 0.03", 0.3, origin="0.1 0 0"))
            parts.append(joint(f"j_{child}", above, child, kind="continuous", xyz=place, axis="0 1 0"))
            above, place = child, "0.2 0 0"
    return robot(*parts)


def pan_tilt_unit() -> RobotDescription:
    """Two joints that turn a box."""
    return robot(
        link("b", "box 0.1 0.1 0.1", 1),
        link("p", "box 0.1 0.1 0.05", 0.3),
        link("t", "box 0.1 0.2 0.1", 0.3),
        joint("unit_pan_joint", "b", "p", xyz="0 0 0.1"),
        joint("unit_tilt_joint", "p", "t", xyz="0 0 0.1", axis="0 1 0"),
    )


def front_wheel_drive() -> RobotDescription:
    """A car whose motors, as transmissions state, turn the steered front wheels only."""
    drives = "".join(
        f'<transmission name="t{k}"><joint name="{name}"/></transmission>'
        for k, name in enumerate(("j0", "j1", "js0", "js1"))
    )
    return robot(
        base(),
        swivel("s0", "b", "0.25 0.25 0.1", limits=(-0.6, 0.6)),
        wheel("0", "s0", "0 0 0"),
        swivel("s1", "b", "0.25 -0.25 0.1", limits=(-0.6, 0.6)),
        wheel("1", "s1", "0 0 0"),
        wheel("2", "b", "-0.25 0.25 0.1"),
        wheel("3", "b", "-0.25 -0.25 0.1"),
        drives,
    )


def gears() -> RobotDescription:
    """Four gears on a ring that turns in the world."""
    parts = [link("world"), link("ring", "box 0.3 0.3 0.05", 1)]
    parts.append(joint("turn", "world", "ring", kind="continuous", axis="0 1 0"))
    for k, (x, y, yaw) in enumerate(((0.1, 0, 1.57), (-0.1, 0, 1.57), (0, 0.1, 0), (0, -0.1, 0))):
        parts.append(wheel(f"{k}", "ring", f"{x} {y} 0", radius=0.05, yaw=yaw))
    return robot(*parts)


def arm_on_three_fixed_wheels() -> RobotDescription:
    """An arm on a base whose three wheels, on fixed joints, stand around it."""
    spots = (("front_left", "0.2 0.2 0.1"), ("front_right", "0.2 -0.2 0.1"), ("back", "-0.2 0 0.1"))
    wheels = [fixed_wheel(name, "b", xyz) for name, xyz in spots]
    return robot(base(), *wheels, *chain("a", "b", "0 0 0.2", ARM, "0.1 0 0.1"))


def arm_on_hub_motors() -> RobotDescription:
    """An arm on a base whose three wheels are motors by name, fixed below parts that steer."""
    parts = [base(), *chain("a", "b", "0 0 0.2", ARM, "0.1 0 0.1")]
    for k, xyz in enumerate(("0.2 0 0.2", "-0.2 0.2 0.2", "-0.2 -0.2 0.2")):
        parts += [link(f"steer_motor{k}"), joint(f"s{k}", "b", f"steer_motor{k}", kind="fixed", xyz=xyz)]
        hub = wheel(f"wheel_motor_{k}", f"steer_motor{k}", "0 0 -0.1")
        parts.append(hub.replace('type="continuous"', 'type="fixed"'))
    return robot(*parts)


def on_planar_joints(*parts: str, shape: str = "") -> RobotDescription:
    """A body that two short slides and a turn carry, whose links have masses; or, with a shape, a gantry."""
    return robot(
        link("w"),
        link("x", shape, 0.1),
        joint("jx", "w", "x", kind="prismatic", axis="1 0 0", limits=(-2, 2)),
        link("y", shape, 0.1),
        joint("jy", "x", "y", kind="prismatic", axis="0 1 0", limits=(-2, 2)),
        link("b", BODY, 20, origin="0 0 0.15"),
        joint("jz", "y", "b", limits=(-3, 3)),
        *parts,
    )


def small_arm(axis: str = "0 0 1") -> RobotDescription:
    """Three joints that turn, on a base on the floor; names say nothing."""
    return robot(
        link("b", "box 0.2 0.2 0.1", 5), *chain("q", "b", "0 0 0.1", (axis, "0 1 0", "0 1 0"), "0 0 0.15")
    )


def climber() -> RobotDescription:
    """A torso with two arms above and two legs below, each leg with two jaws at its end; names say which."""
    parts = [link("torso", "box 0.2 0.3 0.4", 10, origin="0 0 1")]
    for side, y in (("left", 0.2), ("right", -0.2)):
        parts += chain(f"{side}_arm", "torso", f"0 {y} 1.15", (*ARM, "1 0 0"), "0.12 0 0")
        parts += chain(f"{side}_leg", "torso", f"0 {y / 2} 0.8", ("0 0 1", *ARM), "0 0 -0.12")
        for jaw, x, axis in (("in", 0.01, "1 0 0"), ("out", -0.01, "-1 0 0")):
            name = f"{side}_leg_gripper_{jaw}"
            parts.append(link(name, "box 0.01 0.02 0.06", 0.05, origin="0 0 -0.03"))
            parts.append(
                joint(f"j{name}", f"{side}_leg5", name, kind="prismatic", xyz=f"{x} 0 -0.12", axis=axis,
                      limits=(0, 0.03))
            )  # fmt: skip
    return robot(*parts)


def jaw_beside_an_empty_frame() -> RobotDescription:
    """An arm with a single jaw, and a joint beside it that turns a frame without a shape."""
    return robot(
        link("b", "box 0.2 0.2 0.1", 5),
        *chain("a", "b", "0 0 0.1", ARM, "0 0 0.2"),
        link("jaw", "box 0.02 0.02 0.12", 0.05, origin="-0.02 0 0.06"),
        joint("gripper_joint", "a4", "jaw", xyz="0 0 0.1", axis="0 -1 0", limits=(-0.1, 1.5)),
        link("gripper_frame"),
        joint("gripper_frame_joint", "a4", "gripper_frame", xyz="0 0 0.3", axis="1 0 0"),
    )


def arms_on_a_base_without_shape() -> RobotDescription:
    """Two mirrored arms on a base whose shape is missing; they hang lower than what else there is."""
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "0 0 1")
    return robot(
        link("b", mass=5),
        *chain("l", "b", "0 0.1 0.3", axes, "0.15 0 -0.02"),
        *chain("r", "b", "0 -0.1 0.3", axes, "0.15 0 -0.02"),
    )


def cart_with_y_up() -> str:
    """A cart on four wheels as drawn by a program with y up: axles along z, wheels at z = 0.2 and -0.2."""
    parts = [link("b", "box 0.6 0.2 0.3", 20, origin="0 0.15 0")]
    for name, x, z in (("fl", 0.2, 0.2), ("fr", 0.2, -0.2), ("rl", -0.2, 0.2), ("rr", -0.2, -0.2)):
        parts.append(link(name, "cylinder 0.1 0.05", 1))
        parts.append(joint(f"j{name}", "b", name, kind="continuous", xyz=f"{x} 0 {z}"))
    return f'<robot name="cart">{"".join(parts)}</robot>'
