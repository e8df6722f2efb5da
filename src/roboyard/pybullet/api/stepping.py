"""Stepping, collision detection, and saved states in memory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from roboyard.errors import ModelError
from roboyard.pybullet.face.arguments import whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_detection, replace_step
from roboyard.pybullet.state.contacts import touching

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@command()
def stepSimulation(client: Client) -> tuple[Any, ...]:
    """Advance by one time step and return ()."""
    scene = client.scene
    scene.step()
    if client.logs:
        client.logs.after_step()
    if is_machine_code("stepSimulation"):
        from roboyard.pybullet.fast.steps.step_entries import prepare

        prepare(scene, client.logs)
    return ()


@command()
def performCollisionDetection(client: Client) -> None:
    """Detect the contacts at the current positions without stepping."""
    scene = client.scene
    scene.world.detect_contacts()
    scene.last_step.drop()
    if scene.new_bodies:
        scene.note_boxes()
    if is_machine_code("performCollisionDetection"):
        from roboyard.pybullet.fast.steps.detection_entries import prepare

        prepare(scene)


@command()
def saveState(client: Client) -> int:
    """Save the positions and velocities of all bodies in memory and return the state's id."""
    scene = client.scene
    number = scene.state_ids.take()
    contacts = tuple(touching(scene))
    if contacts:
        scene.state_contacts[number] = contacts
    scene.states[number] = replace(scene.world.save_state(), friction=None)  # as in Bullet
    return number


@command()
def removeState(client: Client, stateUniqueId: int) -> None:
    """Remove a saved state; an unknown id is ignored."""
    scene = client.scene
    if scene.states.pop(whole(stateUniqueId), None) is not None:
        scene.state_contacts.pop(stateUniqueId, None)
        scene.state_ids.free(stateUniqueId)


@command()
def restoreState(client: Client, stateId: int = -1, fileName: str = "") -> None:
    """Restore a state saved in memory or in a file; motors keep their targets.

    Raises:
        error: the state does not exist, or it does not match the current bodies.
    """
    scene = client.scene
    if fileName:
        from roboyard.pybullet.api.saved_files import restore_from_file

        restore_from_file(client, fileName)
        return
    state = scene.states.get(whole(stateId))
    if state is None:
        raise failure(
            "Couldn't restore state.",
            f"there is no saved state {stateId}; saved states: {sorted(scene.states)}",
        )
    scene.last_step.restore(scene.state_contacts.get(stateId, ()))
    try:
        scene.world.restore_state(state, keeps_points=True, by_place=True)
    except ModelError as problem:
        raise failure("Couldn't restore state.", str(problem)) from None
    for record in scene.bodies.values():
        record.fixed_poses = record.placed = None
    scene.frames_are_old = True


START.later(replace_detection, "performCollisionDetection")
START.later(replace_step, "stepSimulation")
