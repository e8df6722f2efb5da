"""The nine URDF clean-up helpers of OmniGibson, with its names, arguments and return values.

They work on a parsed `xml.etree.ElementTree.ElementTree` (or its root element) in place and return how many
changes; `sanitize_names` returns its rename map. The usual order is `rewrite_mesh_paths`,
`stage_meshes`, `strip_mimic_joints`, `sanitize_names`, `override_joint_limits`, write, `urdf_audit`.

`roboyard.audit` and `roboyard.repair` check and repair a description as a whole.
"""

from __future__ import annotations

import shutil
import unicodedata
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from roboyard.description.urdf.xml import read_xml
from roboyard.errors import ConfigError

__all__ = [
    "copy_robot_to_models",
    "link_has_dedicated_collision",
    "override_joint_limits",
    "rewrite_mesh_paths",
    "sanitize_names",
    "set_joint_dynamics",
    "stage_meshes",
    "strip_mimic_joints",
    "urdf_audit",
]

Tree = ET.ElementTree | ET.Element


def urdf_audit(path: str | Path) -> dict[str, Any]:
    """Counts of problems that show whether the URDF at `path` is ready for an importer.

    Returns a dict with `n_links`, `n_joints`, `joint_type_counts` (type to count), `mimic_joints`,
    `mesh_refs` (every `<mesh>`, repeats included), `mesh_formats` (lower-case suffix with its dot to count),
    `package_uris` (references that start with `package://`), `nonascii_paths`, `broken_relative_paths` (other
    references to a file that does not exist; relative ones start at the URDF's folder),
    `links_without_inertial` and `root_link` (the one link that is no joint's child; None where there is none
    or more than one).

    Missing meshes are counted, never raised. Raises DescriptionError for a file that is no XML.
    """
    path = Path(path)
    root, _ = read_xml(path)
    links, joints = root.findall("link"), root.findall("joint")
    references = [mesh.get("filename") or "" for mesh in root.iter("mesh")]
    package = [uri for uri in references if uri.startswith("package://")]
    others = [uri for uri in references if not uri.startswith("package://")]
    children = {child.get("link") for joint in joints for child in joint.findall("child")}
    roots = [name for link in links if (name := link.get("name")) not in children]
    return {
        "n_links": len(links),
        "n_joints": len(joints),
        "joint_type_counts": _counts(joint.get("type") or "" for joint in joints),
        "mimic_joints": sum(joint.find("mimic") is not None for joint in joints),
        "mesh_refs": len(references),
        "mesh_formats": _counts(Path(uri).suffix.lower() for uri in references),
        "package_uris": len(package),
        "nonascii_paths": sum(not uri.isascii() for uri in references),
        "broken_relative_paths": sum(not _is_file(path.parent / _without_scheme(uri)) for uri in others),
        "links_without_inertial": sum(link.find("inertial") is None for link in links),
        "root_link": roots[0] if len(roots) == 1 else None,
    }


def rewrite_mesh_paths(tree: Tree, replacements: Iterable[tuple[str, str]]) -> int:
    """Replace substrings of every `<mesh filename>`, in the order given; returns the references changed."""
    pairs = list(replacements)
    changed = 0
    for mesh in _root(tree).iter("mesh"):
        before = after = mesh.get("filename") or ""
        for old, new in pairs:
            after = after.replace(old, new)
        if after != before:
            mesh.set("filename", after)
            changed += 1
    return changed


def stage_meshes(tree: Tree, dest_dir: str | Path, invalid_chars: str = " ()", replacement: str = "_") -> int:
    """Copy every mesh into `dest_dir` under a clean name and point the references there.

    Returns how many files were copied. Each distinct source is copied once. Characters of `invalid_chars` in
    its base name become `replacement`, letters with accents plain ones and other characters beyond ASCII
    `replacement`, so that `urdf_audit` counts no `nonascii_paths` in a plain `dest_dir`; when two sources end
    up with one name, later ones get `_1`, `_2`, ...
    before the suffix. References become absolute paths. A source that does not exist is not counted, though
    its reference is rewritten as well. Relative references start at the working directory, since a tree does
    not know its file: run `rewrite_mesh_paths` first.
    """
    dest = Path(dest_dir).absolute()
    dest.mkdir(parents=True, exist_ok=True)
    staged: dict[Path, Path] = {}
    taken: set[str] = set()
    copied = 0
    for mesh in _root(tree).iter("mesh"):
        uri = mesh.get("filename")
        if not uri:
            continue
        source = Path(_without_scheme(uri))
        key = source.absolute()
        if key not in staged:
            staged[key] = dest / _free(_plain(source.name, invalid_chars, replacement), taken, suffix=True)
            taken.add(staged[key].name)
            if _is_file(source):
                if key != staged[key]:
                    shutil.copyfile(source, staged[key])
                copied += 1
        mesh.set("filename", str(staged[key]))
    return copied


