"""Stand-ins for PyBullet's arms: a panda with its gripper, an iiwa alone and with a two-finger gripper."""

from __future__ import annotations

from assets.palette import pick
from assets.standin import HALF, barrel, fixed, frame, hinge, sdf_document, slab, solid
from assets.urdf import Joint, Link, document

PI = 3.14159265359
QUARTER = 1.57079632679
COLORS = pick("shell", "graphite", "amber", "metal")


def build() -> dict[str, bytes]:
    """Return every file of this group by its path under the assets folder."""
    iiwa, hand = _iiwa("lbr_iiwa_joint_{}", first=1), _gripper()
    arm = _iiwa("J{}", first=0)
    both = [*arm[0], *hand[0]], [*arm[1], *hand[1]]
    sdf = sdf_document("lbr_iiwa_with_wsg50", *both, COLORS, "Arm of seven joints with two jointed fingers.")
    return {
        "franka_panda/panda.urdf": document(
            "panda",
            *_panda(),
            COLORS,
            "Arm of seven joints with a parallel gripper; PyBullet's names and frames.",
        ),
        "kuka_iiwa/model.urdf": document(
            "lbr_iiwa", *iiwa, COLORS, "Arm of seven joints; PyBullet's names and frames."
        ),
        "kuka_iiwa/kuka_with_gripper.sdf": sdf,
        "kuka_iiwa/kuka_with_gripper2.sdf": sdf,
    }


def _panda() -> tuple[list[Link], list[Joint]]:
    name = "panda_link{}".format
    grip = {"lateral_friction": 1.0, "spinning_friction": 0.1, "stiffness": 30000.0, "damping": 1000.0}
    r = 0.056
    links = [
        solid(
            name(0),
            2.9,
            (0, 0, 0.05),
            (-0.156, -0.097, -0.001),
            (0.073, 0.097, 0.141),
            [
                slab((-0.15, -0.08, 0), (0.05, 0.08, 0.05)),
                barrel(0.07, 0, 0.14),
                barrel(0.058, 0.14, 0.16, color="graphite"),
            ],
        ),
        solid(
            name(1),
            2.7,
            (0, -0.04, -0.05),
            (-r, -0.13, -0.193),
            (r, r, r),
            [
                barrel(r, -0.175, -0.03),
                barrel(r, -0.13, 0.056, "y"),
                barrel(0.04, -0.134, -0.13, "y", color="graphite"),
            ],
        ),
        solid(
            name(2),
            2.73,
            (0, -0.04, 0.06),
            (-r, -0.195, -r),
            (r, r, 0.13),
            [
                barrel(r, -0.056, 0.12),
                barrel(r, -0.19, 0.0, "y"),
                barrel(0.04, 0.12, 0.125, color="graphite"),
            ],
        ),
        solid(
            name(3),
            2.04,
            (0.01, 0.01, -0.05),
            (-r, -r, -0.122),
            (0.139, 0.112, r),
            [
                barrel(r, -0.12, 0.04),
                slab((0, -0.045, -0.04), (0.09, 0.045, 0.04)),
                barrel(r, -0.056, 0.11, "y", (0.0825, 0, 0)),
            ],
        ),
        solid(
            name(4),
            2.08,
            (-0.03, 0.03, 0.02),
            (-0.139, -r, -r),
            (r, 0.125, 0.112),
            [
                barrel(r, -0.056, 0.11),
                slab((-0.09, -0.04, -0.045), (0, 0.04, 0.045)),
                barrel(r, 0, 0.12, "y", (-0.0825, 0, 0)),
            ],
        ),
        solid(
            name(5),
            3.0,
            (0, 0.04, -0.12),
            (-r, -r, -0.266),
            (r, 0.131, 0.053),
            [
                barrel(r, -0.26, -0.14),
                barrel(0.045, -0.14, 0.05, at=(0, 0.075, 0)),
                barrel(0.05, -0.05, 0.13, "y"),
            ],
        ),
        solid(
            name(6),
            1.3,
            (0.04, 0, 0),
            (-0.05, -0.052, -0.045),
            (0.133, 0.083, 0.057),
            [
                barrel(0.05, -0.045, 0.055),
                slab((0, -0.04, -0.04), (0.09, 0.04, 0.05)),
                barrel(0.045, -0.05, 0.08, "y", (0.088, 0, 0)),
            ],
        ),
        solid(
            name(7),
            0.2,
            (0, 0, 0.08),
            (-0.046, -0.046, 0.051),
            (0.082, 0.082, 0.108),
            [barrel(0.044, 0.06, 0.107, color="metal"), slab((-0.02, -0.02, 0.075), (0.07, 0.07, 0.1))],
        ),
        frame(name(8)),
        solid(
            "panda_hand",
            0.81,
            (0, 0, 0.04),
            (-0.0315, -0.102, -0.026),
            (0.0315, 0.102, 0.066),
            [slab((-0.03, -0.1, 0), (0.03, 0.1, 0.058)), barrel(0.04, -0.02, 0.01, color="graphite")],
        ),
        solid(
            "panda_leftfinger",
            0.1,
            (0, 0.01, 0.02),
            (-0.0105, 0, 0),
            (0.0105, 0.0265, 0.0539),
            [
                slab((-0.01, 0, 0.018), (0.01, 0.012, 0.0538), "graphite"),
                slab((-0.01, 0.004, 0), (0.01, 0.026, 0.02)),
            ],
            grip,
        ),
        solid(
            "panda_rightfinger",
            0.1,
            (0, -0.01, 0.02),
            (-0.0105, -0.0265, 0),
            (0.0105, 0, 0.0539),
            [
                slab((-0.01, -0.012, 0.018), (0.01, 0, 0.0538), "graphite"),
                slab((-0.01, -0.026, 0), (0.01, -0.004, 0.02)),
            ],
            grip,
        ),
        frame("panda_grasptarget"),
    ]
    rows = [
        ((0, 0, 0.333), 0, 2.9671, 87, 2.175),
        ((0, 0, 0), -QUARTER, 1.8326, 87, 2.175),
        ((0, -0.316, 0), QUARTER, 2.9671, 87, 2.175),
        ((0.0825, 0, 0), QUARTER, (-3.1416, 0.0), 87, 2.175),
        ((-0.0825, 0.384, 0), -QUARTER, 2.9671, 12, 2.61),
        ((0, 0, 0), QUARTER, (-0.0873, 3.8223), 12, 2.61),
        ((0.088, 0, 0), QUARTER, 2.9671, 12, 2.61),
    ]
    joints = []
    for k, (xyz, roll, reach, effort, velocity) in enumerate(rows):
        lower, upper = reach if isinstance(reach, tuple) else (-reach, reach)
        turn = (roll, 0, 0)
        joints.append(
            hinge(
                f"panda_joint{k + 1}",
                name(k),
                name(k + 1),
                xyz,
                turn,
                "0 0 1",
                lower,
                upper,
                effort,
                velocity,
            )
        )
    joints += [
        fixed("panda_joint8", name(7), name(8), (0, 0, 0.107)),
        fixed("panda_hand_joint", name(8), "panda_hand", "0 0 0", (0, 0, -HALF / 2)),
        hinge(
            "panda_finger_joint1",
            "panda_hand",
            "panda_leftfinger",
            (0, 0, 0.0584),
            "0 0 0",
            "0 1 0",
            0,
            0.04,
            20,
            0.2,
            "prismatic",
        ),
        hinge(
            "panda_finger_joint2",
            "panda_hand",
            "panda_rightfinger",
            (0, 0, 0.0584),
            "0 0 0",
            "0 -1 0",
            0,
            0.04,
            20,
            0.2,
            "prismatic",
        ),
        fixed("panda_grasptarget_hand", "panda_hand", "panda_grasptarget", (0, 0, 0.105)),
    ]
    return links, joints


