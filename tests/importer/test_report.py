"""The import report on a robot made in memory: well-formed, safe with hostile names, pictures that decode."""

import base64
import io
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from roboyard.importer.config import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.log import ImportLog
from roboyard.importer.model import CollisionSphere, ImportedRobot, PlanningData
from roboyard.importer.report import MAX_LINKS_PICTURED, report_page, write_report
from roboyard.importer.report_pictures import KINDS, sights_of
from roboyard.urdf.model import Box, Collision, Inertial, Joint, Link, Pose, RobotDescription, Visual

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
        end_effectors=(),
        ignore={},
    )
    return ImportedRobot(
        name=name,
        description=RobotDescription(name=name, links=links, joints=joints),
        base_link=names[0],
        planning=planning,
    )


def test_the_page_is_well_formed_and_its_pictures_show_something():
    page = Page(report_page(robot_of(["base", "tip"]), {}, ()))
    assert not page.open
    pictures = list(page.pictures())
    assert len(pictures) == len(KINDS) * (1 + 2)  # the whole robot, then each link
    for picture in pictures:
        assert np.asarray(picture).reshape(-1, 3).std(axis=0).max() > 5.0
    assert "3.00 kg" in "".join(page.text)


def test_names_and_messages_of_strangers_stay_text():
    log = ImportLog()
    log.warn(HOSTILE, f'link "{HOSTILE}"')
    facts = {
        "source": {"verdict": HOSTILE},
        "mends": [{"element": HOSTILE, "before": HOSTILE, "after": HOSTILE}],
        "validation": {HOSTILE: [HOSTILE]},
        "collision": {HOSTILE: {"way": HOSTILE, "meshes": []}},
    }
    text = report_page(robot_of([HOSTILE, "tip"], name=HOSTILE), facts, log.warnings)
    page = Page(text)
    assert not page.open
    assert not [tag for tag, _ in page.tags if tag == "script"]
    assert not [a for _, attributes in page.tags for a in attributes if a.startswith("on")]
    assert all(source.startswith("data:image/png;base64,") for source in page.images)
    # title, heading, element and message of the warning, verdict, mend (3), check (2), row (2), link heading
    assert "".join(page.text).count(HOSTILE) >= 12


def test_the_page_needs_nothing_from_elsewhere():
    page = Page(report_page(robot_of(["base", "tip"]), {}, ()))
    assert not [tag for tag, _ in page.tags if tag in ("script", "link", "iframe", "object")]
    assert not [a for _, attributes in page.tags for a in attributes if a in ("href", "srcset")]


def test_facts_stand_in_the_rows_of_their_links():
    facts = {
        "collision": {
            "base": {"way": "convex", "meshes": [{"excess_volume": 0.25}, {"excess_volume": None}]}
        },
        "validation": {"urdf": [], "mjcf": ["body 'tip' is missing"]},
        "mends": [{"element": "joint", "before": "none", "after": "some"}] * 75,
    }
    words = [word.strip() for word in Page(report_page(robot_of(["base", "tip"]), facts, ())).text]
    row = words.index("convex")
    assert words[row - 2 : row + 4] == ["base", "1.500", "convex", "1", "0.25", "1"]
    assert words[words.index("mjcf") + 1] == "body 'tip' is missing"
    assert words[words.index("urdf") + 1] == "read back and found equal"
    assert "15 more stand in import_log.json." in words


def test_no_more_links_are_pictured_than_said():
    names = [f"link{k}" for k in range(MAX_LINKS_PICTURED + 3)]
    page = Page(report_page(robot_of(names), {}, ()))
    assert len(page.images) == len(KINDS) * (1 + MAX_LINKS_PICTURED)
    assert "3 more links are not pictured." in "".join(page.text)


def test_a_robot_without_shapes_has_a_page_without_pictures():
    bare = ImportedRobot(
        name="bare", description=RobotDescription(name="bare", links=(Link(name="base"),)), base_link="base"
    )
    page = Page(report_page(bare, {}, ()))
    assert not page.open and not page.images
    assert "0.00 kg" in "".join(page.text)


def test_boxes_round_links_follow_joints_and_spheres():
    robot = robot_of(["base", "tip"])
    visual, _, spheres = (sights_of(robot, kind) for kind in KINDS)
    assert visual.bounds["tip"] == pytest.approx(np.array([[0.2, -0.05, -0.05], [0.4, 0.05, 0.05]]))
    assert spheres.bounds["tip"] == pytest.approx(
        np.array([[0.26, -0.04, 0.01], [0.34, 0.04, 0.09]]), abs=1e-3
    )
    assert sights_of(replace(robot, planning=None), "planner's spheres").is_empty


def test_the_file_lies_in_the_package(tmp_path):
    context = ImportContext(
        config=ImportConfig.model_validate({"name": "pair", "urdf_path": "pair.urdf"}),
        urdf=tmp_path / "pair.urdf",
        build=tmp_path,
        log=ImportLog(),
    )
    robot = robot_of(["base", "tip"])
    write_report(robot, context)
    assert (tmp_path / "import_report.html").read_text(encoding="utf-8") == report_page(robot, {}, ())
