"""The child process of `roboyard.description.xacro.expand`: expand one file, as JSON from stdin to stdout.

Files to include whose package is not on this machine are omitted, and so are calls of macros that nothing
defines then: most are accessories. What is omitted is noted; a file of which no link is left is an error.

Files of before 2015 name elements of xacro without prefix. Today's xacro leaves such elements in its output,
and so does this one, unless no link comes out then: they count as elements of xacro in a second try.

It runs the `xacro` package with four replacements: expressions are evaluated by
`roboyard.description.xacro.expressions`, files are opened through the `Resolver` of the robot, `$(find NAME)`
gives `package://NAME`, and environment variables that look like secrets count as unset. The process may not
write files and has bounds on memory and CPU time.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
import traceback
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.dom import Node, minidom
from xml.dom.expatbuilder import ExpatBuilderNS
from xml.parsers import expat

from roboyard.description.files.resolver import Resolver
from roboyard.description.xacro.expressions import evaluate
from roboyard.errors import DescriptionError

MAX_MEMORY = 1 << 30
"""Bytes of address space."""
MAX_CPU = 10
"""Seconds of CPU time."""
MAX_FILE = 32 * 1024 * 1024
"""Bytes of one file that is included."""
MAX_FILES = 2_000
"""Files opened in all."""
_SECRET = re.compile(r"token|secret|passw|credential|private|api_?key|access_?key", re.IGNORECASE)
_FOUND = "package://"
_LINE = "roboyard.line"
_WITHOUT_PREFIX = {"property": "name", "macro": "name", "include": "filename", "insert_block": "name"}
"""Elements that old files write without prefix, and the attribute that each has."""


class _Files:
    """Opens what the robot may read, and remembers which file each open path was."""

    def __init__(self, main: Path, resolver: Resolver) -> None:
        self.main, self.resolver = main, resolver
        self.opened = 0

    def read(self, name: str) -> bytes:
        """Content of a file named by xacro: a path, perhaps with `package://` somewhere in it."""
        self.opened += 1
        if self.opened > MAX_FILES:
            raise DescriptionError(f"more than {MAX_FILES} files are included; remove circular includes")
        path = self.main if name == str(self.main) else self.find(name)
        with path.open("rb") as stream:
            data = stream.read(MAX_FILE + 1)
        if len(data) > MAX_FILE:
            raise DescriptionError(f"{name}: over {MAX_FILE >> 20} MiB is too large for a file to include")
        return data

    def find(self, name: str) -> Path:
        """The file, inside the robot's folders."""
        found = self.resolver.resolve(_uri(name))
        if found.path is None:
            error = FileNotFoundError(2, found.problem or "no such file", _uri(name))
            raise error
        return found.path

    def has_package(self, name: str) -> bool:
        """Return whether the package of a file named by xacro is known; True for one without package."""
        uri = _uri(name)
        if not uri.startswith(_FOUND):
            return True
        return self.resolver.package_folder(uri.removeprefix(_FOUND).partition("/")[0]) is not None

    def glob(self, pattern: str) -> list[str]:
        """Names of the files that match a pattern in the last part of a path."""
        folder, _, last = pattern.rpartition("/")
        if folder.startswith(_FOUND) or _FOUND in folder or re.search(r"[*[?]", folder):
            return []
        return sorted(str(path) for path in Path(folder).glob(last) if path.is_file())


def _uri(name: str) -> str:
    start = name.rfind(_FOUND)
    return name[start:] if start >= 0 else name


class _LineBuilder(ExpatBuilderNS):
    """Builds a DOM whose elements know their file and line, also after they are cloned."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file = file

    def start_element_handler(self, name: str, attributes: Any) -> None:
        super().start_element_handler(name, attributes)
        element: Any = self.curNode
        line = self.getParser().CurrentLineNumber
        element.setUserData(_LINE, (self.file, line), _KEEP_LINE)


class _KeepLine:
    """Gives the copy of an element the line of the original, as DOM's UserDataHandler."""

    def handle(self, operation: int, key: str, data: Any, source: Any, copy: Any) -> None:
        if copy is not None:
            copy.setUserData(key, data, self)


_KEEP_LINE = _KeepLine()


def _parse(data: bytes, file: str) -> minidom.Document:
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise DescriptionError("a DTD or an entity is not read; remove <!DOCTYPE ...> and <!ENTITY ...>")
    return _LineBuilder(file).parseString(data)


def _without_prefix(root: Any) -> list[Any]:
    """Return the elements of xacro that have no prefix, as files of before 2015 write them."""
    found, todo = [], [root]
    while todo:
        for child in todo.pop().childNodes:
            if child.nodeType != Node.ELEMENT_NODE:
                continue
            needs = _WITHOUT_PREFIX.get(child.tagName)
            if needs is not None and child.getAttribute(needs):
                found.append(child)
            if child.tagName.removeprefix("xacro:") in ("macro", "if", "unless"):
                todo.append(child)
    return found