def _iiwa(joint_name: str, first: int) -> tuple[list[Link], list[Joint]]:
    name = "lbr_iiwa_link_{}".format
    r, s = 0.086, 0.068
    links = [
        solid(
            name(0),
            0.0,
            (-0.1, 0, 0.07),
            (-0.136, -0.121, 0),
            (0.121, 0.121, 0.158),
            [barrel(0.12, 0, 0.03), barrel(r, 0.03, 0.15), slab((-0.136, -0.05, 0), (0, 0.05, 0.06))],
        ),
        solid(
            name(1),
            4.0,
            (0, -0.03, 0.12),
            (-r, -0.116, -0.01),
            (r, r, 0.288),
            [
                barrel(r, 0, 0.12),
                barrel(r, -0.11, 0.08, "y", (0, 0, 0.2025)),
                barrel(0.06, -0.116, -0.11, "y", (0, 0, 0.2025), "amber"),
            ],
        ),
        solid(
            name(2),
            4.0,
            (0.0003, 0.059, 0.042),
            (-r, -r, -0.068),
            (r, 0.205, 0.132),
            [barrel(r, -0.06, 0.09), barrel(r, 0, 0.2, "y")],
        ),
        solid(
            name(3),
            3.0,
            (0, 0.03, 0.13),
            (-s, -s, -0.01),
            (s, 0.115, 0.283),
            [barrel(s, 0, 0.14), barrel(s, -0.06, 0.11, "y", (0, 0, 0.2155))],
        ),
        solid(
            name(4),
            2.7,
            (0, 0.067, 0.034),
            (-s, -s, -s),
            (s, 0.185, 0.114),
            [barrel(s, -0.06, 0.1), barrel(s, 0, 0.18, "y"), barrel(0.05, 0.1, 0.114, color="amber")],
        ),
        solid(
            name(5),
            1.7,
            (0.0001, 0.021, 0.076),
            (-s, -s, -0.01),
            (s, 0.099, 0.267),
            [
                barrel(s, 0, 0.12),
                barrel(0.045, 0.1, 0.2, at=(0, 0.05, 0)),
                barrel(0.06, -0.05, 0.09, "y", (0, 0, 0.2155)),
            ],
        ),
        solid(
            name(6),
            1.8,
            (0, 0.0006, 0.0004),
            (-0.066, -0.086, -0.067),
            (0.066, 0.081, 0.071),
            [barrel(0.066, -0.066, 0.066), barrel(0.055, 0, 0.08, "y")],
        ),
        solid(
            name(7),
            0.3 if first else 1.3,
            (0, 0, 0.02),
            (-0.052, -0.052, -0.01),
            (0.052, 0.052, 0.045),
            [barrel(0.05, 0, 0.044, color="metal")],
        ),
    ]
    rows = [
        ((0, 0, 0.1575), "0 0 0", 2.96705972839),
        ((0, 0, 0.2025), (QUARTER, 0, PI), 2.09439510239),
        ((0, 0.2045, 0), (QUARTER, 0, PI), 2.96705972839),
        ((0, 0, 0.2155), (QUARTER, 0, 0), 2.09439510239),
        ((0, 0.1845, 0), (-QUARTER, PI, 0), 2.96705972839),
        ((0, 0, 0.2155), (QUARTER, 0, 0), 2.09439510239),
        ((0, 0.081, 0), (-QUARTER, PI, 0), 3.05432619099),
    ]
    joints = [
        hinge(
            joint_name.format(k + first),
            name(k),
            name(k + 1),
            xyz,
            rpy,
            "0 0 1",
            -reach,
            reach,
            300,
            10,
            dynamics={"damping": 0.5},
        )
        for k, (xyz, rpy, reach) in enumerate(rows)
    ]
    return links, joints