def sanitize_names(tree: Tree, invalid_chars: str = " ()", replacement: str = "_") -> dict[str, str]:
    """Replace `invalid_chars` in link and joint names and in everything that refers to them.

    Returns the names that changed, old to new. References are `<parent>`, `<child>`, `<mimic>`, and the names
    in `<transmission>` and `<gazebo reference>`. A new name that another link (or joint) already has gets
    `_1`, `_2`, ..., so that two elements never become one.
    """
    root = _root(tree)
    links = [name for el in root.findall("link") if (name := el.get("name"))]
    joints = [name for el in root.findall("joint") if (name := el.get("name"))]
    kinds = (set(links), set(joints))
    renames: dict[str, str] = {}
    for old in dict.fromkeys(links + joints):
        wanted = _cleaned(old, invalid_chars, replacement)
        if wanted != old:
            of_old = [names for names in kinds if old in names]
            renames[old] = _free(wanted, set().union(*of_old))
            for names in of_old:
                names.add(renames[old])
    for element, attribute in _name_attributes(root):
        value = element.get(attribute)
        if value in renames:
            element.set(attribute, renames[value])
    return renames


def strip_mimic_joints(tree: Tree) -> int:
    """Delete every joint's `<mimic>`, so that each can be driven on its own; returns how many."""
    removed = 0
    for joint in _root(tree).iter("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
            removed += 1
    return removed


def override_joint_limits(tree: Tree, overrides: Mapping[str, Mapping[str, Any]]) -> int:
    """Set attributes of `<limit>`, as in `{"finger": {"effort": 30, "upper": 0.05}}`; returns joints touched.

    A joint without `<limit>` gets one; attributes that are not named stay; names of no joint are passed over.
    """
    return _set_child_attributes(tree, "limit", overrides)


def set_joint_dynamics(tree: Tree, joints: Sequence[str], **attrs: Any) -> int:
    """Set attributes of `<dynamics>` (as in `friction=0`) on the named joints; returns joints touched."""
    return _set_child_attributes(tree, "dynamics", dict.fromkeys(joints, attrs))


def link_has_dedicated_collision(link_el: ET.Element) -> bool:
    """True where the link has a collision shape of its own: a primitive, or a mesh that is no visual."""
    visuals = {mesh.get("filename") for visual in link_el.findall("visual") for mesh in visual.iter("mesh")}
    for collision in link_el.findall("collision"):
        for geometry in collision.findall("geometry"):
            for shape in geometry:
                if shape.tag != "mesh" or shape.get("filename") not in visuals:
                    return True
    return False


def copy_robot_to_models(
    name: str, data_path: str | Path, dataset_name: str = "omnigibson-robot-assets"
) -> Path:
    """Copy an imported robot to where robots are discovered, and return that folder.

    Copies `<data_path>/<dataset_name>/objects/robot/<name>/` into `.../models/<name>/`: folders merge, files
    are overwritten, nothing is deleted, so a second call changes nothing. Raises ConfigError when there is no
    import.
    """
    for part in (name, dataset_name):
        if part in ("", ".", "..") or "/" in part or "\\" in part:
            raise ConfigError(f"{part!r} is not a plain folder name")
    dataset = Path(data_path) / dataset_name
    source, target = dataset / "objects" / "robot" / name, dataset / "models" / name
    if not source.is_dir():
        raise ConfigError(f"no imported robot at {source}; run the import first")
    shutil.copytree(source, target, dirs_exist_ok=True)
    return target


def _root(tree: Tree) -> ET.Element:
    root = tree.getroot() if isinstance(tree, ET.ElementTree) else tree
    if root is None:
        raise ValueError("the tree has no root element")
    return root


def _counts(values: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(values).items()))


def _without_scheme(uri: str) -> str:
    return uri.removeprefix("file://")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a zero character: no such file
        return False


def _cleaned(name: str, invalid_chars: str, replacement: str) -> str:
    return "".join(replacement if character in invalid_chars else character for character in name)


def _plain(name: str, invalid_chars: str, replacement: str) -> str:
    """`name` cleaned and in ASCII: accents are dropped, other characters become `replacement`."""
    letters = (c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    plain = "".join(letter if letter.isascii() else replacement for letter in letters)
    return _cleaned(plain, invalid_chars, replacement)


def _free(name: str, taken: set[str], *, suffix: bool = False) -> str:
    """`name`, or the first of `name_1`, `name_2`, ... (before a file name's suffix) that is not taken."""
    stem, dot = (Path(name).stem, Path(name).suffix) if suffix else (name, "")
    candidate, number = name, 0
    while candidate in taken:
        number += 1
        candidate = f"{stem}_{number}{dot}"
    return candidate


def _name_attributes(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """Every (element, attribute) that holds a link's or a joint's name."""
    for link in root.findall("link"):
        yield link, "name"
    for joint in root.findall("joint"):
        yield joint, "name"
        for tag, attribute in (("parent", "link"), ("child", "link"), ("mimic", "joint")):
            for element in joint.findall(tag):
                yield element, attribute
    for transmission in root.findall("transmission"):
        for joint in transmission.findall("joint"):
            yield joint, "name"
    for gazebo in root.findall("gazebo"):
        yield gazebo, "reference"


def _set_child_attributes(tree: Tree, tag: str, values: Mapping[str, Mapping[str, Any]]) -> int:
    touched = 0
    for joint in _root(tree).findall("joint"):
        attributes = values.get(joint.get("name") or "")
        if attributes is None:
            continue
        child = joint.find(tag)
        if child is None:
            child = ET.SubElement(joint, tag)
        for attribute, value in attributes.items():
            child.set(attribute, str(value))
        touched += 1
    return touched
