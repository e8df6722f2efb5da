"""Videos and state logs of a world, and replay of a log in a world set up again."""

from __future__ import annotations

from roboyard.recording.scene_setup import SceneSetup, set_up
from roboyard.recording.state_log import Recorder, StateLog, load_log
from roboyard.recording.video import VideoWriter

__all__ = ["Recorder", "SceneSetup", "StateLog", "VideoWriter", "load_log", "set_up"]
