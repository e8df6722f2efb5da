"""Log files, written after each step from startStateLogging to stopStateLogging."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import indices, text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.logs.profile_timings import ProfileTimings

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


DEFAULT_LOG_DOFS = 12
MAX_LOG_DOFS = 10_000
"""Most joints in a record; each takes 8 bytes or more of every record, used or not."""


@command()
def startStateLogging(
    client: Client,
    loggingType: int,
    fileName: str,
    objectUniqueIds: Sequence[int] = (),
    maxLogDof: int = -1,
    bodyUniqueIdA: int = -1,
    bodyUniqueIdB: int = -1,
    linkIndexA: int = -2,
    linkIndexB: int = -2,
    deviceTypeFilter: int = -1,
    logFlags: int = -1,
) -> int | None:
    """Start a log file and return its id; None for an unknown type, or a robot that is not a Minitaur.

    Robot and contact logs start with a line of field names and a line of field types (those of `struct`);
    each record is 0xaa 0xbb and the fields. Videos show the visualizer's camera in simulated time.

    Args:
        loggingType: STATE_LOGGING_GENERIC_ROBOT, _MINITAUR, _CONTACT_POINTS, _VIDEO_MP4, _PROFILE_TIMINGS;
        STATE_LOGGING_ALL_COMMANDS logs the commands (in Roboyard's own format), which
        STATE_REPLAY_ALL_COMMANDS calls again, all at once.
        fileName: file to write.
        objectUniqueIds: bodies to log; empty for all.
        maxLogDof: largest number of joints in a generic robot's record, at most 10,000; the default is 12.
        bodyUniqueIdA: for contacts, only those of this body.
        bodyUniqueIdB: for contacts, only those that also involve this body.
        linkIndexA: for contacts, only those of this link.
        linkIndexB: for contacts, only those with this link.
        deviceTypeFilter: ignored; the log of VR devices has a header and no records.
        logFlags: STATE_LOG_JOINT_MOTOR_TORQUES and _USER_TORQUES (together STATE_LOG_JOINT_TORQUES) add the
        torques of motors and of scripts.

    Raises:
        error: the file cannot be opened, or maxLogDof is too large.
    """
    name = text(fileName)
    kind = whole(loggingType)
    if kind == c.STATE_LOGGING_PROFILE_TIMINGS:
        if client.logs.first_of(ProfileTimings) is not None:
            return None
        try:
            path = client.output_files.path(f"{name}_0.json")
        except OSError as problem:
            raise failure("startStateLogging failed.", str(problem)) from None
        return client.logs.start(ProfileTimings(path))
    if kind == c.STATE_LOGGING_ALL_COMMANDS:
        from roboyard.pybullet.logs.command_logs import CommandLog

        return client.logs.start(CommandLog(client, name))
    if kind == c.STATE_REPLAY_ALL_COMMANDS:
        from roboyard.pybullet.logs.command_logs import Replay

        return client.logs.start(Replay(client, name))
    if kind == c.STATE_LOGGING_VR_CONTROLLERS:
        from roboyard.pybullet.logs.robot_logs import ControllerLog

        return client.logs.start(ControllerLog(client, name))
    if kind == c.STATE_LOGGING_MINITAUR:
        from roboyard.pybullet.logs.robot_logs import MinitaurLog, minitaur_motors

        bodies = indices(objectUniqueIds, "expected a sequence of object ids")
        record = client.scene.bodies.get(bodies[0]) if bodies else None
        motors = None if record is None else minitaur_motors(record)
        return None if motors is None else client.logs.start(MinitaurLog(client, name, bodies[0], motors))
    if kind == c.STATE_LOGGING_GENERIC_ROBOT:
        from roboyard.pybullet.logs.robot_logs import RobotLog

        flags = whole(logFlags)
        bodies = indices(objectUniqueIds, "expected a sequence of object ids")
        dofs = whole(maxLogDof) if whole(maxLogDof) >= 0 else DEFAULT_LOG_DOFS
        if dofs > MAX_LOG_DOFS:
            remedy = f"maxLogDof is at most {MAX_LOG_DOFS}, got {dofs}"
            raise failure("startStateLogging failed.", remedy)
        torques = flags & c.STATE_LOG_JOINT_TORQUES if flags > 0 else 0
        log = RobotLog(client, name, bodies, dofs, torques)
        client.scene.records_user_torques |= log.records_user_torques
        return client.logs.start(log)
    if kind == c.STATE_LOGGING_CONTACT_POINTS:
        from roboyard.pybullet.logs.robot_logs import ContactLog

        wanted = whole(bodyUniqueIdA), whole(bodyUniqueIdB), whole(linkIndexA), whole(linkIndexB)
        return client.logs.start(ContactLog(client, name, wanted))
    if kind == c.STATE_LOGGING_VIDEO_MP4:
        from roboyard.pybullet.logs.videos import open_video

        return client.logs.start(open_video(client, name))
    return None


@command()
def stopStateLogging(client: Client, loggingId: int) -> None:
    """Close a log file; an unknown id is ignored."""
    client.logs.stop(whole(loggingId))


@command()
def submitProfileTiming(client: Client, eventName: str | None = None) -> None:
    """Open a span in the timings log; without a name, close the span opened last."""
    timings = client.logs.first_of(ProfileTimings)
    if timings is None:
        return
    if eventName is None:
        timings.pop()
    else:
        timings.push(text(eventName))
