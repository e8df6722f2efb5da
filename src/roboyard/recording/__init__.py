"""Films and state logs of a world, and worlds set up again from a log."""

from __future__ import annotations

from roboyard.recording.film import Film
from roboyard.recording.log import Recorder, StateLog, load_log
from roboyard.recording.stage import Stage, set_up

__all__ = ["Film", "Recorder", "Stage", "StateLog", "load_log", "set_up"]
