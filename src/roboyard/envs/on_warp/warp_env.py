"""n environments of a task on MuJoCo Warp, as a `gymnasium.vector.VectorEnv`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Literal

from roboyard.envs.on_warp.warp_physics import WarpPhysics
from roboyard.envs.task import Task
from roboyard.envs.vector_env import BatchEnv


class WarpEnv(BatchEnv):
    """n environments of a task whose time steps MuJoCo Warp makes; otherwise as `BatchEnv`.

    Numbers are of single precision, so that trajectories are near those of `BatchEnv`, not the same.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int,
        *,
        device: str | None = None,
        contacts: int | None = None,
        obs_modalities: Sequence[str] | None = None,
        autoreset: Literal["same_step", "next_step", "disabled"] = "same_step",
        threads: int = 0,
        render_mode: str | None = None,
        state_folder: Path | str | None = None,
    ) -> None:
        """Build the task's world once and copy it.

        Args:
            task: to run.
            num_envs: n.
            device: Warp's name of a device; "cuda:0" by default where there is one, else "cpu".
            contacts: room for contacts of each environment; Warp's own estimate by default.
            obs_modalities: as in `BatchEnv`.
            autoreset: as in `BatchEnv`.
            threads: of the processor, for resets and pictures.
            render_mode: as in `BatchEnv`.
            state_folder: as in `BatchEnv`.

        Raises:
            ConfigError: as in `BatchEnv`, or there is no such device.
            MissingExtraError: MuJoCo Warp is not installed.
            ModelError: the world has rules that copies of it or MuJoCo Warp do not know.
        """
        super().__init__(
            task,
            num_envs,
            obs_modalities=obs_modalities,
            autoreset=autoreset,
            threads=threads,
            render_mode=render_mode,
            state_folder=state_folder,
            make_physics=partial(WarpPhysics, device=device, contacts=contacts),
        )
