"""Load a source configuration; all problems are in one error, each with its line."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from roboyard.config.validation_errors import format_validation_error, quoted_input
from roboyard.config.yaml_lines import Where, YamlFile, read_yaml
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.errors import ConfigError, DescriptionError
from roboyard.importer.config.checks import ConfigProblem, check_against
from roboyard.importer.config.schema import ImportConfig

MAX_PROBLEMS = 100


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadedConfig:
    """A valid configuration and its origin."""

    config: ImportConfig
    urdf: Path
    elements: UrdfElements | None = None
    """The URDF, parsed; None where it was not needed yet."""
    file: Path | None = None
    notes: tuple[str, ...] = ()
    """Warnings, as `file:line: key: text`."""
    has_config: bool = True
    """False where every setting is a default because the source is only a robot file."""


def load_config(
    file: Path | str,
    *,
    packages: Mapping[str, Path] | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> LoadedConfig:
    """Load a configuration and check it against its URDF.

    Args:
        file: the YAML file.
        packages: ROS package name to folder, to read the URDF.
        overrides: top-level keys that replace the file's (command line flags).

    Raises:
        ConfigError: something is wrong; the message has one line for each problem, `file:line: key: text`.
    """
    path = Path(file)
    checked = _check(read_yaml(path), path.name, path.parent, packages or {}, overrides or {})
    return checked.usable(path)


def check_data(data: Mapping[str, Any], *, packages: Mapping[str, Path] | None = None) -> LoadedConfig:
    """Check a configuration given as plain data; relative paths count from the working folder.

    Raises:
        ConfigError: something is wrong; one line for each problem, `configuration: key: text`.
    """
    unnumbered = YamlFile(data=dict(data), lines={}, problems=())
    return _check(unnumbered, "configuration", Path(), packages or {}, {}).usable(None)


def audit_config(file: Path | str, packages: Mapping[str, Path] | None = None) -> list[str]:
    """Return all problems of a configuration, as `file:line: key: text`; empty where it is valid."""
    path = Path(file)
    try:
        checked = _check(read_yaml(path), path.name, path.parent, packages or {}, {})
    except ConfigError as error:
        return str(error).splitlines()
    return [*checked.errors, *checked.notes]


@dataclass(frozen=True, kw_only=True, slots=True)
class _Checked:
    config: ImportConfig | None
    urdf: Path | None
    elements: UrdfElements | None
    errors: tuple[str, ...]
    notes: tuple[str, ...]

    def usable(self, file: Path | None) -> LoadedConfig:
        if self.errors or self.config is None or self.urdf is None:
            raise ConfigError("\n".join(self.errors))
        return LoadedConfig(
            config=self.config, urdf=self.urdf, elements=self.elements, file=file, notes=self.notes
        )


def _check(
    yaml_file: YamlFile,
    name: str,
    folder: Path,
    packages: Mapping[str, Path],
    overrides: Mapping[str, Any],
) -> _Checked:
    data = yaml_file.data
    if not isinstance(data, dict):
        fault = "is empty" if data is None else "is no mapping"
        raise ConfigError(f"{name}: the file {fault}; give at least urdf_path and name")
    data = {**data, **overrides}
    problems = [ConfigProblem(where=(), line=line, text=text) for line, text in yaml_file.problems]
    config, found = _validated(data)
    problems += found
    urdf: Path | None = None
    elements: UrdfElements | None = None
    if config is not None:
        urdf = config.urdf_file(folder)
        elements = parse_urdf(urdf, packages=packages, xacro_args=config.xacro_args)
        problems += _against_urdf(config, urdf, elements)
    problems.sort(key=lambda problem: problem.line or yaml_file.line(problem.where) or 10**9)
    errors = [_line_of(problem, name, yaml_file) for problem in problems if not problem.is_note]
    notes = [_line_of(problem, name, yaml_file) for problem in problems if problem.is_note]
    if len(errors) > MAX_PROBLEMS:
        errors = [*errors[:MAX_PROBLEMS], f"{name}: and {len(errors) - MAX_PROBLEMS} more problems"]
    return _Checked(config=config, urdf=urdf, elements=elements, errors=tuple(errors), notes=tuple(notes))


def _against_urdf(config: ImportConfig, urdf: Path, elements: UrdfElements) -> list[ConfigProblem]:
    from roboyard.description import load_description

    if not urdf.is_file():
        return [ConfigProblem(where=("urdf_path",), text=f"there is no file {str(urdf)!r}; check the path")]
    try:
        description = load_description(elements, missing_meshes="note")
    except DescriptionError as error:
        return [ConfigProblem(where=("urdf_path",), text=problem) for problem in error.problems]
    return check_against(config, renamed_view(description))


def renamed_view(description: RobotDescription) -> RobotDescription:
    """Return the description with the names that the import will use."""
    from roboyard.importer.steps.names import planned_names, renamed

    return renamed(description, planned_names(description))


def _line_of(problem: ConfigProblem, name: str, yaml_file: YamlFile) -> str:
    line = problem.line or yaml_file.line(problem.where)
    at = f"{name}:{line}" if line else name
    key = dotted(problem.where)
    return f"{at}: {key}: {problem.text}" if key else f"{at}: {problem.text}"


def dotted(where: Where) -> str:
    """`curobo.collision_spheres.arm[0].radius`"""
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else str(part))
    return text


# ------------------------------------------------------------------------------------------- typed problems


def _validated(data: dict[str, Any]) -> tuple[ImportConfig | None, list[ConfigProblem]]:
    """Return the model and the problems. Invalid values are removed and the rest is validated again, so that
    one run also finds the problems that only the URDF reveals.
    """
    remaining: dict[str, Any] = copy.deepcopy(data)
    problems: list[ConfigProblem] = []
    removed: set[Where] = set()
    for _ in range(12):
        try:
            return ImportConfig.model_validate(remaining), problems
        except ValidationError as error:
            details = error.errors(include_url=False)
        places = [_real_location(detail["loc"], remaining) for detail in details]
        for where, same in _by_place(places, details).items():
            detail = same[0]
            if detail["type"] == "missing" and where in removed:
                # it was there, but wrong: reported already
                if where == ("name",):
                    remaining["name"] = "robot"
                else:
                    removed |= _remove(remaining, where[:-1])
                continue
            text = _either([_text(each, where) for each in same]) + quoted_input(detail)
            problem = ConfigProblem(where=where, text=text)
            if problem not in problems:
                problems.append(problem)
            removed |= _remove(remaining, where)
        if "urdf_path" not in remaining:
            break
    return None, problems


def _by_place(places: Sequence[Where], details: Sequence[Any]) -> dict[Where, list[Any]]:
    found: dict[Where, list[Any]] = {}
    for where, detail in zip(places, details, strict=True):
        found.setdefault(where, []).append(detail)
    return found


def _either(texts: Sequence[str]) -> str:
    """Return one sentence with the requirement of each branch of a union."""
    first, *others = dict.fromkeys(texts)
    return " or ".join([first, *(text.removeprefix("must be ") for text in others)])


def _real_location(location: Sequence[str | int], data: Any) -> Where:
    """Return pydantic's location without the names of union branches, which are no keys of the file."""
    where: list[str | int] = []
    current = data
    for part in location:
        if (isinstance(current, dict) and part in current) or (
            isinstance(current, list) and isinstance(part, int) and part < len(current)
        ):
            where.append(part)
            current = current[part]  # type: ignore[index,call-overload]
        elif isinstance(current, dict) and part == location[-1] and isinstance(part, str):
            where.append(part)  # a required key that is missing
            break
    return tuple(where)


