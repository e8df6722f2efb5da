"""IMU, force-torque and contact sensors against closed-form mechanics."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboyard.description.model import Inertial, Joint, Limit, Link, Pose, RobotDescription
from roboyard.sensors import ContactSensor, ForceTorqueSensor, Imu
from roboyard.sim import World
from roboyard.transforms import quaternion_from_rpy

from .conftest import solid


def _weight(mass: float, joint: str = "fixed") -> RobotDescription:
    """Return an arm that carries a load 0.3 m from its wrist along x."""
    return RobotDescription(
        name="arm",
        links=(
            solid("base", (0.1, 0.1, 0.1), 1.0),
            Link(
                name="weight",
                inertial=Inertial(
                    mass=mass, origin=Pose(position=(0.3, 0, 0)), inertia=(0.01, 0, 0, 0.01, 0, 0.01)
                ),
            ),
        ),
        joints=(
            Joint(
                name="wrist",
                type=joint,  # type: ignore[arg-type]
                parent="base",
                child="weight",
                axis=(0, 0, 1),
                limit=Limit(lower=-100, upper=100),
            ),
        ),
    )


class TestImu:
    def test_at_rest_the_accelerometer_measures_gravity_upwards(self, world: World) -> None:
        world.add_plane()
        box = world.add_box((0.2, 0.2, 0.2), (0, 0, 0.1))
        tilt = quaternion_from_rpy((0, math.radians(30), 0))
        imu = Imu(box.links[0], position=(0.05, 0, 0.02), orientation=tilt)
        world.step(480)
        seen = imu.observe()
        assert np.linalg.norm(seen["acceleration"]) == pytest.approx(9.81, rel=1e-3)
        assert np.allclose(
            seen["acceleration"], 9.81 * np.array([-math.sin(0.5235988), 0, math.cos(0.5235988)]), atol=0.01
        )
        assert np.allclose(seen["angular_velocity"], 0, atol=1e-3)
        assert np.allclose(seen["orientation"], tilt, atol=1e-3)

    def test_in_free_fall_the_acceleration_is_zero(self, world: World) -> None:
        box = world.add_box((0.2, 0.2, 0.2), (0, 0, 5))
        world.step(20)
        assert np.allclose(Imu(box.links[0]).observe()["acceleration"], 0, atol=1e-9)

    def test_off_axis_imu_measures_centripetal_acceleration(self) -> None:
        world = World(gravity=(0, 0, 0))
        box = world.add_box((0.2, 0.2, 0.2))
        box.set_velocity(angular=(0, 0, 4.0))
        world.step(1)
        seen = Imu(box.links[0], position=(0.1, 0, 0)).observe()
        assert np.allclose(seen["angular_velocity"], (0, 0, 4), atol=1e-6)
        assert np.allclose(seen["acceleration"], (-16 * 0.1, 0, 0), atol=1e-6)

    def test_applied_force_gives_force_over_mass(self) -> None:
        world = World(gravity=(0, 0, 0))
        box = world.add_box((0.2, 0.2, 0.2), mass=2.0)
        box.links[0].apply_wrench((6.0, 0, 0))
        world.step(1)
        assert np.allclose(Imu(box.links[0]).observe()["acceleration"], (3, 0, 0), atol=1e-9)

    def test_observing_does_not_change_the_state(self) -> None:
        def run(*, look: bool) -> np.ndarray:
            world = World()
            world.add_plane()
            box = world.add_box((0.2, 0.2, 0.2), (0, 0, 0.3), quaternion_from_rpy((0.4, 0.2, 0)))
            sensors = [Imu(box.links[0]), ForceTorqueSensor(box.links[0]), ContactSensor(box.links[0])]
            for _ in range(200):
                world.step()
                for sensor in sensors if look else ():
                    sensor.observe()
            return world.data.qpos.copy()

        assert np.array_equal(run(look=True), run(look=False))


class TestForceTorque:
    @pytest.mark.parametrize("kind", ["fixed", "revolute"])
    def test_hanging_load_measures_its_weight(self, world: World, kind: str) -> None:
        arm = world.add_urdf(_weight(2.5, kind), (0, 0, 1), fixed_base=True)
        world.step(240)
        seen = ForceTorqueSensor(arm.link("weight")).observe()
        assert np.allclose(seen["force"], (0, 0, -2.5 * 9.81), rtol=0.01, atol=0.05)
        # r x F with r = (0.3, 0, 0): down at +x turns about +y
        assert np.allclose(seen["torque"], (0, 0.3 * 2.5 * 9.81, 0), rtol=0.01, atol=0.05)

    def test_wrench_is_in_the_sensor_frame_about_its_origin(self, world: World) -> None:
        arm = world.add_urdf(_weight(2.5), (0, 0, 1), fixed_base=True)
        sensor = ForceTorqueSensor(
            arm.link("weight"), position=(0.3, 0, 0), orientation=quaternion_from_rpy((math.pi / 2, 0, 0))
        )
        world.step(10)
        seen = sensor.observe()
        assert np.allclose(seen["force"], (0, -2.5 * 9.81, 0), rtol=0.01, atol=0.05)
        assert np.allclose(seen["torque"], 0, atol=1e-6)

    def test_swinging_load_adds_centrifugal_force(self) -> None:
        world = World(gravity=(0, 0, 0))
        arm = world.add_urdf(_weight(2.0, "revolute"), fixed_base=True)
        arm.joint("wrist").velocity = 5.0
        world.step(1)
        seen = ForceTorqueSensor(arm.link("weight")).observe()
        assert seen["force"][0] == pytest.approx(2.0 * 25 * 0.3, rel=0.01)

    def test_applied_wrench_is_transmitted(self, world: World) -> None:
        arm = world.add_urdf(_weight(1.0), (0, 0, 1), fixed_base=True)
        arm.link("weight").apply_wrench((0, 7.0, 0))
        world.step(1)
        assert ForceTorqueSensor(arm.link("weight")).observe()["force"][1] == pytest.approx(7.0, rel=0.01)


class TestContact:
    def test_contact_force_of_a_resting_box_is_its_weight(self, world: World) -> None:
        world.add_plane()
        table = world.add_box((1, 1, 0.5), (0, 0, 0.25), mass=0, name="table")
        box = world.add_box((0.2, 0.2, 0.2), (0, 0, 0.6), mass=3.0)
        world.step(480)
        under, over = ContactSensor(table.links[0]).observe(), ContactSensor(box.links[0]).observe()
        assert np.allclose(under["force"], (0, 0, -3 * 9.81), rtol=0.01, atol=0.1)
        assert np.allclose(over["force"], (0, 0, 3 * 9.81), rtol=0.01, atol=0.1)
        assert {tuple(row) for row in over["touching"].tolist()} == {(table.id, 0)}
        assert np.allclose(over["positions"][:, 2], 0.5, atol=2e-3)

    def test_falling_body_has_no_contacts(self, world: World) -> None:
        box = world.add_box((0.2, 0.2, 0.2), (0, 0, 3))
        world.step(5)
        seen = ContactSensor(box.links[0]).observe()
        assert len(seen["touching"]) == 0 and np.array_equal(seen["force"], np.zeros(3))
