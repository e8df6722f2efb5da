"""Report pages parsed as HTML, and pictures of robots against the projection of their known shapes."""

from __future__ import annotations

import base64
import io
import math
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.audit.findings import Audit, Facts, Finding, Severity
from roboyard.audit.report import report_lines
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.reports.audit_page import MAX_PICTURES, MAX_ROWS, audit_page
from roboyard.reports.html import badge, figure, page, plural, table
from roboyard.reports.pictures import view_of

HOSTILE = "</td><script>alert('x')</script>\"'&amp;<img src=http://evil/x.png onerror=alert(1)>"
VOID = {"meta", "img", "br", "hr", "link", "input", "!doctype"}


class Reader(HTMLParser):
    """Elements, attributes and text of a page; checks that tags are nested properly."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.rows: list[list[str]] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data) -> None:
        self.text += data
        if {"td", "th"} & set(self._open):
            self.rows[-1][-1] += data

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.tags)


def is_self_contained(reader: Reader) -> bool:
    """Whether no attribute loads or runs anything from elsewhere."""
    outside = [
        (tag, key)
        for tag, attributes in reader.tags
        for key, value in attributes.items()
        if key.startswith("on") or (key in ("src", "href") and not (value or "").startswith("data:image/png"))
    ]
    return not outside and not {"script", "link", "iframe", "object"} & {tag for tag, _ in reader.tags}


BOX = '<geometry><box size="{0} {0} {0}"/></geometry>'


def draft(folder: Path, links: str, joints: str = "", name: str = "r") -> UrdfElements:
    file = folder / "r.urdf"
    file.write_text(f'<robot name="{name}">{links}{joints}</robot>')
    return parse_urdf(file)


def fixed(child: str, xyz: str, rpy: str = "0 0 0") -> str:
    return (
        f'<joint name="j_{child}" type="fixed"><parent link="base"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/></joint>'
    )


def two_boxes(folder: Path) -> UrdfElements:
    """A green box of 1 m at the origin, and a small one 3 m along x."""
    green = '<material name="green"><color rgba="0 1 0 1"/></material>'
    links = f'<link name="base"><visual>{BOX.format(1)}{green}</visual></link>'
    links += f'<link name="tip"><collision>{BOX.format(0.2)}</collision></link>'
    return draft(folder, links, fixed("tip", "3 0 0"))


def audit_of(*findings: Finding, robot: str = "r", links: int = 2) -> Audit:
    return Audit(file=Path("r.urdf"), robot=robot, findings=findings, facts=Facts(links=links))


def finding(code: str, severity: Severity, text: str, **fields) -> Finding:
    return Finding(
        code=code, severity=severity, element=f'link "{text}"', message=text, remedy=f"fix {text}", **fields
    )


# --------------------------------------------------------------------------------------------------- pages


def test_hostile_text_stays_text_in_every_block() -> None:
    parts = [
        badge(HOSTILE, "bad"),
        figure(b"x", HOSTILE, 10),
        table([HOSTILE, "b"], [[HOSTILE, "1"], ["2", "3"]]),
    ]
    reader = Reader(page(HOSTILE, parts))
    assert is_self_contained(reader)
    assert reader.rows == [[HOSTILE, "b"], [HOSTILE, "1"], ["2", "3"]]
    assert reader.text.count(HOSTILE) == 5  # title, badge, caption and two cells
    (image,) = [attributes for tag, attributes in reader.tags if tag == "img"]
    assert image["alt"] == HOSTILE
    assert image["width"] == "10"


def test_a_figure_holds_the_picture_whole() -> None:
    data = bytes(range(256)) * 3
    reader = Reader(figure(data, "a", shown=False))
    ((_, attributes),) = [one for one in reader.tags if one[0] == "img"]
    assert base64.b64decode((attributes["src"] or "").removeprefix("data:image/png;base64,")) == data
    assert reader.count("figcaption") == 0
    assert "width" not in attributes


@pytest.mark.parametrize(("count", "text"), [(0, "0 links"), (1, "1 link"), (2, "2 links")])
def test_counts_have_the_right_number(count: int, text: str) -> None:
    assert plural(count, "link") == text


def test_every_finding_is_on_the_page_under_its_severity_and_code(tmp_path: Path) -> None:
    found = [
        finding("axis-zero", Severity.ERROR, "first", line=7),
        finding("mass-zero", Severity.WARNING, "second", fixable=True),
        finding("axis-zero", Severity.ERROR, "third"),
        finding("name-odd", Severity.INFO, "fourth"),
    ]
    text = audit_page(audit_of(*found), two_boxes(tmp_path))
    reader = Reader(text)
    rows = [row for row in reader.rows if row[0] != "line"]
    assert rows == [
        ["7", 'link "first"', "first", "fix first"],
        ["", 'link "third"', "third", "fix third"],
        ["", 'link "second"', "second", "fix second repair fixes it"],
        ["", 'link "fourth"', "fourth", "fix fourth"],
    ]
    heads = [text.index(f">{name} ({n})<") for name, n in (("error", 2), ("warning", 1), ("info", 1))]
    assert heads == sorted(heads)
    assert reader.count("h3") == 3
    # the same findings as in the printed report
    printed = "\n".join(report_lines(audit_of(*found)))
    assert all(one.message in printed and one.message in reader.text for one in found)


def test_hostile_names_of_robot_elements_and_links_stay_text(tmp_path: Path) -> None:
    bad = finding("x", Severity.ERROR, HOSTILE, links=(HOSTILE, "base"))
    reader = Reader(audit_page(audit_of(bad, robot=HOSTILE), two_boxes(tmp_path)))
    assert is_self_contained(reader)
    assert ["", f'link "{HOSTILE}"', HOSTILE, f"fix {HOSTILE}"] in reader.rows


def test_many_findings_of_a_code_are_counted_after_the_first_rows(tmp_path: Path) -> None:
    many = [finding("x", Severity.INFO, f"n{k}") for k in range(MAX_ROWS + 7)]
    rows = Reader(audit_page(audit_of(*many), two_boxes(tmp_path))).rows
    assert len(rows) == 1 + MAX_ROWS + 1
    assert rows[-1][-1] == "and 7 more"


def test_no_more_pictures_than_the_limit_are_drawn(tmp_path: Path) -> None:
    many = [finding(f"code{k}", Severity.INFO, "t", links=("tip",)) for k in range(MAX_PICTURES + 3)]
    reader = Reader(audit_page(audit_of(*many), two_boxes(tmp_path)))
    assert reader.count("h3") == len(many)
    assert reader.count("img") <= MAX_PICTURES + 3  # two overviews, and a close up after the last


def test_a_small_link_gets_a_close_up_and_a_large_one_does_not(tmp_path: Path) -> None:
    boxes = two_boxes(tmp_path)
    small = Reader(audit_page(audit_of(finding("x", Severity.ERROR, "a", links=("tip",))), boxes))
    large = Reader(audit_page(audit_of(finding("x", Severity.ERROR, "a", links=("base", "tip"))), boxes))
    assert "close up" in small.text
    assert "close up" not in large.text
    assert "base, tip" in large.text
    unknown = Reader(audit_page(audit_of(finding("x", Severity.ERROR, "a", links=("absent",))), boxes))
    assert unknown.count("img") == 2  # the overviews alone


@pytest.mark.parametrize(
    ("found", "status", "kind"),
    [
        ((), "ok", "good"),
        ((finding("x", Severity.WARNING, "a"),), "usable", "good"),
        ((finding("x", Severity.ERROR, "a", fixable=True),), "usable after repair", "good"),
        ((finding("x", Severity.ERROR, "a"),), "not usable", "bad"),
    ],
)
def test_the_badge_shows_the_status(found, status: str, kind: str, tmp_path: Path) -> None:
    text = audit_page(audit_of(*found), two_boxes(tmp_path))
    assert f'<span class="badge {kind}">{status}</span>' in text
    assert ("No findings." in text) == (not found)


def test_a_robot_without_links_has_no_facts_line(tmp_path: Path) -> None:
    assert 'class="facts"' not in audit_page(audit_of(links=0), two_boxes(tmp_path))


# ------------------------------------------------------------------------------------------------ pictures


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float)


def test_a_view_has_the_boxes_of_turned_links_in_the_root_frame(tmp_path: Path) -> None:
    rod = '<visual><geometry><box size="2 0.2 0.4"/></geometry></visual>'
    links = f'<link name="base"/><link name="rod">{rod}</link>'
    view = view_of(draft(tmp_path, links, fixed("rod", "1 2 3", f"0 0 {math.pi / 2}")))
    assert list(view.bounds) == ["rod"]
    assert view.bounds["rod"] == pytest.approx(np.array([[0.9, 1.0, 2.8], [1.1, 3.0, 3.2]]))
    points = view.points()
    assert [points.min(axis=0), points.max(axis=0)] == [
        pytest.approx(view.bounds["rod"][0]), pytest.approx(view.bounds["rod"][1])
    ]  # fmt: skip


def test_links_without_visual_shapes_show_their_collision_shapes_unless_strict(tmp_path: Path) -> None:
    boxes = two_boxes(tmp_path)
    assert set(view_of(boxes).bounds) == {"base", "tip"}
    assert set(view_of(boxes, strict=True).bounds) == {"base"}
    assert set(view_of(boxes, kind="collision", strict=True).bounds) == {"tip"}


def test_a_marked_link_has_the_colour_and_the_others_fade(tmp_path: Path) -> None:
    view = view_of(two_boxes(tmp_path), marked={"tip"}, color=(1.0, 0.0, 0.0, 1.0))
    shapes = dict(zip(view.bounds, view.scene.shapes, strict=True))
    assert shapes["tip"].rgba == (1.0, 0.0, 0.0, 1.0)
    assert shapes["base"].rgba[3] < 0.5
    own = view_of(two_boxes(tmp_path), strict=True)
    assert [shape.rgba for shape in own.scene.shapes] == [(0.0, 1.0, 0.0, 1.0)]


def test_the_whole_robot_is_in_the_picture_and_fills_it(tmp_path: Path) -> None:
    """No surface touches the edge, and the drawn part spans most of one side."""
    picture = pixels(view_of(two_boxes(tmp_path)).picture(width=160, height=120, plain=True))
    drawn = np.abs(picture - picture[0, 0]).max(axis=-1) > 12
    assert not drawn[0].any() and not drawn[-1].any()
    assert not drawn[:, 0].any() and not drawn[:, -1].any()
    rows, columns = np.nonzero(drawn)
    assert max(np.ptp(columns) / 160, np.ptp(rows) / 120) > 0.7


def test_a_focus_brings_the_link_to_the_middle(tmp_path: Path) -> None:
    view = view_of(two_boxes(tmp_path), marked={"tip"}, color=(1.0, 0.0, 0.0, 1.0))
    share = []
    for focus in ((), ("tip",)):
        red, green, _ = np.moveaxis(pixels(view.picture(focus, width=160, height=120)), -1, 0)
        marked = red > 1.6 * np.maximum(green, 1)
        share.append(marked.mean())
    rows, columns = np.nonzero(marked)
    assert share[1] > 10 * share[0] > 0
    assert (rows.mean(), columns.mean()) == (pytest.approx(60, abs=6), pytest.approx(80, abs=6))


@pytest.mark.parametrize(
    "geometry",
    ['<box size="0 1 1"/>', '<sphere radius="-1"/>', '<box size="nan 1 1"/>', '<sphere radius="1e6"/>',
     '<mesh filename="absent.stl"/>', '<torus r="1"/>'],
)  # fmt: skip
def test_shapes_without_a_usable_size_are_not_drawn(geometry: str, tmp_path: Path) -> None:
    links = f'<link name="base"><visual><geometry>{geometry}</geometry></visual></link>'
    assert view_of(draft(tmp_path, links)).is_empty


@pytest.mark.parametrize(
    ("geometry", "box"),
    [
        ('<sphere radius="0.5"/>', (0.5, 0.5, 0.5)),
        ('<cylinder radius="0.3" length="2"/>', (0.3, 0.3, 1.0)),
        ('<capsule radius="0.3" length="2"/>', (0.3, 0.3, 1.3)),
        ('<box size="1 2 3"/>', (0.5, 1.0, 1.5)),
    ],
)
def test_primitives_are_drawn_at_their_size(geometry: str, box, tmp_path: Path) -> None:
    links = f'<link name="base"><visual><geometry>{geometry}</geometry></visual></link>'
    view = view_of(draft(tmp_path, links))
    assert view.bounds["base"][1] == pytest.approx(np.array(box), rel=0.01)


def test_named_materials_colour_shapes_that_refer_to_them(tmp_path: Path) -> None:
    named = '<material name="blue"><color rgba="0 0 2 0.5"/></material>'
    links = f'<link name="base"><visual>{BOX.format(1)}<material name="blue"/></visual></link>'
    (shape,) = view_of(draft(tmp_path, named + links)).scene.shapes
    assert shape.rgba == (0.0, 0.0, 1.0, 0.5)  # bounded to 1
