"""For every code a robot that has the fault and one that nearly has it.

A case is the URDF's text, or a function that writes files into the robot's folder and returns the text.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

Case = str | bytes | Callable[[Path], str]

# ------------------------------------------------------------------------------------------ building blocks


def inertial(mass="1", tensor=(0.01, 0, 0, 0.01, 0, 0.01), origin="") -> str:
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    values = " ".join(f'{key}="{value}"' for key, value in zip(keys, tensor, strict=True))
    return f'<inertial>{origin}<mass value="{mass}"/><inertia {values}/></inertial>'


BOX = '<box size="0.1 0.1 0.1"/>'
INERTIAL = inertial()


def visual(geometry=BOX, more="", origin="") -> str:
    return f"<visual>{origin}<geometry>{geometry}</geometry>{more}</visual>"


def collision(geometry=BOX, origin="") -> str:
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


def both(geometry=BOX, origin="") -> str:
    return visual(geometry, origin=origin) + collision(geometry, origin=origin)


def link(name, body=None) -> str:
    return f'<link name="{name}">{INERTIAL + both() if body is None else body}</link>'


LIMIT = '<limit lower="-1" upper="1" effort="10" velocity="2"/>'
AXIS = '<axis xyz="0 0 1"/>'
ORIGIN = '<origin xyz="0 0 0.2"/>'


def joint(
    name="j",
    parent="base",
    child="tip",
    kind="revolute",
    axis=AXIS,
    limit=LIMIT,
    origin=ORIGIN,
    more="",
    ends=None,
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>' if ends is None else ends
    if kind == "fixed":
        axis = limit = ""
    return f'<joint name="{name}" type="{kind}">{origin}{ends}{axis}{limit}{more}</joint>'


def robot(*parts, name=' name="arm"') -> str:
    return f"<robot{name}>\n" + "\n".join(parts) + "\n</robot>\n"


def arm(tip=None, base=None, more="", **joint_options) -> str:
    """A base and a tip on one joint; without faults by default."""
    return robot(link("base", base), link("tip", tip), joint(**joint_options), more)


def arm_with_joint(**joint_options) -> str:
    return robot(link("base"), link("tip"), joint(**joint_options))


def chain(*joints, links=("base", "tip", "hand"), more="") -> str:
    return robot(*[link(name) for name in links], *joints, more)


def two_joints(first="", second="", limit=LIMIT, second_limit=LIMIT, second_kind="revolute") -> str:
    return chain(
        joint("j", "base", "tip", limit=limit, more=first),
        joint("k", "tip", "hand", kind=second_kind, limit=second_limit, more=second),
    )


# --------------------------------------------------------------------------------------------------- meshes

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float) - 0.5
_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
_FACES = np.array([t for a, b, c, d in _QUADS for t in ((a, b, c), (a, c, d))])
CUBE = _CORNERS[_FACES]
"""(12, 3, 3) triangles of a unit cube."""


def stl(triangles: np.ndarray, count: int | None = None) -> bytes:
    records = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    records["v"] = triangles
    return b" " * 80 + struct.pack("<I", len(triangles) if count is None else count) + records.tobytes()


def grid(cells: int) -> np.ndarray:
    """(2 cells², 3, 3) triangles of a flat square of 0.1 m."""
    axis = np.linspace(-0.05, 0.05, cells + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 3)


def two_cubes(gap: float) -> np.ndarray:
    """Two cubes of 2 cm, `gap` apart along the diagonal: closed, with a large hull."""
    return np.concatenate([0.02 * CUBE, 0.02 * CUBE + gap])


def part(
    triangles: np.ndarray = 0.1 * CUBE, name="part.stl", scale="", uri=None, shape=both, data=None
) -> Case:
    """An arm whose tip is a mesh."""

    def write(folder: Path) -> str:
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(stl(triangles) if data is None else data)
        return arm(tip=INERTIAL + shape(mesh(uri or name, scale)))

    return write


def mesh(uri, scale="") -> str:
    return f'<mesh filename="{uri}"' + (f' scale="{scale}"' if scale else "") + "/>"


def separate(visual_size: float, collision_size: float, scale="") -> Case:
    """An arm whose tip has a visual and a collision mesh of different size."""

    def write(folder: Path) -> str:
        (folder / "v.stl").write_bytes(stl(visual_size * CUBE))
        (folder / "c.stl").write_bytes(stl(collision_size * CUBE))
        return arm(tip=INERTIAL + visual(mesh("v.stl")) + collision(mesh("c.stl", scale)))

    return write


def obj(mtllib: str, with_library: bool) -> Case:
    def write(folder: Path) -> str:
        vertices = "".join("v {} {} {}\n".format(*(0.1 * corner)) for corner in _CORNERS)
        faces = "".join("f {} {} {}\n".format(*(face + 1)) for face in _FACES)
        (folder / "part.obj").write_text(f"mtllib {mtllib}\nusemtl red\n{vertices}{faces}")
        if with_library:
            (folder / mtllib).write_text("newmtl red\nKd 1 0 0\n")
        return arm(tip=INERTIAL + both(mesh("part.obj")))

    return write


def dae(corners: np.ndarray, up: str) -> str:
    """A DAE file of a box with (8, 3) corners."""
    numbers = " ".join(f"{value:g}" for value in corners.ravel())
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f'<asset><unit meter="1"/><up_axis>{up}</up_axis></asset>'
        '<library_geometries><geometry id="g"><mesh><source id="p">'
        f'<float_array id="a" count="24">{numbers}</float_array><technique_common>'
        '<accessor source="#a" count="8" stride="3"><param name="X" type="float"/>'
        '<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
        '<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"<p>{' '.join(map(str, _FACES.ravel()))}</p></triangles></mesh></geometry></library_geometries>"
        '<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>'
        '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


def rods(up: str, count: int = 4) -> Case:
    """A chain of rods along z, 0.4 m long, whose meshes are drawn along y."""

    def write(folder: Path) -> str:
        (folder / "rod.dae").write_text(dae((_CORNERS + np.array([0, 0.5, 0])) * (0.05, 0.4, 0.05), up))
        body = inertial(origin='<origin xyz="0 0 0.2"/>') + both(mesh("rod.dae"))
        names = [f"rod{k}" for k in range(count)]
        joints = [
            joint(f"j{k}", names[k], names[k + 1], origin='<origin xyz="0 0 0.4"/>') for k in range(count - 1)
        ]
        return robot(*[link(name, body) for name in names], *joints)

    return write


def outside(inside: bool) -> Case:
    def write(folder: Path) -> str:
        where = folder / "meshes" if inside else folder.parent
        where.mkdir(exist_ok=True)
        (where / "far.stl").write_bytes(stl(0.1 * CUBE))
        uri = "package://arm/meshes/far.stl" if inside else "../far.stl"
        return arm(tip=INERTIAL + both(mesh(uri)))

    return write


def material(color: str, name="m", more="") -> str:
    return f'<material name="{name}">{color}{more}</material>'


def coloured(rgba: str) -> str:
    return arm(tip=INERTIAL + visual(more=material(f'<color rgba="{rgba}"/>')) + collision())


def textured(uri: str) -> Case:
    def write(folder: Path) -> str:
        (folder / "here.png").write_bytes(b"\x89PNG\r\n\x1a\n")
        return arm(tip=INERTIAL + visual(more=material(f'<texture filename="{uri}"/>')) + collision())

    return write


def mimic(of="j", multiplier="", offset="") -> str:
    more = (f' multiplier="{multiplier}"' if multiplier else "") + (f' offset="{offset}"' if offset else "")
    return f'<mimic joint="{of}"{more}/>'


def three_boxes(sizes, inertials) -> str:
    shapes = [both(f'<box size="{size} {size} {size}"/>') for size in sizes]
    bodies = [own + shape for own, shape in zip(inertials, shapes, strict=True)]
    names = ("base", "tip", "hand")
    return robot(
        *[link(name, body) for name, body in zip(names, bodies, strict=True)],
        joint("j", "base", "tip", origin='<origin xyz="0 0 0.5"/>'),
        joint("k", "tip", "hand", origin='<origin xyz="0 0 0.5"/>'),
    )


def light_tip(mass: str, moment: float) -> str:
    own = inertial(mass, [moment, 0, 0, moment, 0, moment])
    return robot(
        link("base"),
        link("tip", own + both()),
        link("hand"),
        joint("j"),
        joint("k", "tip", "hand"),
    )


def far_hand(distance: str) -> str:
    return chain(joint("j"), joint("k", "tip", "hand", origin=f'<origin xyz="0 0 {distance}"/>'))


def many_links(count: int) -> str:
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + 1}"/></joint>'
        for i in range(count - 1)
    )
    return f'<robot name="arm">{links}{joints}</robot>'


XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
EMPTY_FIXED = joint("f", "tip", "frame", "fixed")

CASES: dict[str, tuple[Case, Case]] = {
    # -------------------------------------------------------------------------------------- the file, XML
    "xml-unsafe": ('<!DOCTYPE robot [<!ENTITY x "y">]>' + arm(), "<!-- DOCTYPE robot [ENTITY] -->" + arm()),
    "xml-syntax": (arm().replace("</link>", "</lnik>", 1), arm()),
    "xml-tolerated": ('\n\n<?xml version="1.0"?>' + arm(), '<?xml version="1.0"?>\n\n' + arm()),
    "format-refused": ('<sdf version="1.7"/>', arm()),
    "root-not-robot": (arm().replace("robot", "model"), arm()),
    "too-many-links": (many_links(10_001), many_links(60)),
    "number-not-finite": (
        arm(origin='<origin xyz="0 nan 0.2"/>'),
        arm(origin='<origin xyz="0 1e-300 0.2"/>'),
    ),
    "xacro-left": (arm(origin='<origin xyz="0 0 ${h}"/>'), arm(more="<!-- ${h} -->")),
    "xacro-color": (
        arm().replace("</visual>", "<xacro:grey/></visual>", 1).replace("<robot", f"<robot {XACRO}", 1),
        arm(),
    ),
    "number-wrong": (arm(origin='<origin xyz="0 0.2"/>'), arm(origin='<origin xyz="0 0 0.2"/>')),
    "number-huge": (
        arm(tip=INERTIAL + both(origin='<origin xyz="0 0 1e30"/>')),
        arm(limit='<limit lower="-1e16" upper="1e16" effort="1e30" velocity="1e30"/>'),
    ),
    "number-sloppy": (arm(origin='<origin xyz="0, 0, 0.2"/>'), arm(origin='<origin xyz=" +0  0.0 2.E-1 "/>')),
    "robot-name-missing": (
        robot(link("base"), link("tip"), joint(), name=""),
        robot(link("base"), link("tip"), joint(), name=' name="r"'),
    ),
    "element-repeated": (arm(origin=ORIGIN + ORIGIN), arm(tip=INERTIAL + both() + collision())),
    "element-unread": (arm(more="<transmission/>"), arm(more='<material name="m"/>')),
    "attribute-unread": (
        arm(limit=LIMIT.replace("lower", "lowr")),
        arm(tip='<contact><lateral_friction value="1"/></contact>' + INERTIAL + both()),
    ),
    # ------------------------------------------------------------------------------------------- the tree
    "no-links": (robot(), robot(link("base"))),
    "link-name-missing": (arm().replace('<link name="tip">', "<link>"), arm()),
    "joint-name-missing": (arm().replace('<joint name="j" ', "<joint "), arm()),
    "link-name-duplicate": (arm(more=link("tip")), arm(more=link("Tip") + joint("k", "tip", "Tip"))),
    "joint-name-duplicate": (
        chain(joint("j"), joint("j", "tip", "hand")),
        chain(joint("j"), joint("J", "tip", "hand")),
    ),
    "joint-type-unknown": (arm(kind="hinge"), arm(kind="revolute")),
    "joint-type-spelling": (arm(kind="Revolute"), arm(kind="revolute")),
    "joint-end-missing": (arm(ends='<parent link="base"/>'), arm()),
    "joint-link-unknown": (arm(child="ghost"), arm()),
    "link-two-parents": (
        chain(joint("j"), joint("k", "base", "hand"), joint("l", "tip", "hand")),
        chain(joint("j"), joint("k", "base", "hand")),
    ),
    "links-loop": (
        robot(link("base"), link("a"), link("b"), joint("j", "a", "b"), joint("k", "b", "a")),
        chain(joint("j"), joint("k", "tip", "hand")),
    ),
    "several-roots": (arm(more=link("orphan")), arm(more=link("o") + joint("k", "base", "o", "fixed"))),
    "joint-floating": (
        arm(kind="floating", axis="", limit=""),
        robot(link("world", ""), link("tip"), joint(parent="world", kind="floating", axis="", limit="")),
    ),
    "joint-type-rare": (arm(kind="spherical", axis="", limit=""), arm(kind="continuous", limit="")),
    # ------------------------------------------------------------------------------------------- the joints
    "axis-zero": (arm(axis='<axis xyz="0 0 0"/>'), arm(axis='<axis xyz="0 0 1e-6"/>')),
    "axis-not-unit": (arm(axis='<axis xyz="0 0 2"/>'), arm(axis='<axis xyz="0 0.6 0.7999"/>')),
    "axis-missing": (arm(axis=""), arm(kind="fixed")),
    "dynamics-negative": (
        arm_with_joint(more='<dynamics damping="-0.1"/>'),
        arm_with_joint(more='<dynamics damping="0"/>'),
    ),
    "limit-missing": (arm(limit=""), arm(kind="continuous", limit="")),
    "limit-bounds-missing": (
        arm(limit='<limit effort="10" velocity="1"/>'),
        arm(kind="continuous", limit='<limit effort="10" velocity="1"/>'),
    ),
    "limit-reversed": (
        arm(limit='<limit lower="1" upper="-1" effort="1" velocity="1"/>'),
        arm(limit='<limit lower="-1" upper="-0.9" effort="1" velocity="1"/>'),
    ),
    "limit-no-range": (
        arm(limit='<limit lower="0" upper="0" effort="1" velocity="1"/>'),
        arm(limit='<limit lower="0" upper="0.001" effort="1" velocity="1"/>'),
    ),
    "limit-effort-zero": (
        arm(limit='<limit lower="-1" upper="1" effort="0" velocity="1"/>'),
        arm(limit='<limit lower="-1" upper="1" effort="1e-3" velocity="1"/>'),
    ),
    "limit-velocity-zero": (
        arm(limit='<limit lower="-1" upper="1" effort="1" velocity="0"/>'),
        two_joints(second=mimic("j"), second_limit='<limit lower="-1" upper="1" effort="1" velocity="0"/>'),
    ),
    "limit-negative": (arm(limit=LIMIT.replace("10", "-10")), arm(limit=LIMIT)),
    "limit-incomplete": (arm(limit='<limit lower="-1" upper="1" effort="1"/>'), arm()),
    "continuous-with-limits": (
        arm(kind="continuous"),
        arm(kind="continuous", limit='<limit effort="10" velocity="1"/>'),
    ),
    "limit-endless": (
        arm(limit='<limit lower="-1e16" upper="1e16" effort="1" velocity="1"/>'),
        arm(limit='<limit lower="-900" upper="900" effort="1" velocity="1"/>'),
    ),
    "limit-excludes-zero": (
        arm(limit='<limit lower="-3" upper="-0.1" effort="1" velocity="1"/>'),
        arm(limit='<limit lower="-3" upper="0" effort="1" velocity="1"/>'),
    ),
    # ------------------------------------------------------------------------------------------- followers
    "mimic-without-joint": (two_joints(second='<mimic multiplier="1"/>'), two_joints(second=mimic("j"))),
    "mimic-unknown": (two_joints(second=mimic("ghost")), two_joints(second=mimic("j"))),
    "mimic-itself": (two_joints(second=mimic("k")), two_joints(second=mimic("j"))),
    "mimic-fixed": (
        two_joints(first=mimic("k"), second_kind="fixed"),
        two_joints(first=mimic("k"), second_kind="continuous", second_limit=""),
    ),
    "mimic-cycle": (two_joints(first=mimic("k"), second=mimic("j")), two_joints(second=mimic("j"))),
    "mimic-chain": (
        chain(
            joint("j"),
            joint("k", "tip", "hand", more=mimic("j", "-0.5")),
            joint("l", "hand", "nail", more=mimic("k", "2", "0.1"), limit=LIMIT.replace("1", "2")),
            links=("base", "tip", "hand", "nail"),
        ),
        chain(
            joint("j"),
            joint("k", "tip", "hand", more=mimic("j")),
            joint("l", "hand", "nail", more=mimic("j")),
            links=("base", "tip", "hand", "nail"),
        ),
    ),
    "mimic-multiplier": (two_joints(second=mimic("j", "0")), two_joints(second=mimic("j", "0.02"))),
    "mimic-range": (two_joints(second=mimic("j", "1.5")), two_joints(second=mimic("j", "-1"))),
    # ------------------------------------------------------------------------------------------- inertials
    "inertial-missing": (
        arm(tip=both()),
        robot(link("base"), link("tip"), link("cap", both()), joint(), joint("f", "tip", "cap", "fixed")),
    ),
    "inertial-missing-frame": (
        arm(tip=""),
        robot(link("base"), link("tip"), link("frame", ""), joint(), EMPTY_FIXED),
    ),
    "mass-missing": (arm(tip=INERTIAL.replace('<mass value="1"/>', "") + both()), arm()),
    "mass-negative": (arm(tip=inertial("-1") + both()), arm(tip=inertial("0.9") + both())),
    "mass-zero": (
        arm(tip=inertial("0", [0] * 6) + both()),
        robot(
            link("base"),
            link("tip"),
            link("frame", inertial("0", [0] * 6) + both()),
            joint(),
            EMPTY_FIXED.replace("0.2", "0.4"),
        ),
    ),
    "inertia-missing": (arm(tip='<inertial><mass value="1"/></inertial>' + both()), arm()),
    "inertia-zero": (
        arm(tip=inertial("1", [0] * 6) + both()),
        arm(tip=inertial("1", [0.002, 0, 0, 0.002, 0, 0.002]) + both()),
    ),
    "inertia-not-positive": (
        arm(tip=inertial("1", (0.01, 0.05, 0, 0.01, 0, 0.01)) + both()),
        arm(tip=inertial("1", (0.01, 0.004, 0, 0.01, 0, 0.01)) + both()),
    ),
    "inertia-triangle": (
        arm(tip=inertial("1", (0.004, 0, 0, 0.004, 0, 0.0085)) + both()),
        arm(tip=inertial("1", (0.004, 0, 0, 0.004, 0, 0.008)) + both()),
    ),
    "inertia-out-of-scale": (
        arm(tip=inertial("1", (1.7, 0, 0, 1.7, 0, 1.7)) + both()),
        arm(tip=inertial("1", (0.1, 0, 0, 0.1, 0, 0.1)) + both()),
    ),
    "center-of-mass-far": (
        arm(tip=inertial(origin='<origin xyz="0 0 0.2"/>') + both()),
        arm(tip=inertial(origin='<origin xyz="0 0 0.13"/>') + both()),
    ),
    "mass-density": (
        arm(tip=inertial("26", (0.26, 0, 0, 0.26, 0, 0.26)) + both()),
        arm(tip=inertial("24", (0.24, 0, 0, 0.24, 0, 0.24)) + both()),
    ),
    "mass-neighbours": (
        light_tip("0.001", 1e-6),
        light_tip("0.01", 1e-5),
    ),
    "mass-total": (
        arm(
            tip=inertial("30000", (20000, 0, 0, 20000, 0, 20000)) + both('<box size="2 2 2"/>'),
            origin='<origin xyz="0 0 2"/>',
        ),
        arm(
            tip=inertial("10000", (7000, 0, 0, 7000, 0, 7000)) + both('<box size="2 2 2"/>'),
            origin='<origin xyz="0 0 2"/>',
        ),
    ),
    "inertial-copied": (
        three_boxes((0.1, 0.15, 0.2), [INERTIAL] * 3),
        three_boxes((0.1, 0.1, 0.1), [INERTIAL] * 3),
    ),
    # ------------------------------------------------------------------------------------------- primitives
    "geometry-missing": (arm(tip=INERTIAL + both() + "<visual/>"), arm()),
    "geometry-unknown": (
        arm(tip=INERTIAL + both('<cone radius="1"/>')),
        arm(tip=INERTIAL + both('<capsule radius="0.05" length="0.1"/>')),
    ),
    "geometry-size-missing": (
        arm(tip=INERTIAL + both("<sphere/>")),
        arm(tip=INERTIAL + both('<sphere radius="0.05"/>')),
    ),
    "geometry-size-negative": (
        arm(tip=INERTIAL + both('<sphere radius="-0.1"/>')),
        arm(tip=INERTIAL + both('<sphere radius="0.1"/>')),
    ),
    "geometry-size-zero": (
        arm(tip=INERTIAL + both('<box size="0.1 0 0.1"/>')),
        arm(tip=INERTIAL + both('<capsule radius="0.1" length="0"/>')),
    ),
    "geometry-size-implausible": (
        arm(base=INERTIAL + both('<box size="50 50 0.1"/>')),
        arm(base=INERTIAL + both('<box size="10 10 0.1"/>')),
    ),
    # ------------------------------------------------------------------------------------------- mesh files
    "mesh-name-missing": (arm(tip=INERTIAL + both("<mesh/>")), part()),
    "mesh-missing": (arm(tip=INERTIAL + both(mesh("gone.stl"))), part()),
    "mesh-outside": (outside(False), outside(True)),
    "mesh-found-nearby": (part(name="Part.STL", uri="part.stl"), part(name="Part.STL")),
    "mesh-format": (part(name="part.step"), part(name="part.STL")),
    "mesh-lfs": (part(data=b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"), part()),
    "mesh-empty": (part(data=b""), part()),
    "mesh-not-finite": (part(np.where(CUBE > 0, np.nan, CUBE)), part()),
    "mesh-unreadable": (part(data=stl(CUBE, count=13)), part()),
    "mesh-scale-zero": (part(scale="1 0 1"), part(scale="1 0.001 1")),
    "mesh-scale-single": (part(100 * CUBE, scale="0.001"), part(100 * CUBE, scale="0.001 0.001 0.001")),
    "mesh-scale-negative": (part(scale="1 -1 1"), part(scale="1 1.1 1")),
    "mesh-huge": (part(scale="1e9 1e9 1e9"), part(scale="1e3 1e3 1e3")),
    "mesh-units": (part(90 * CUBE), part(90 * CUBE, scale="0.001 0.001 0.001")),
    "mesh-tiny": (part(scale="0.001 0.001 0.001"), part(scale="0.02 0.02 0.02")),
    "mesh-units-differ": (separate(0.1, 100.0), separate(0.1, 0.12)),
    "mesh-up-axis": (rods("Y_UP"), rods("Y_UP", count=3)),
    "mesh-flat": (part(grid(2)), part(0.1 * CUBE * (1, 1, 0.01))),
    "mesh-open": (part((0.1 * CUBE)[1:]), part()),
    "mesh-external-missing": (obj("gone.mtl", with_library=False), obj("here.mtl", with_library=True)),
    "mesh-heavy": (part(grid(224), shape=visual), part(grid(223), shape=visual)),
    "mesh-reference": (
        part(name="meshes/part.stl", uri="package://arm/meshes/part.stl"),
        part(name="meshes/part.stl"),
    ),
    "mesh-file-name": (part(name="left part (1).stl"), part(name="left-part_1.0.stl")),
    # ------------------------------------------------------------------------------------------- collisions
    "collision-none": (arm(tip=INERTIAL + visual(), base=INERTIAL + visual()), arm(tip=INERTIAL + visual())),
    "collision-missing": (arm(tip=INERTIAL + visual()), arm(tip=INERTIAL)),
    "collision-is-visual": (part(grid(23)), part(grid(22))),
    "collision-hull-balloons": (part(two_cubes(0.08)), part(two_cubes(0.021))),
    "collision-overlap": (far_hand("-0.17"), far_hand("-0.105")),
    # ------------------------------------------------------------------------------------------- names
    "link-name-odd": (
        robot(link("base"), link("left (arm)"), joint(child="left (arm)")),
        robot(link("base"), link("_left_arm2"), joint(child="_left_arm2")),
    ),
    "joint-name-odd": (arm(name="joint-1"), arm(name="joint_1")),
    "link-name-reserved": (
        robot(link("world", ""), link("tip"), joint(parent="world")),
        robot(link("World", ""), link("tip"), joint(parent="World")),
    ),
    "name-too-long": (arm(name="j" * 201), arm(name="j" * 200)),
    # ------------------------------------------------------------------------------------------- looks
    "color-range": (coloured("255 128 0 1"), coloured("1 0.5 0 1")),
    "color-alpha-missing": (coloured("0.2 0.2 0.2"), coloured("0.2 0.2 0.2 0.5")),
    "color-invisible": (coloured("1 0 0 0"), coloured("1 0 0 0.1")),
    "material-undefined": (
        arm(tip=INERTIAL + visual(more='<material name="gray"/>') + collision()),
        arm(
            tip=INERTIAL + visual(more='<material name="gray"/>') + collision(),
            more=material('<color rgba="1 1 1 1"/>', "gray"),
        ),
    ),
    "material-redefined": (
        arm(
            tip=INERTIAL + visual(more=material('<color rgba="1 0 0 1"/>')) + collision(),
            more=material('<color rgba="1 1 1 1"/>'),
        ),
        arm(
            tip=INERTIAL + visual(more=material('<color rgba="1 1 1 1"/>')) + collision(),
            more=material('<color rgba="1 1 1 1"/>'),
        ),
    ),
    "texture-missing": (textured("gone.png"), textured("here.png")),
    # ------------------------------------------------------------------------------------------- units
    "origin-degrees": (
        arm(origin='<origin xyz="0 0 0.2" rpy="90 0 0"/>'),
        arm(origin='<origin xyz="0 0 0.2" rpy="6.28 0 -3.2"/>'),
    ),
    "limit-degrees": (
        arm(limit='<limit lower="-180" upper="180" effort="1" velocity="1"/>'),
        arm(limit='<limit lower="-12.5" upper="12.5" effort="1" velocity="1"/>'),
    ),
    "origin-far": (far_hand("250"), far_hand("2.5")),
}


def write_case(case: Case, folder: Path) -> Path:
    """The case's files, in `folder/arm/`; returns the URDF."""
    home = folder / "arm"
    home.mkdir()
    text = case(home) if callable(case) else case
    file = home / "arm.urdf"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file
