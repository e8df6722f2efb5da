"""Load a definition file: all problems in one error, each with its line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from roboyard.config.validation_errors import format_validation_error, quoted_input
from roboyard.config.yaml_lines import YamlFile, parse_yaml, read_yaml
from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError
from roboyard.robots.definition.checks import ConfigProblem, check_against, check_alone
from roboyard.robots.definition.names import Where
from roboyard.robots.definition.schema import EndEffectorVariant, RobotDefinition

MISSING = "is required; add it"
"""Message for a missing key."""
UNKNOWN = "unknown key"
"""Beginning of the message for an unknown key."""


def load_definition(file: Path | str, description: RobotDescription | None = None) -> RobotDefinition:
    """Load and check a definition file.

    Args:
        file: YAML.
        description: of the robot; if given, link and joint names and vector lengths are also checked.

    Raises:
        ConfigError: one line for each problem, `file:line: key: problem; remedy`.
    """
    path = Path(file)
    return _checked(read_yaml(path), path.name, description)


def parse_definition(
    source: str | Mapping[str, Any], description: RobotDescription | None = None, *, name: str = "definition"
) -> RobotDefinition:
    """Load and check a definition from YAML text or plain data.

    Args:
        source: YAML text, or its data.
        description: of the robot; if given, link and joint names and vector lengths are also checked.
        name: of the file in messages.

    Raises:
        ConfigError: one line for each problem.
    """
    if isinstance(source, str):
        return _checked(parse_yaml(source, name), name, description)
    return _checked(YamlFile(data=dict(source), lines={}, problems=()), name, description)


def check_fits(
    definition: RobotDefinition,
    description: RobotDescription,
    *,
    name: str = "definition",
    file: Path | None = None,
    end_effector: str | None = None,
) -> None:
    """Check names and vector lengths of a definition against its robot.

    Args:
        definition: of the robot.
        description: its links and joints.
        name: of the file in messages.
        file: of the definition, for line numbers.
        end_effector: the variant whose fields replace the definition's.

    Raises:
        ConfigError: one line for each problem.
    """
    problems = check_against(definition, description)
    if end_effector is not None:
        problems = [replace(p, where=_in_variant(p.where, end_effector)) for p in problems]
    if problems:
        yaml_file = None if file is None else read_yaml(file)
        raise ConfigError("\n".join(_message(problem, name, yaml_file) for problem in problems))


def _in_variant(where: Where, end_effector: str) -> Where:
    """Return the location in a variant that replaces a location of the definition."""
    own = where[1:] if where[0] == "manipulation" else where
    if own and own[0] in EndEffectorVariant.model_fields:
        return ("manipulation", "end_effectors", end_effector, *own)
    return where


def _checked(yaml_file: YamlFile, name: str, description: RobotDescription | None) -> RobotDefinition:
    if yaml_file.problems:
        raise ConfigError("\n".join(f"{name}:{line}: {text}" for line, text in yaml_file.problems))
    if not isinstance(yaml_file.data, dict):
        problem = "is empty" if yaml_file.data is None else "is not a mapping"
        raise ConfigError(
            f"{name}: the file {problem}; give at least raw_controller_order and default_controllers"
        )
    try:
        definition = RobotDefinition.model_validate(yaml_file.data)
    except ValidationError as error:
        problems = _typed_problems(error, yaml_file.data)
        raise ConfigError("\n".join(_message(problem, name, yaml_file) for problem in problems)) from None
    found = [] if description is None else check_against(definition, description)
    found = _once([*found, *check_alone(definition, with_lengths=description is None)])
    if found:
        raise ConfigError("\n".join(_message(problem, name, yaml_file) for problem in found))
    return definition


def _once(problems: Iterable[ConfigProblem]) -> list[ConfigProblem]:
    """Return the problems without those at, above or below the location of an earlier one."""
    kept: list[ConfigProblem] = []
    for problem in problems:
        mine = problem.where
        if not any(one.where[: len(mine)] == mine[: len(one.where)] for one in kept):
            kept.append(problem)
    return kept


def _message(problem: ConfigProblem, name: str, yaml_file: YamlFile | None) -> str:
    line = None if yaml_file is None else yaml_file.line(problem.where)
    at = f"{name}:{line}" if line else name
    return f"{at}: {dotted(problem.where)}: {problem.text}"


def dotted(where: Where) -> str:
    """Return a location as text: `manipulation.arm_joint_names.left[2]`."""
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else str(part))
    return text


def _typed_problems(error: ValidationError, data: Any) -> list[ConfigProblem]:
    """Return Pydantic's errors as sentences, one for each field."""
    found: dict[Where, ConfigProblem] = {}
    for detail in error.errors(include_url=False):
        where = _location(detail["loc"], data)
        if where not in found:
            found[where] = ConfigProblem(where=where, text=_text(detail, where) + quoted_input(detail))
    return [problem for where, problem in found.items() if not _is_misspelled(where, found)]


def _is_misspelled(where: Where, found: Mapping[Where, ConfigProblem]) -> bool:
    """Return whether a missing key is present under a misspelled name."""
    if found[where].text != MISSING:
        return False
    beside = [
        str(other[-1])
        for other, problem in found.items()
        if other[:-1] == where[:-1] and problem.text.startswith(UNKNOWN)
    ]
    return bool(get_close_matches(str(where[-1]), beside, n=1))


def _location(location: Sequence[str | int], data: Any) -> Where:
    """Return Pydantic's location without the names of union branches, which are not keys of the file."""
    where: list[str | int] = []
    current: Any = data
    for k, part in enumerate(location):
        if isinstance(current, dict) and part in current:
            current = current[str(part)]
        elif isinstance(current, list | tuple) and isinstance(part, int) and part < len(current):
            current = current[part]
        elif not (isinstance(current, dict) and isinstance(part, str) and k == len(location) - 1):
            continue
        where.append(part)
    return tuple(where)


def _text(detail: Any, where: Where) -> str:
    plain = format_validation_error(detail)
    if plain is not None:
        return plain
    kind, context = detail["type"], detail.get("ctx", {})
    match kind:
        case "extra_forbidden":
            known = fields_at(RobotDefinition, where[:-1])
            near = get_close_matches(str(where[-1]), known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            return f"{UNKNOWN}{hint} (known here: {', '.join(known)})"
        case "missing":
            return MISSING
        case "list_type" | "tuple_type":
            return "must be a list"
        case "literal_error":
            return f"must be one of {context.get('expected')}"
        case _:
            return str(detail["msg"])


def fields_at(model: type[BaseModel], where: Iterable[str | int]) -> list[str]:
    """Return the keys of a model at a location."""
    current: type[BaseModel] | None = model
    for part in where:
        if current is None:
            break
        if part in current.model_fields:
            current = _model_in(current.model_fields[str(part)].annotation)
    return list(current.model_fields) if current is not None else []


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        found = _model_in(inner)
        if found is not None:
            return found
    return None
