"""Save the edits into the robot's files, and import the robot again."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboyard.config.yaml_edit import write_with_backup
from roboyard.errors import ConfigError, RoboyardError
from roboyard.viewer.inspector.edits.edit_state import EditState
from roboyard.viewer.inspector.edits.save_edits import write_config, write_definition, write_planner_files
from roboyard.viewer.inspector.robot_source import RobotSource, package_source
from roboyard.viewer.page.callbacks import in_order
from roboyard.viewer.page.markdown import plain


@dataclass(frozen=True, kw_only=True, slots=True)
class _Import:
    """Arguments of an import in its own thread."""

    config: Path | None
    urdf: Path
    name: str
    data: Path | None
    dataset: str | None
    overwrite: bool
    trial: bool
    definition: str | None
    """Text of the definition to keep in place of the imported one."""


class SavePanel:
    """Buttons that save and import; nothing is written before one is pressed."""

    def __init__(
        self,
        gui: Any,
        source: RobotSource,
        edits: EditState,
        do: Callable[[Callable[[], None]], None],
        reload: Callable[[RobotSource, str], None],
    ) -> None:
        """Add the panel's elements; `reload` shows another robot on the page, and a message."""
        self._source, self._edits, self._do, self._reload = source, edits, do, reload
        self._before = edits.copy()
        self._config = source.config
        self._thread: threading.Thread | None = None
        is_own = source.folder is not None and not source.is_bundled
        self.target = gui.add_text(
            "configuration", str(source.config_target), hint="the import configuration that gets the edits"
        )
        self.write_button = gui.add_button("Write the edits", color="green", hint=_HINT)
        with gui.add_folder("Import"):
            self.replace_box = gui.add_checkbox("replace an existing import of this name", is_own)
            self.keep_box = gui.add_checkbox(
                "keep the definition",
                source.definition is not None,
                hint="otherwise the import writes a new one",
            )
            self.trial_box = gui.add_checkbox("validate and write a report", False, hint="takes longer")
            self.import_button = gui.add_button("Write the edits and import", color="blue")
            self.progress = gui.add_progress_bar(0.0, visible=False)
        self.message = gui.add_markdown("")
        self.write_button.on_click(in_order(lambda _: do(self._write)))
        self.import_button.on_click(in_order(lambda _: do(self.import_again)))

    @property
    def is_changed(self) -> bool:
        """Whether there are unsaved edits."""
        return self._edits != self._before

    def _write(self) -> None:
        self.write()

    def write(self) -> list[Path]:
        """Save all edits; returns the written files.

        Raises:
            ConfigError: a file cannot be written.
        """
        edits, before, source = self._edits, self._before, self._source
        written: list[Path] = []
        in_config = any(
            getattr(edits, part) != getattr(before, part) for part in ("sensors", "spheres", "planner_pairs")
        )
        if in_config:
            target = Path(str(self.target.value).strip() or source.config_target).expanduser()
            if not target.absolute().parent.is_dir():
                raise ConfigError(
                    f"there is no folder {str(target.absolute().parent)!r}; choose another file"
                )
            self._config = write_config(
                target, edits, before, source=self._config, urdf=source.urdf, name=source.name
            )
            written.append(self._config)
        if source.folder is not None and not source.is_bundled:
            written += write_planner_files(source.folder / "curobo", edits, before)
            if source.definition is not None:
                file = write_definition(source.definition, edits, before)
                written += [] if file is None else [file]
        unsaved = edits.physics_pairs != before.physics_pairs and (
            source.definition is None or source.is_bundled
        )
        pairs = before.physics_pairs
        self._before = edits.copy()
        if unsaved:
            self._before.physics_pairs = pairs  # nowhere to write them before an import has made a definition
        names = ", ".join(plain(path.name) for path in written)
        self.message.content = f"Wrote {names}." if written else "No unsaved edits."
        if unsaved:
            self.message.content += " Pairs of the simulation go into the definition that an import makes."
        return written

    def import_again(self) -> None:
        """Save the edits, then import in a thread of its own; the page shows the result when it is done.

        Raises:
            ConfigError: an import is running, or a file cannot be written.
        """
        if self._thread is not None and self._thread.is_alive():
            raise ConfigError(f"an import of {self._source.name!r} is running; wait until it has finished")
        self.write()
        source, folder = self._source, self._source.folder
        own = folder is not None and not source.is_bundled
        keep = self.keep_box.value and source.definition is not None
        job = _Import(
            config=self._config,
            urdf=source.urdf,
            name=source.name,
            data=folder.parents[2] if own and folder is not None else None,
            dataset=folder.parents[1].name if own and folder is not None else None,
            overwrite=bool(self.replace_box.value),
            trial=bool(self.trial_box.value),
            definition=source.definition.read_text(encoding="utf-8") if keep and source.definition else None,
        )
        self.import_button.disabled, self.progress.visible = True, True
        self.message.content = "Importing ..."
        self._thread = threading.Thread(target=self._run, args=(job,), name="roboyard-import", daemon=True)
        self._thread.start()

    def _run(self, job: _Import) -> None:
        """Import the robot, in a thread of its own."""
        from roboyard.importer.pipeline import import_robot

        steps: list[str] = []

        def tell(step: str, share: float, what: str) -> None:
            if step not in steps:
                steps.append(step)
            self.progress.value = min(100.0 * (len(steps) - 1 + share) / max(len(steps) + 1, 14), 100.0)
            self.message.content = f"Importing: {plain(step.replace('_', ' '))} {plain(what)}"

        try:
            result = import_robot(
                None if job.config is not None else job.urdf,
                config=job.config,
                name=job.name if job.config is None and _is_name(job.name) else None,
                out=job.data,
                dataset=job.dataset,
                overwrite=job.overwrite,
                progress=tell,
                validate=job.trial,
                report=job.trial,
            )
            if job.definition is not None:
                write_with_backup(result.definition, job.definition)
            self._finish_pairs(result.definition)
            source = package_source(result.model_folder, result.name, self._config)
        except Exception as error:  # the page reports all errors of an import
            message = str(error) if isinstance(error, RoboyardError) else f"{type(error).__name__}: {error}"
            self._do(lambda: self._failed(message))
            return
        message = f"Imported into {plain(str(result.folder))}; {len(result.warnings)} warnings."
        self._do(lambda: self._finish(source, message))

    def _finish_pairs(self, definition: Path) -> None:
        """Save the page's pairs into the definition, be it the imported or the kept one."""
        from roboyard.config.yaml_lines import read_yaml
        from roboyard.viewer.inspector.edits.edit_state import pair

        data = read_yaml(definition).data
        there = {pair(*one) for one in (data or {}).get("disabled_collision_pairs") or ()}
        before = EditState(physics_pairs=there)
        removed = self._before.physics_pairs - self._edits.physics_pairs
        wanted = (there | self._edits.physics_pairs) - removed
        write_definition(definition, EditState(physics_pairs=wanted), before)

    def _finish(self, source: RobotSource, message: str) -> None:
        """Show the imported robot, or the error if it cannot be loaded."""
        try:
            self._reload(source, message)
        except RoboyardError as error:
            self._failed(str(error))

    def _failed(self, message: str) -> None:
        self.import_button.disabled, self.progress.visible = False, False
        self.message.content = f"**{plain(message)}**"


_HINT = "to the configuration, the planner files and the definition; backups end in .bak"


def _is_name(word: str) -> bool:
    from roboyard.importer.config.schema import NAME_PATTERN

    return NAME_PATTERN.fullmatch(word) is not None