def _remove(data: Any, where: Where) -> set[Where]:
    """Remove the innermost mapping entry on the path `where`; list items keep their places.

    Returns:
        The removed key path.
    """
    for length in range(len(where), 0, -1):
        container = data
        try:
            for part in where[: length - 1]:
                container = container[part]
        except (KeyError, IndexError, TypeError):
            continue
        if isinstance(container, dict) and where[length - 1] in container:
            del container[where[length - 1]]
            return {where[:length]}
    return set()


def _text(detail: Any, where: Where) -> str:
    plain = format_validation_error(detail)
    if plain is not None:
        return plain
    kind, context = detail["type"], detail.get("ctx", {})
    match kind:
        case "extra_forbidden":
            known = list(_fields_at(where[:-1]))
            near = get_close_matches(str(where[-1]), known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            return f"unknown key{hint} (known here: {', '.join(known)})"
        case "missing" if isinstance(detail["loc"][-1], int):
            return f"has {detail['loc'][-1]} numbers and needs more; add them"
        case "missing":
            return "is required; add it"
        case "list_type":
            return "must be a list"
        case "tuple_type":
            return "must be a list of numbers"
        case "too_long" | "too_short":
            wanted = context.get("max_length") or context.get("min_length")
            return f"has {context.get('actual_length')} entries; give {wanted}"
        case "literal_error":
            return f"must be one of {context.get('expected')}, or null where the key allows it"
        case _:
            return str(detail["msg"])


def _fields_at(where: Where) -> Sequence[str]:
    """Return the keys that the model defines at a place."""
    model: type[BaseModel] | None = ImportConfig
    for part in where:
        if model is None or isinstance(part, int) or part not in model.model_fields:
            continue
        model = _model_of(model.model_fields[part].annotation)
    return list(model.model_fields) if model is not None else []


def _model_of(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _model_of(inner)
        if found is not None:
            return found
    return None
