"""Understanding of a robot as plain data."""

from __future__ import annotations

import json

from roboyard.description.semantic import (
    Arm,
    Conclusion,
    EndEffector,
    Gripper,
    Leg,
    MountedSensor,
    SemanticDescription,
    Wheel,
)
from roboyard.description.semantic_names import with_names
from roboyard.description.understanding import conclusions, understanding


def wheel(name: str, *, driven: bool) -> Wheel:
    return Wheel(
        joint=name, link=f"{name}_link", radius=0.1, centre=(0, 0, 0.1), axis=(0, 1, 0), is_driven=driven
    )


def test_every_field_is_listed_under_its_part() -> None:
    hand = Gripper(kind="two_jaw", palm="palm", joints=("f1",), mimic_joints=("f2",), opening="increasing")
    alone = Gripper(kind="hand", palm="root", joints=("g1", "g2"))
    semantic = SemanticDescription(
        base_link="base",
        kind="mobile_manipulator",
        base="differential",
        wheels=(wheel("w1", driven=True), wheel("roll", driven=False)),
        caster_joints=("swivel", "roll"),
        head_joints=("pan",),
        legs=(Leg(name="left", joints=("hip", "knee"), foot="foot"),),
        arms=(Arm(name="left", joints=("a1", "a2"), end_effector=EndEffector(link="palm", gripper=hand)),),
        grippers=(hand, alone),
        sensors=(MountedSensor(kind="camera", name="front", link="camera_link"),),
    )
    data = json.loads(json.dumps(understanding(semantic)))
    assert (data["kind"], data["base"]) == ("mobile_manipulator", "differential")
    assert data["drive_wheels"] == ["w1"]
    assert data["caster_joints"] == ["swivel", "roll"]
    assert data["legs"] == {"left": ["hip", "knee"]}
    assert data["arms"] == {"left": ["a1", "a2"]} and data["eef_links"] == {"left": "palm"}
    assert data["grippers"] == {"left": ["f1"], "root": ["g1", "g2"]}
    assert data["opening"] == {"left": "increasing", "root": None}
    assert (data["camera_links"], data["lidar_links"]) == ({"front": "camera_link"}, {})


def test_a_conclusion_is_listed_with_its_reasons() -> None:
    found = Conclusion(
        field="base", value="legged", confidence=0.876, evidence=("four feet",), setting="base: x"
    )
    semantic = SemanticDescription(base_link="base", conclusions=(found,))
    assert conclusions(semantic) == [
        {
            "field": "base",
            "value": "legged",
            "confidence": 0.88,
            "evidence": ["four feet"],
            "setting": "base: x",
        }
    ]
    assert (semantic.confidence("base"), semantic.confidence("kind")) == (0.876, None)


def test_new_names_reach_every_part_and_conclusion() -> None:
    hand = Gripper(
        kind="two_jaw", palm="palm", joints=("f1",), links=("l1",), opening_of={"f1": "increasing"}
    )
    semantic = SemanticDescription(
        base_link="base",
        wheels=(wheel("w", driven=True),),
        steer_joints=("f1",),
        arms=(Arm(name="0", joints=("a",), end_effector=EndEffector(link="palm", gripper=hand)),),
        legs=(Leg(name="left", joints=("a",), foot="l1"),),
        sensors=(MountedSensor(kind="imu", name="imu", link="l1"),),
        postures={"rest": {"a": 0.5}},
        conclusions=(Conclusion(field="arms.0", value=["a", "b"], confidence=0.9),),
    )
    new = with_names(semantic, {"palm": "palm_2", "l1": "palm_2", "w_link": "v"}, {"f1": "g1", "a": "a_2"})
    (arm,) = new.arms
    assert (arm.joints, arm.end_effector.link) == (("a_2",), "palm_2")
    gripper = arm.end_effector.gripper
    assert gripper is not None
    assert (gripper.palm, gripper.joints, gripper.links) == ("palm_2", ("g1",), ("palm_2",))
    assert gripper.opening_of == {"g1": "increasing"}
    assert (new.wheels[0].link, new.steer_joints, new.legs[0].foot) == ("v", ("g1",), "palm_2")
    assert (new.sensors[0].link, new.rest) == ("palm_2", {"a_2": 0.5})
    assert new.conclusions[0].value == ["a_2", "b"]
    assert with_names(semantic, {}, {}) is semantic
