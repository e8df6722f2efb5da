"""The findings page: self-contained, safe, and with the links concerned picked out."""

import base64
import io
import re
import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "audit"))
from audit_cases import CASES, arm, both, inertial, write_case

from roboyard.reports.audit_page import write_audit_page


def pictures(page: str) -> list[np.ndarray]:
    found = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
    return [
        np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"), float) for data in found
    ]


def share_of_orange(picture: np.ndarray) -> float:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return float(((red > 1.4 * green) & (green > 2 * blue)).mean())


def test_the_link_at_fault_stands_out(tmp_path: Path) -> None:
    file = write_case(arm(tip=inertial("1", (1, 0, 0, 0.1, 0, 0.1)) + both()), tmp_path)
    audit = write_audit_page(file, tmp_path / "page.html")
    assert "inertia-triangle" in audit.codes
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    looks, collides, marked = pictures(page)[:3]
    assert share_of_orange(looks) == share_of_orange(collides) == 0
    assert 0.01 < share_of_orange(marked) < 0.5
    assert np.ptp(looks, axis=(0, 1)).max() > 50  # something is drawn


def test_the_page_is_self_contained(tmp_path: Path) -> None:
    write_audit_page(write_case(arm(axis='<axis xyz="0 0 2"/>'), tmp_path), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=\"(?!data:)|url\(|@import|<script", page)


def test_names_are_escaped(tmp_path: Path) -> None:
    text = arm(name="&lt;script&gt;alert(1)&lt;/script&gt;", axis='<axis xyz="0 0 2"/>')
    write_audit_page(write_case(text, tmp_path), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_a_file_that_cannot_be_read_has_a_page_without_pictures(tmp_path: Path) -> None:
    write_audit_page(write_case("<robot>", tmp_path), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "xml-syntax" in page
    assert pictures(page) == []


def test_a_broken_tree_is_shown_as_far_as_it_goes(tmp_path: Path) -> None:
    for code in ("link-two-parents", "joint-link-unknown", "mesh-missing", "geometry-size-negative"):
        folder = tmp_path / code
        folder.mkdir()
        audit = write_audit_page(write_case(CASES[code][0], folder), folder / "page.html")
        assert not audit.is_usable
        assert pictures((folder / "page.html").read_text(encoding="utf-8"))


def test_a_sound_robot_says_so(tmp_path: Path) -> None:
    write_audit_page(write_case(arm(), tmp_path), tmp_path / "page.html")
    assert "No findings" in (tmp_path / "page.html").read_text(encoding="utf-8")