def _gripper() -> tuple[list[Link], list[Joint]]:
    grip = {"lateral_friction": 0.8, "spinning_friction": 0.1}
    links = [
        solid(
            "base_link",
            0.2,
            (0, 0, 0),
            (-0.025, -0.05, 0),
            (0.025, 0.05, 0.045),
            [slab((-0.025, -0.05, 0), (0.025, 0.05, 0.045), "graphite")],
        )
    ]
    joints = [
        hinge(
            "gripper_to_arm",
            "lbr_iiwa_link_7",
            "base_link",
            (0, 0, 0.044),
            "0 0 0",
            "0 0 1",
            0,
            -1,
            0,
            0,
            "continuous",
        )
    ]
    for side, sign in (("left", -1), ("right", 1)):
        finger, base, tip = f"{side}_finger", f"{side}_finger_base", f"{side}_finger_tip"
        x = 0.005 * sign
        links += [
            solid(
                finger,
                0.2,
                (0, 0, 0.04),
                (-0.005, -0.005, 0),
                (0.005, 0.005, 0.08),
                [slab((-0.005, -0.005, 0), (0.005, 0.005, 0.08), "metal")],
            ),
            solid(
                base,
                0.2,
                (0.6 * x, 0, 0.04),
                (min(0, 6 * x), -0.012, 0),
                (max(0, 6 * x), 0.012, 0.085),
                [slab((-0.005, -0.01, 0), (0.005, 0.01, 0.065), "shell")],
                grip,
            ),
            solid(
                tip,
                0.2,
                (x, 0, 0.026),
                (-0.008, -0.012, 0),
                (0.008, 0.012, 0.055),
                [slab((-0.008, -0.012, 0), (0.008, 0.012, 0.055), "graphite")],
                grip,
            ),
        ]
        swing = (-10.4, 10.01) if side == "left" else (-10.01, 10.4)
        curl = (-10.1, 10.3) if side == "left" else (-10.3, 10.1)
        joints += [
            hinge(
                f"base_{side}_finger_joint",
                "base_link",
                finger,
                (0, 0.024, 0.045),
                (0, 0.05 * sign, 0),
                "0 1 0",
                *swing,
                100,
                0,
            ),
            fixed(f"{side}_finger_base_joint", finger, base, (0.001 * sign, 0, 0.0801), (0, 0.25 * sign, 0)),
            hinge(
                f"{side}_base_tip_joint",
                base,
                tip,
                (-0.0034 * sign, 0, 0.0618),
                (0, -0.5 * sign, 0),
                "0 1 0",
                *curl,
                0,
                0,
            ),
        ]
    return links, joints