def _environment(name: str, default: str | None = None) -> str:
    value = None if _SECRET.search(name) else os.environ.get(name)
    if value is None and default is None:
        raise KeyError(f"environment variable {name} is not set")
    return value if value is not None else str(default)


def expand(main: Path, resolver: Resolver, arguments: dict[str, str]) -> dict[str, Any]:
    """Expand a file.

    Returns:
        `{"xml": text, "lines": [[file, line], ...], "absent": [[what, reason], ...], "bare": [[tag, file,
        line], ...], "prefixed": bool}`, `lines` with one entry an element in document order, `absent` with
        what was omitted: files whose package is not known, calls of their macros; `bare` the elements of
        xacro without prefix, `prefixed` whether they were read as such; or the failure: `error`, `kind`,
        `file` and `line`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import xacro
        import xacro.substitution_args as substitution
    files, absent = _Files(main, resolver), list[tuple[str, str]]()
    bare: list[tuple[str, str, int]] = []
    is_old = [False]
    """Whether elements without prefix count as xacro's."""
    mappings = (xacro.NameSpace, xacro.YamlDictWrapper)

    def safe_eval(expression: str, names: Any, more: Any = None) -> Any:
        return evaluate(expression, names, more, mappings)

    def parse(given: Any, filename: str | None = None) -> Any:
        if given is not None:
            return _parse(given.encode() if isinstance(given, str) else given.read(), str(main))
        assert filename is not None
        try:
            document = _parse(files.read(filename), filename)
        except OSError as error:
            if not files.has_package(filename):
                absent.append((_uri(filename), str(error.strerror)))
                return _parse(b"<robot/>", filename)
            xacro.filestack.pop()
            raise xacro.XacroException(str(error.strerror), exc=error) from None
        for element in _without_prefix(document.documentElement):
            bare.append((element.tagName, *element.getUserData(_LINE)))
            if is_old[0]:
                element.tagName = element.nodeName = f"xacro:{element.tagName}"
        return document

    def open_file(filename: Any, *args: Any, **kwargs: Any) -> Any:
        return io.StringIO(files.read(str(filename)).decode("utf-8", "replace"))

    def evaluate_substitution(text: str, context: dict[str, Any]) -> str:
        given = context.setdefault("arg", {})
        names = {
            **substitution._eval_dict,
            **{k: substitution.convert_value(v, "auto") for k, v in given.items()},
        }
        names["arg"] = lambda name: substitution.convert_value(given[name], "auto")
        names["dirname"] = lambda: str(main.parent)
        return str(evaluate(text, names))

    substitution._eval_env = _environment
    substitution._eval_optenv = lambda name, default="": _environment(name, default)
    substitution._eval_find = lambda name: f"{_FOUND}{name}"
    substitution._eval_dirname = lambda name: str(main.parent)
    substitution._eval = evaluate_substitution
    substitution._eval_dict = {
        name: value for name, value in substitution._eval_dict.items() if not name.startswith("_")
    } | {
        "env": substitution._eval_env,
        "optenv": substitution._eval_optenv,
        "find": substitution._eval_find,
        **{kind.__name__: kind for kind in (list, dict, map, str, float, int)},
    }
    for module, name, value in (
        (xacro, "safe_eval", safe_eval),
        (xacro, "parse", parse),
        (xacro, "open", open_file),
        (xacro, "glob", SimpleNamespace(glob=files.glob)),
        (xacro, "root_dir", str(main.parent)),
    ):
        setattr(module, name, value)
    call_macro = xacro.handle_macro_call

    def handle_macro_call(node: Any, macros: Any, symbols: Any) -> bool:
        try:
            return call_macro(node, macros, symbols)
        except xacro.XacroException as error:
            if not absent or str(error) != f"unknown macro name: {node.tagName}":
                raise
            absent.append((f"<{node.tagName}>", "a file that was omitted may define it"))
            xacro.replace_node(node, by=None)
            return True

    xacro.handle_macro_call = handle_macro_call
    for name in ("vars", "type", "hash"):
        xacro._global_symbols["python"].pop(name, None)

    def processed(*, properties_first: bool) -> minidom.Document:
        xacro.init_stacks(str(main))
        absent.clear()
        bare.clear()
        document = parse(None, str(main))
        if properties_first:
            _move_properties_first(document.documentElement)
        given = _with_name(document.documentElement, arguments, main)
        xacro.process_doc(document, mappings=dict(given), verbosity=0)
        return document

    def either_order() -> minidom.Document:
        try:
            return processed(properties_first=False)
        except xacro.XacroException as error:
            if "is not defined" not in str(error):
                raise
            first = error, list(xacro.filestack or ())
            try:
                return processed(properties_first=True)
            except Exception:
                xacro.filestack[:] = first[1]
                raise first[0] from None

    def either_prefix() -> minidom.Document:
        try:
            document = either_order()
            if not bare or _has_link(document.documentElement):
                return document
        except Exception:
            if not bare:
                raise
        is_old[0] = True
        return either_order()

    try:
        document = either_prefix()
    except Exception as error:
        failure = _failure(error, str(main), list(xacro.filestack or ()))
        if absent:
            omitted = "; ".join(f"{name}: {reason}" for name, reason in absent[:3])
            failure["error"] += f"; it may be in a file that was omitted: {omitted}"
        return failure
    assert document.documentElement is not None
    if absent and not document.getElementsByTagName("link"):
        return {"error": ": ".join(absent[0]), "kind": "FileNotFoundError", "file": str(main), "line": None}
    xml, lines = document.documentElement.toxml(), _lines(document.documentElement)
    return {"xml": xml, "lines": lines, "absent": absent, "bare": bare, "prefixed": is_old[0]}


