"""A fake browser: the client side of a page's protocol."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest


class FakeBrowser:
    """Connects like a page and stores the received messages."""

    def __init__(self, viewer: Any, *, is_slow: bool = False) -> None:
        """Open a page; a slow one has not sent its camera yet, so it is not a client yet."""
        import viser
        from websockets.sync.client import connect

        protocol = f"viser-v{viser.__version__}"
        self.socket = connect(
            f"ws://127.0.0.1:{viewer.port}",
            subprotocols=[protocol],
            max_size=None,
            compression=None,
            close_timeout=0.5,
        )
        self.messages: list[dict[str, Any]] = []
        if not is_slow:
            self.look_from((3.0, 0.0, 1.0))

    def look_from(
        self, position: tuple[float, float, float], look_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        """Send the page's camera."""
        self.send(
            type="ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=position,
            fov=1.0,
            near=0.01,
            far=100.0,
            image_height=480,
            image_width=640,
            look_at=look_at,
            up_direction=(0.0, 0.0, 1.0),
        )

    def send(self, **message: Any) -> None:
        import msgspec

        self.socket.send(msgspec.msgpack.encode(message))

    def listen(self, until: Callable[[dict[str, Any]], bool], seconds: float = 60.0) -> dict[str, Any]:
        """Return the first message that matches; fails the test if there is none in time."""
        import msgspec
        import zstandard

        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                raw = self.socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            size = int.from_bytes(raw[8:16], "little")
            packet = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + size]))
            self.messages.extend(packet["messages"])
            for message in packet["messages"]:
                if until(message):
                    return message
        pytest.fail(f"no matching message in {seconds} s; {len(self.messages)} other messages")

    def close(self) -> None:
        self.socket.close()


@pytest.fixture
def browser() -> Iterator[Callable[..., FakeBrowser]]:
    """Open pages, which are closed when the test ends."""
    opened = []

    def open_page(viewer: Any, **options: Any) -> FakeBrowser:
        opened.append(FakeBrowser(viewer, **options))
        return opened[-1]

    yield open_page
    for page in opened:
        page.close()


@pytest.fixture
def wait() -> Callable[..., None]:
    """Wait until a condition is true; fails the test if it takes too long."""

    def wait_until(so: Callable[[], object], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not so():
            if time.monotonic() > end:
                pytest.fail("waited in vain")
            time.sleep(0.01)

    return wait_until


PENDULUM = """
<robot name="pendulum">
  <link name="base"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <link name="bob">
    <inertial><origin xyz="0 0 -0.4"/><mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 -0.4"/><geometry><sphere radius="0.08"/></geometry></visual>
    <collision><origin xyz="0 0 -0.4"/><geometry><sphere radius="0.08"/></geometry></collision>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="10" velocity="5"/>
  </joint>
</robot>
"""


@pytest.fixture
def pendulum(tmp_path: Any) -> Any:
    """Return the URDF file of a pendulum with one limited hinge."""
    file = tmp_path / "pendulum.urdf"
    file.write_text(PENDULUM)
    return file


GRIPPER = """
<robot name="gripper">
  <link name="palm"><inertial><mass value="2"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="left"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
      <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/></geometry></visual>
    <collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/></geometry></collision></link>
  <link name="right"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
      <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/></geometry></visual></link>
  <link name="nail"/>
  <joint name="grip" type="revolute"><parent link="palm"/><child link="left"/>
    <origin xyz="0.05 0.03 0.2"/><axis xyz="0 0 1"/>
    <limit lower="-0.2" upper="0.8" effort="20" velocity="2"/></joint>
  <joint name="follow" type="revolute"><parent link="palm"/><child link="right"/>
    <origin xyz="0.05 -0.03 0.2"/><axis xyz="0 0 1"/>
    <limit lower="-0.8" upper="0.2" effort="20" velocity="2"/><mimic joint="grip" multiplier="-1"/></joint>
  <joint name="tip" type="fixed"><parent link="left"/><child link="nail"/><origin xyz="0.2 0 0"/></joint>
</robot>
"""


@pytest.fixture(scope="session")
def gripper_text() -> str:
    """Return the URDF of a gripper whose right finger follows the left one."""
    return GRIPPER


@pytest.fixture
def gripper(tmp_path: Any) -> Any:
    """Return the URDF file of a gripper whose right finger follows the left one."""
    file = tmp_path / "gripper.urdf"
    file.write_text(GRIPPER)
    return file
