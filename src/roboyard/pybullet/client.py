"""A client: one connection to a world in this process, and the state it keeps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard._lazy import paused_collection
from roboyard.pybullet.bullet_rules.picture_light import PictureLight
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.direct_calls import PREPARED
from roboyard.pybullet.logs.log_set import LogSet
from roboyard.pybullet.state.debug_items import DebugItems
from roboyard.pybullet.state.engine_parameters import EngineParameters
from roboyard.pybullet.state.file_search import OF_PROCESS
from roboyard.pybullet.state.input_events import Keyboard, Mouse
from roboyard.pybullet.state.output_files import OutputFiles
from roboyard.pybullet.state.user_data import UserData
from roboyard.pybullet.state.visualizer_camera import VisualizerCamera

if TYPE_CHECKING:
    from roboyard.pybullet.state.file_mounts import FileMounts
    from roboyard.pybullet.state.physics_scene import PhysicsScene


class Client:
    """A connection to a world in this process. Every command of the table is a method of it."""

    is_alive = True
    """Whether it answers; a server may not."""

    def __init__(self, method: int = c.DIRECT) -> None:
        """Create a client without a world; the world is created on first use.

        Args:
            method: connection method (DIRECT, GUI, ...).
        """
        self.method = method
        self.search = OF_PROCESS
        self.searched: Path | None = None
        """The folder that this client itself has searched last."""
        self.named_folders: dict[Path, None] = {}
        """Folders that the script searched or loaded a file from; its later files may name meshes there."""
        self.parameters = EngineParameters()
        self.debug_items = DebugItems()
        self.visualizer = VisualizerCamera()
        self.light = PictureLight()
        self.picture_planes = 0.01, 1000.0
        """Near and far plane (m) of the last picture; of the next one that is not given a camera."""
        self.keyboard, self.mouse = Keyboard(), Mouse()
        self.user_data = UserData()
        self.logs = LogSet()
        self.output_files = OutputFiles()
        """Where commands may write."""
        self._first_texture = 0
        self.mounts: FileMounts | None = None
        """Folders and zip files in which files are searched, once the fileIOPlugin is loaded."""
        self.prepared: dict[str, dict[int, Any]] = {kind: {} for kind in PREPARED}
        """Arrays of bodies for commands that are machine code, by kind and body."""
        self._history: Any = ()
        """Bodies that the script created step by step before the last reset; the body pool reuses them."""
        self._former: Any = None
        """The world before the last reset; one that is built alike takes over its compiled model."""

    scene: PhysicsScene
    """The bodies and their world, created on first use."""

    def __getattr__(self, name: str) -> Any:
        """Create the scene when it is first used, and enter a command in the class when it is first called.

        Raises:
            AttributeError: any other attribute that does not exist.
        """
        if name in COMMANDS:
            setattr(Client, name, COMMANDS[name].function)
            return getattr(self, name)
        if name != "scene":
            raise AttributeError(f"Client has no attribute {name!r}")
        with paused_collection():
            from roboyard.pybullet.state.physics_scene import PhysicsScene

        self.scene = PhysicsScene(self.parameters, self._first_texture)
        self.scene.world.prepared = self.prepared
        self.scene.world.pool.restore_history(self._history)
        self.scene.world.compiles.former, self._former = self._former, None
        return self.scene

    def _release_scene(self) -> None:
        for known in self.prepared.values():
            known.clear()
        scene = self.__dict__.pop("scene", None)
        if scene is not None:
            scene.release()

    def reset(self) -> None:
        """Remove everything from the world; settings stay except gravity and solver iterations."""
        if "scene" in self.__dict__:
            self._first_texture = self.scene.textures.following
            self._history = self.scene.world.pool.history
            self._former = self.scene.world.retire()
        self._release_scene()
        self.user_data = UserData()
        self.parameters.reset()

    def follow_clock(self, real_time: bool) -> None:
        """Start or stop stepping in real time. Only clients with a window do; this one ignores it."""

    def file_mounts(self) -> FileMounts:
        """Return the mounts of the fileIOPlugin, which exist from its first loading on."""
        if self.mounts is None:
            from roboyard.pybullet.state.file_mounts import FileMounts

            self.mounts = FileMounts()
        return self.mounts

    def close_mounts(self) -> None:
        """Remove the mounts of the fileIOPlugin."""
        if self.mounts is not None:
            self.mounts.close()
            self.mounts = None

    def close(self) -> None:
        """Close the log files and free the world."""
        self.logs.stop_all()
        self.close_mounts()
        self._release_scene()
        self._former = None
