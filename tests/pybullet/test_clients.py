from __future__ import annotations

import subprocess
import sys

import pytest

import roboyard.pybullet as p
from roboyard.pybullet.bullet_client import BulletClient


def test_numbers_are_given_out_from_the_lowest_free(client: int) -> None:
    more = [p.connect(p.DIRECT) for _ in range(3)]
    assert [client, *more] == [0, 1, 2, 3]
    p.disconnect(2)
    p.disconnect(1)
    assert [p.connect(p.DIRECT) for _ in range(3)] == [1, 2, 4]


def test_connection_info(client: int) -> None:
    assert p.getConnectionInfo() == {"isConnected": 1, "connectionMethod": p.DIRECT}
    assert p.getConnectionInfo(7) == {"isConnected": 0, "connectionMethod": 0}
    assert (p.isConnected(), p.isConnected(7)) == (1, 0)
    p.disconnect()
    assert p.isConnected() == 0


def test_a_closed_client_raises_with_a_remedy(client: int) -> None:
    p.disconnect(client)
    with pytest.raises(p.error, match=r"(?m)^Not connected to physics server\.$") as caught:
        p.setGravity(0, 0, 0)
    assert "connect(DIRECT)" in caught.value.__notes__[0]
    with pytest.raises(p.error, match="Not connected"):
        p.disconnect(client)
    assert type(caught.value).__name__ == "error"
    assert issubclass(p.error, Exception)


def test_unknown_methods_raise_and_missing_servers_do_not() -> None:
    with pytest.raises(p.error, match=r"(?m)^connectPhysicsServer unexpected argument$"):
        p.connect(77)
    assert p.connect(p.SHARED_MEMORY, 424242) == -1
    for wrong in (lambda: p.connect(), lambda: p.connect("DIRECT"), lambda: p.connect(p.DIRECT, nope=1)):
        with pytest.raises(TypeError):
            wrong()
    with pytest.raises(p.error, match="not available"):
        p.connect(p.GRAPHICS_SERVER)


def test_calling_forms_of_connect() -> None:
    numbers = [
        p.connect(p.DIRECT),
        p.connect(method=p.DIRECT, key=3),
        p.connect(p.DIRECT, options="--mp4=x.mp4"),
        p.connect(p.DIRECT, "localhost", 7),
        p.connect(p.DIRECT, hostName="localhost", options=""),
    ]
    assert numbers == [0, 1, 2, 3, 4]
    for number in numbers:
        p.disconnect(number)


def test_there_is_one_window(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOYARD_VIEWER", "0")
    for _ in range(2):
        number = p.connect(p.GUI, options="--width=300 --anything")
        assert p.getConnectionInfo(number)["connectionMethod"] == p.GUI
        with pytest.raises(p.error, match=r"(?m)^Only one local in-process GUI"):
            p.connect(p.GUI)
        p.disconnect(number)
    assert capsys.readouterr() == ("", "")


def test_without_viser_a_window_says_once_how_to_install_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROBOYARD_VIEWER", raising=False)
    monkeypatch.setitem(sys.modules, "viser", None)
    monkeypatch.setattr("roboyard.pybullet.window.opener._printed", set())
    for _ in range(2):
        number = p.connect(p.GUI)
        assert p.getConnectionInfo(number)["connectionMethod"] == p.GUI
        p.setRealTimeSimulation(1, physicsClientId=number)
        p.stepSimulation(number)
        p.disconnect(number)
    said = capsys.readouterr().err
    assert said.count("roboyard:") == 1
    assert 'the extra "gui": pip install "viser' in said


def test_clients_are_independent(client: int) -> None:
    other = p.connect(p.DIRECT)
    p.setGravity(0, 0, -1)
    p.setGravity(0, 0, -2, physicsClientId=other)
    gravities = [p.getPhysicsEngineParameters(n)["gravityAccelerationZ"] for n in (client, other)]
    assert gravities == [-1.0, -2.0]


def test_bullet_client_objects_know_their_client() -> None:
    first, second = BulletClient(p.DIRECT), BulletClient(p.DIRECT)
    first.setGravity(0, 0, -1)
    second.setGravity(0, 0, -2)
    assert first.getPhysicsEngineParameters()["gravityAccelerationZ"] == -1.0
    assert second.getPhysicsEngineParameters()["gravityAccelerationZ"] == -2.0
    assert first.DIRECT == p.DIRECT
    number = second._client
    second.disconnect()
    assert p.isConnected(number) == 0
    number = first._client
    del first
    assert p.isConnected(number) == 0


def test_engine_parameters_keep_what_was_set(client: int) -> None:
    assert p.getPhysicsEngineParameters() == {
        "fixedTimeStep": 1 / 240,
        "numSubSteps": 0,
        "numSolverIterations": 50,
        "useRealTimeSimulation": 0,
        "gravityAccelerationX": 0.0,
        "gravityAccelerationY": 0.0,
        "gravityAccelerationZ": 0.0,
        "numNonContactInnerIterations": 1,
    }
    p.setTimeStep(0.01)
    p.setPhysicsEngineParameter(numSolverIterations=77, numSubSteps=3, erp=0.1)
    p.setRealTimeSimulation(1)
    found = p.getPhysicsEngineParameters()
    assert (found["fixedTimeStep"], found["numSolverIterations"], found["numSubSteps"]) == (0.01, 77, 3)
    p.setPhysicsEngineParameter(fixedTimeStep=0.02)
    assert p.getPhysicsEngineParameters()["fixedTimeStep"] == 0.02
    assert p.getPhysicsEngineParameters()["numSubSteps"] == 3


def test_a_client_disconnects_when_python_ends() -> None:
    """As `pybullet_utils.bullet_client` does, whose objects may go after all modules."""
    program = """
import builtins
import roboyard.pybullet as p

class Client:
    def __init__(self):
        self.number = p.connect(p.DIRECT)

    def __del__(self):
        try:
            p.disconnect(physicsClientId=self.number)
        except p.error:
            pass

builtins.kept = Client()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
