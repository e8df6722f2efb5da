"""The import page on a robot made in memory: well-formed, safe with hostile names, pictures that decode."""

import base64
import io
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
    Visual,
)
from roboyard.description.robot_model import CollisionSphere, PlanningData, RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.report.links import MAX_LINKS_PICTURED
from roboyard.importer.report.page import import_page, robot_sections, write_import_page
from roboyard.importer.report.pictures import KINDS, view_of_robot
from roboyard.validation.report import Curve, Gate, ValidationReport

HOSTILE = "\"><script>alert('x')</script>&amp;<img src=x onerror=y>"
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Tags, pictures, visible text, and whether every tag that opens is closed in turn."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.images, self.text = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "img":
            self.images.append(dict(attrs)["src"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def pictures(self):
        for source in self.images:
            head, data = source.split(",", 1)
            assert head == "data:image/png;base64"
            yield Image.open(io.BytesIO(base64.b64decode(data, validate=True))).convert("RGB")


def robot_of(names, *, name="pair"):
    """A row of boxes 0.3 m apart, each with one sphere."""
    links = tuple(
        Link(
            name=n,
            inertial=Inertial(mass=1.5),
            visuals=(Visual(geometry=Box(size=(0.2, 0.1, 0.1))),),
            collisions=(Collision(geometry=Box(size=(0.2, 0.1, 0.1))),),
        )
        for n in names
    )
    joints = tuple(
        Joint(name=f"j{k}", type="fixed", parent=a, child=b, origin=Pose(position=(0.3, 0.0, 0.0)))
        for k, (a, b) in enumerate(pairwise(names))
    )
    planning = PlanningData(
        spheres={n: (CollisionSphere(center=(0.0, 0.0, 0.05), radius=0.04),) for n in names},
        ignore={},
    )
    return RobotModel(
        name=name,
        description=RobotDescription(name=name, links=links, joints=joints),
        semantic=SemanticDescription(base_link=names[0]),
        planning=planning,
    )


def test_the_page_is_well_formed_and_its_pictures_show_something():
    page = Page(import_page(robot_of(["base", "tip"]), {}, ()))
    assert not page.open
    pictures = list(page.pictures())
    assert len(pictures) == 2 + len(KINDS) * (1 + 2)  # its parts twice, the whole robot, then each link
    for picture in pictures:
        assert np.asarray(picture).reshape(-1, 3).std(axis=0).max() > 5.0
    assert "3.00 kg" in "".join(page.text)


def gate(name, figure, **more):
    line = Curve(x=np.arange(5.0), lines={name: np.arange(5.0)}, x_label=name, y_label=name)
    values = {"title": f"{name}?", "threshold": 1.0, "unit": "mm", "curve": line, **more}
    return Gate(name=name, figure=figure, **values)


def test_names_and_messages_of_strangers_stay_text():
    log = ImportLog()
    log.warn(HOSTILE, f'link "{HOSTILE}"')
    found = {"code": HOSTILE, "element": HOSTILE, "message": HOSTILE, "severity": HOSTILE, "line": 3}
    facts = {
        "source": {"status": HOSTILE, "findings": [found]},
        "fixes": [{"code": HOSTILE, "element": HOSTILE, "before": HOSTILE, "after": HOSTILE}],
        "read_back": {HOSTILE: [HOSTILE]},
        "files": {HOSTILE: [HOSTILE]},
        "collision": {HOSTILE: {"way": HOSTILE, "meshes": []}},
        "links": {HOSTILE: {"overlaps_mm": {HOSTILE: 1.0}}},
    }
    failed = gate(HOSTILE, 2.0, unit=HOSTILE, detail=HOSTILE, advice=HOSTILE, findings=[HOSTILE])
    skipped = gate(HOSTILE, 0.0, skipped=HOSTILE)
    validation = ValidationReport(robot=HOSTILE, gates=(failed, skipped))
    text = import_page(robot_of([HOSTILE, "tip"], name=HOSTILE), facts, log.warnings, validation)
    page = Page(text)
    assert not page.open
    assert not [tag for tag, _ in page.tags if tag == "script"]
    assert not [a for _, attributes in page.tags for a in attributes if a.startswith("on")]
    assert all(source.startswith("data:image/png;base64,") for source in page.images)
    # title, heading, status, warning (2), gates (7), robot tried, row of findings (5), link (3), file (3)
    assert "".join(page.text).count(HOSTILE) >= 22


def test_gates_are_shown_with_their_curves_and_the_failed_ones_first():
    validation = ValidationReport(
        robot="pair",
        gates=(
            gate("rest", 0.5),
            gate("reach", 2.0, advice="check the joint limits"),
            gate("tuck", 0.0, skipped="no"),
        ),
    )
    page = Page(import_page(robot_of(["base", "tip"]), {}, (), validation))
    words = "".join(page.text)
    assert words.index("reach?") < words.index("rest?") < words.index("tuck?")
    assert "1 gate of 3 failed" in words and "check the joint limits" in words
    assert len([tag for tag, _ in page.tags if tag == "svg"]) == 2
    assert "not validated" in "".join(Page(import_page(robot_of(["base", "tip"]), {}, ())).text)


def test_the_page_needs_nothing_from_elsewhere():
    page = Page(import_page(robot_of(["base", "tip"]), {}, ()))
    assert not [tag for tag, _ in page.tags if tag in ("script", "link", "object")]
    assert not [a for _, attributes in page.tags for a in attributes if a in ("href", "srcset")]


def test_the_robot_moves_in_a_frame_that_reaches_nothing_else():
    page = Page(import_page(robot_of([HOSTILE, "tip"], name=HOSTILE), {}, ()))
    (frame,) = [attributes for tag, attributes in page.tags if tag == "iframe"]
    assert "src" not in frame
    assert frame["sandbox"] == "allow-scripts"  # not of this page's origin
    inner = Page(frame["srcdoc"].split("<script", 1)[0])
    assert not [a for _, attributes in inner.tags for a in attributes if a in ("src", "href", "srcset")]
    assert "<img src=x" not in frame["srcdoc"] and "<script>alert" not in frame["srcdoc"]
    for address in ("http://", "https://", "import("):
        assert address not in frame["srcdoc"].replace("http://www.w3.org", "")
    without = RobotModel(
        name="bare",
        description=RobotDescription(name="bare", links=(Link(name="bare"),), joints=()),
        semantic=SemanticDescription(base_link="bare"),
        planning=PlanningData(spheres={}, ignore={}),
    )
    assert "<iframe" not in import_page(without, {}, ())


def test_facts_are_in_the_rows_of_their_links():
    facts = {
        "collision": {"base": {"method": "convex", "meshes": []}},
        "links": {
            "base": {
                "size": [0.2, 0.1, 0.1],
                "excess": 0.25,
                "missing": 0.01,
                "coverage": 0.6,
                "sphere_excess": 0.3,
                "overlaps_mm": {"tip": 4.25},
            }
        },
        "read_back": {"urdf": [], "mjcf": ["body 'tip' is missing"]},
    }
    words = [word.strip() for word in Page(import_page(robot_of(["base", "tip"]), facts, ())).text]
    first = words[words.index("Links") : words.index("tip")]
    for name, value in {
        "size": "200 × 100 × 100 mm",
        "mass": "1.500 kg",
        "collision": "one hull per mesh",
        "shapes": "1",
        "excess volume": "25% of the link",
        "spheres": "1",
        "covered by spheres": "60%",
        "overlaps tip": "4.2 mm",
    }.items():
        assert first[first.index(name) + 1] == value
    assert words[words.index("mjcf") + 1] == "body 'tip' is missing"
    assert words[words.index("urdf") + 1] == "read back and equal"


def test_findings_of_a_kind_share_a_row_with_their_result():
    found = {"severity": "info", "line": 7, "element": "link", "message": "bad", "code": "a"}
    facts = {
        "source": {"findings": [found] * 75 + [{**found, "code": "b"}, {**found, "code": "c"}]},
        "fixes": [{"code": "a", "element": "link", "before": "none", "after": "some"}] * 75,
        "remaining": [{"code": "b"}, {"code": "c"}],
        "unresolved": [{"code": "c"}],
    }
    words = [word.strip() for word in Page(import_page(robot_of(["base", "tip"]), facts, ())).text]
    assert "bad — and 74 more like this" in words and "fixed: none → some" in words
    assert words.index("resolved by the import") < words.index("unchanged")


def test_no_more_links_are_pictured_than_said():
    names = [f"link{k}" for k in range(MAX_LINKS_PICTURED + 3)]
    page = Page(import_page(robot_of(names), {}, ()))
    assert len(page.images) == 2 + len(KINDS) * (1 + MAX_LINKS_PICTURED)
    assert "3 more links are not pictured." in "".join(page.text)


def test_a_robot_without_shapes_has_a_page_without_pictures():
    bare = RobotModel(
        name="bare",
        description=RobotDescription(name="bare", links=(Link(name="base"),)),
        semantic=SemanticDescription(base_link="base"),
    )
    page = Page(import_page(bare, {}, ()))
    assert not page.open and not page.images
    assert "0.00 kg" in "".join(page.text)


def test_boxes_round_links_follow_joints_and_spheres():
    robot = robot_of(["base", "tip"])
    visual, _, spheres = (view_of_robot(robot, kind) for kind in KINDS)
    assert visual.bounds["tip"] == pytest.approx(np.array([[0.2, -0.05, -0.05], [0.4, 0.05, 0.05]]))
    # the sphere protrudes above the link, which is drawn behind it
    assert spheres.bounds["tip"] == pytest.approx(
        np.array([[0.2, -0.05, -0.05], [0.4, 0.05, 0.09]]), abs=1e-3
    )
    assert view_of_robot(replace(robot, planning=None), "planning spheres").is_empty


def test_the_file_lies_in_the_package(tmp_path):
    context = ImportContext(
        config=ImportConfig.model_validate({"name": "pair", "urdf_path": "pair.urdf"}),
        urdf=tmp_path / "pair.urdf",
        source=parse_urdf(tmp_path / "pair.urdf"),
        build=tmp_path,
        log=ImportLog(),
    )
    robot = robot_of(["base", "tip"])
    write_import_page(robot, context)
    assert (tmp_path / "import_report.html").read_text(encoding="utf-8") == import_page(robot, {}, ())


def test_sections_made_in_a_thread_give_the_same_page():
    robot = robot_of(["base", "tip"])
    with ThreadPoolExecutor(max_workers=1) as pool:
        sections = pool.submit(robot_sections, robot, {}).result()
    assert import_page(robot, {}, (), sections=sections) == import_page(robot, {}, ())


def test_findings_of_one_kind_are_merged():
    log = ImportLog()
    for k in range(5):
        log.warn(f"mesh {k} is open; close it [mesh-open]", f'link "l{k}"', code="mesh-open")
    log.warn("too heavy", 'link "l0"')
    shown = "".join(Page(import_page(robot_of(["l0", "l1"]), log.facts, log.warnings)).text)
    assert "mesh 0 is open; close it [mesh-open] (and 4 more like this)" in shown
    assert "mesh 1 is open" not in shown
    assert "2 warnings" in shown


def test_a_joint_that_cannot_be_at_zero_is_drawn_at_its_limit():
    robot = robot_of(["base", "tip"])
    lift = Joint(
        name="lift",
        type="prismatic",
        parent="base",
        child="tip",
        axis=(0.0, 0.0, 1.0),
        limit=Limit(lower=0.5, upper=1.0),
    )
    robot = replace(robot, description=replace(robot.description, joints=(lift,)))
    view = view_of_robot(robot, "visual shapes")
    assert view.bounds["tip"][:, 2] == pytest.approx([0.45, 0.55])


def test_pictures_are_drawn_only_once_openusd_has_loaded(tmp_path, monkeypatch):
    """OpenUSD's libraries give up Python's lock while they load; another thread that loads libraries then
    waits for them, and they for it."""
    import roboyard.importer.report.page as page
    import roboyard.importer.verify.read_back as read_back
    import roboyard.importer.write_formats as write_formats
    from roboyard.importer.pipeline import import_robot

    order = []
    steps = ((write_formats, "write_package"), (read_back, "check_files"), (page, "robot_sections"))
    for module, name in steps:
        original = getattr(module, name)

        def noted(*arguments, name=name, original=original):
            order.append(name)
            return original(*arguments)

        monkeypatch.setattr(module, name, noted)
    file = tmp_path / "ball.urdf"
    file.write_text(
        "<robot name='ball'><link name='ball'><inertial><mass value='1'/>"
        "<inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial>"
        "<visual><geometry><sphere radius='0.1'/></geometry></visual>"
        "<collision><geometry><sphere radius='0.1'/></geometry></collision></link></robot>"
    )
    built = import_robot(file, out=tmp_path / "data", validate=False)
    assert order == ["write_package", "check_files", "robot_sections"]
    assert "data:image" in (built.folder / "import_report.html").read_text()


def chain_of(count):
    links = "".join(
        f"<link name='l{k}'><inertial><mass value='1'/>"
        "<inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial>"
        "<visual><origin xyz='0 0 0.1'/><geometry><box size='0.1 0.1 0.2'/></geometry></visual>"
        "<collision><origin xyz='0 0 0.1'/><geometry><box size='0.1 0.1 0.18'/></geometry></collision></link>"
        for k in range(count)
    )
    joints = "".join(
        f"<joint name='j{k}' type='{'fixed' if k > 1 else 'revolute'}'>"
        f"<parent link='l{k}'/><child link='l{k + 1}'/>"
        f"<origin xyz='0 0 0.2'/><axis xyz='{k % 2} {1 - k % 2} 0'/>"
        "<limit lower='-1' upper='1' effort='300' velocity='2'/></joint>"
        for k in range(count - 1)
    )
    return f"<robot name='chain'>{links}{joints}</robot>"


def test_a_second_process_gives_the_same_package(tmp_path, monkeypatch):
    import json
    import re

    import roboyard.importer.pipeline as pipeline
    from roboyard._second_process import SecondProcess

    taken = []

    class Watched(SecondProcess):
        """Notes which calls the process took."""

        def call(self, function, *arguments):
            part = super().call(function, *arguments)
            taken.append((function.__name__, part))
            return part

    monkeypatch.setattr(pipeline, "SecondProcess", Watched)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    file = tmp_path / "chain.urdf"
    file.write_text(chain_of(pipeline.LINKS))

    def package(threads):
        monkeypatch.setenv("ROBOYARD_THREADS", threads)
        folder = pipeline.import_robot(file, out=tmp_path / f"data{threads}").folder
        files = {
            str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()
        }
        log = {**json.loads(files.pop("import_log.json")), "seconds": 0}
        report = files.pop("import_report.html").decode()
        text = re.sub(r'"(seconds|cached)": [^,}]+', "", json.dumps(log))
        return files, text, re.sub(r"on a floor, [\d.]+ s;", "", report)

    alone = package("1")
    assert not any(part.under_way for _, part in taken)
    taken.clear()
    assert package("2") == alone
    assert "get_ready" in [name for name, part in taken if part.under_way]