def _has_link(root: Any) -> bool:
    return any(getattr(child, "tagName", "") == "link" for child in root.childNodes)


def _move_properties_first(root: Any) -> None:
    """Move the properties at the top of a document before all else: xacro of before 2019 read them first."""
    properties = [
        child
        for child in root.childNodes
        if child.nodeType == Node.ELEMENT_NODE and child.tagName == "xacro:property"
    ]
    for child in reversed(properties):
        root.removeChild(child)
        root.insertBefore(child, root.firstChild)


def _with_name(root: Any, arguments: dict[str, str], main: Path) -> dict[str, str]:
    """The arguments, completed for those in the robot's name, which xacro evaluates before their defaults.

    The default that the file declares is taken, and the file's name for an argument that is the whole name.
    """
    name = root.getAttribute("name")
    defaults = {
        element.getAttribute("name"): element.getAttribute("default")
        for element in root.getElementsByTagName("xacro:arg")
        if element.hasAttribute("default") and "$" not in element.getAttribute("default")
    }
    whole = re.fullmatch(r"\s*\$\(arg\s+(\w+)\)\s*", name)
    if whole is not None:
        defaults.setdefault(whole[1], main.name.partition(".")[0])
    named = re.findall(r"\$\(arg\s+(\w+)\)", name)
    return {each: defaults[each] for each in named if each in defaults} | arguments


def _lines(root: Any) -> list[list[Any]]:
    found: list[list[Any]] = []
    todo = [root]
    while todo:
        element = todo.pop()
        found.append(list(element.getUserData(_LINE) or (None, None)))
        todo.extend(child for child in reversed(element.childNodes) if child.nodeType == Node.ELEMENT_NODE)
    return found


def _failure(error: Exception, main: str, stack: list[Any]) -> dict[str, Any]:
    """The message of an error, and the file and line of the nearest element."""
    file, line = next((name for name in reversed(stack) if name), main), None
    if isinstance(error, expat.ExpatError):
        return {
            "error": f"not well-formed XML: {expat.ErrorString(error.code)}",
            "file": file,
            "line": error.lineno,
        }
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        node = frame.f_locals.get("node", frame.f_locals.get("elt"))
        located = node.getUserData(_LINE) if isinstance(node, minidom.Element) else None
        if located:
            file, line = located
            break
    cause: Any = error
    while getattr(cause, "exc", None) is not None:
        cause = cause.exc
    text = " ".join(str(error).split())
    if isinstance(cause, FileNotFoundError):
        text = f"{cause.filename}: {cause.strerror}"
    return {"error": text or type(error).__name__, "kind": type(cause).__name__, "file": file, "line": line}


def _confine() -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    bounds = [(resource.RLIMIT_CPU, MAX_CPU), (resource.RLIMIT_AS, MAX_MEMORY), (resource.RLIMIT_FSIZE, 0)]
    for what, most in bounds:
        try:
            resource.setrlimit(what, (most, most))
        except (OSError, ValueError):
            continue


def main() -> None:
    """Read the request, write the answer."""
    request = json.load(sys.stdin)
    out, sys.stdout = sys.stdout, sys.stderr
    _confine()
    file = Path(request["file"])
    resolver = Resolver.of_file(
        file,
        packages={name: Path(folder) for name, folder in request["packages"].items()},
        search_paths=[Path(folder) for folder in request["search_paths"]],
    )
    try:
        answer = expand(file, resolver, request["arguments"])
    except DescriptionError as error:
        answer = {"error": str(error), "file": str(file), "line": None}
    except MemoryError:
        answer = {
            "error": f"the expansion needs more than {MAX_MEMORY >> 20} MiB",
            "file": str(file),
            "line": None,
        }
    json.dump(answer, out)
    out.flush()


if __name__ == "__main__":
    main()
