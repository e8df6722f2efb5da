"""Hooks of the documentation site: pages of the reference, and the repository's own pages among them."""

from __future__ import annotations

import ast
import importlib
import inspect
import itertools
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
PACKAGES = (
    "roboyard",
    "roboyard.description",
    "roboyard.audit",
    "roboyard.repair",
    "roboyard.shapes",
    "roboyard.kinematics",
    "roboyard.sim",
    "roboyard.rendering",
    "roboyard.sensors",
    "roboyard.robots",
    "roboyard.robots.control",
    "roboyard.scenes",
    "roboyard.planning",
    "roboyard.skills",
    "roboyard.recording",
    "roboyard.teleop",
    "roboyard.validation",
    "roboyard.viewer",
    "roboyard.demo",
    "roboyard.omnigibson",
    "roboyard.pybullet",
)
"""Packages whose `__all__` is the public interface, in the order of the reference."""
REPOSITORY_PAGES = {
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
    "security.md": "SECURITY.md",
}
"""Page of the site to the file of the repository that it shows."""
REPOSITORY = "https://github.com/roboyard/roboyard/blob/main/"
"""Where links to other files of the repository lead."""
LINK = re.compile(r"(\]\()([^)\s:]+?)(#[^)\s]*)?(\))")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the pages of the reference in the navigation."""
    for section in config.nav or []:
        if "Reference" in section:
            section["Reference"] += [{package: _page_of(package)} for package in PACKAGES]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not in the documentation's folder."""
    for page, source in REPOSITORY_PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    files.append(File.generated(config, "reference/index.md", content=_contents()))
    for package in PACKAGES:
        files.append(File.generated(config, _page_of(package), content=_page(package)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links between the documentation's folder and the rest of the repository to the right page."""
    origin = REPOSITORY_PAGES.get(page.file.src_uri, posixpath.join("docs", page.file.src_uri))
    shown = {source: target for target, source in REPOSITORY_PAGES.items()}

    def target(match: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join(posixpath.dirname(origin), match[2]))
        if not (ROOT / path).exists():
            return match[0]
        if path in shown:
            found = posixpath.relpath(shown[path], posixpath.dirname(page.file.src_uri) or ".")
        elif path.startswith("docs/"):
            inside = path.removeprefix("docs/")
            found = posixpath.relpath(inside, posixpath.dirname(page.file.src_uri) or ".")
        else:
            found = REPOSITORY + path
        return f"{match[1]}{found}{match[3] or ''}{match[4]}"

    return LINK.sub(target, markdown)


def public_names(package: str) -> Iterator[tuple[str, str | None, Any]]:
    """Yield each public name of a package, the full name of a class or function where it is defined (None for
    a constant), and its value.
    """
    module = importlib.import_module(package)
    for name in module.__all__:
        if not name.startswith("__"):
            value = getattr(module, name)
            yield name, _home(value), value


def _home(value: Any) -> str | None:
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return None
    name = value.__name__
    return f"{value.__module__}.{name}" if getattr(inspect.getmodule(value), name, None) is value else None


def _constant(package: str, name: str, value: Any) -> str:
    """Return the section of a constant, with the text below its assignment."""
    text = repr(value)
    lines = [
        f"## {name}",
        "",
        f"`{text}`" if len(text) <= 80 and "`" not in text else f"`{type(value).__name__}`",
    ]
    return "\n".join([*lines, "", _text_below(package, name), ""])


def _text_below(package: str, name: str) -> str:
    """Return the string that follows an assignment of a name, in the module that the package has it from."""
    tree = ast.parse(inspect.getsource(importlib.import_module(package)))
    home = package
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and name in {alias.name for alias in node.names}:
            home = node.module
    body = ast.parse(inspect.getsource(importlib.import_module(home))).body
    for node, following in itertools.pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names = {
            part.id for target in targets if target for part in ast.walk(target) if isinstance(part, ast.Name)
        }
        if name in names and isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
            return inspect.cleandoc(str(following.value.value))
    return ""


def _page_of(package: str) -> str:
    return f"reference/{package}.md"


def _contents() -> str:
    lines = [
        "# Reference",
        "",
        "Every public name, from its docstring. Quaternions are (x, y, z, w); lengths are in",
    ]
    lines += ["metres, angles in radians, times in seconds, masses in kilograms.", ""]
    lines += ["| Package | What it is for |", "|---|---|"]
    for package in PACKAGES:
        title = (inspect.getdoc(importlib.import_module(package)) or "").splitlines()[0]
        lines.append(f"| [`{package}`]({package}.md) | {title} |")
    return "\n".join(lines) + "\n"


def _page(package: str) -> str:
    module = importlib.import_module(package)
    title, _, rest = (inspect.getdoc(module) or "").partition("\n")
    parts = [f"# {package}", "", title, ""]
    if rest.strip():
        parts += ["```text", rest.strip(), "```", ""]
    elsewhere = {home for other in PACKAGES if other != package for _, home, _ in public_names(other)}
    for name, home, value in sorted(public_names(package), key=lambda found: found[0].lower()):
        if home is None:
            parts.append(_constant(package, name, value))
        elif package == "roboyard" and home in elsewhere:
            parts.append(f"- [`{name}`][{home}]")
        else:
            parts.append(f"::: {home}\n")
    return "\n".join(parts)
