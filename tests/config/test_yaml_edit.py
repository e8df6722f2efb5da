from __future__ import annotations

import copy
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from roboyard.assets import asset_path
from roboyard.config.yaml_edit import edited_yaml, write_with_backup
from roboyard.errors import ConfigError

TEXT = """\
# Configuration of the importer.
name: arm   # lower case

curobo:     # for the planner
  # by hand
  collision_spheres:  # in each link's frame
    palm:
      - {center: [0.0, 0.0, 0.01], radius: 0.06}  # big
      - {center: [0.0, 0.0, -0.01], radius: 0.05}
      # the last
      - center: [1, 2, 3]
        radius: 0.01

    left: [{center: [0.1, 0, 0], radius: 0.02}]
  lock_joints: {}
  empty:
  after: true  # end
# end of file
"""


def changed(change) -> str:
    data = yaml.safe_load(TEXT)
    change(data)
    result = edited_yaml(TEXT, data)
    assert yaml.safe_load(result) == data
    return result


def test_one_number_changes_one_number() -> None:
    result = changed(lambda d: d["curobo"]["collision_spheres"]["palm"][0].update(radius=0.07))
    assert result == TEXT.replace("0.06", "0.07")
    result = changed(lambda d: d["curobo"]["collision_spheres"]["palm"][2]["center"].__setitem__(1, 2.5))
    assert result == TEXT.replace("[1, 2, 3]", "[1, 2.5, 3]")


def test_unchanged_data_changes_nothing() -> None:
    assert edited_yaml(TEXT, yaml.safe_load(TEXT)) == TEXT


def test_items_are_added_and_removed_with_their_lines() -> None:
    def add(d):
        d["curobo"]["collision_spheres"]["palm"].append({"center": [0.5, 0.0, 0.0], "radius": 0.2})

    new = "      - {center: [0.5, 0.0, 0.0], radius: 0.2}\n"
    assert changed(add) == TEXT.replace("        radius: 0.01\n", "        radius: 0.01\n" + new)
    result = changed(lambda d: d["curobo"]["collision_spheres"]["palm"].pop(1))
    assert result == TEXT.replace("      - {center: [0.0, 0.0, -0.01], radius: 0.05}\n", "")


def test_keys_are_added_and_removed() -> None:
    spheres = [{"center": [0.0, 0.0, 0.0], "radius": 0.5}, {"center": [1.0, 0.0, 0.0], "radius": 0.5}]
    result = changed(lambda d: d["curobo"]["collision_spheres"].update(tip=spheres))
    lines = "".join(f"      - {{center: [{x}, 0.0, 0.0], radius: 0.5}}\n" for x in (0.0, 1.0))
    lines = f"    tip:\n{lines}"
    assert lines in result
    assert result.replace(lines, "") == TEXT
    result = changed(lambda d: d["curobo"]["collision_spheres"].pop("palm"))
    assert "palm" not in result
    assert "# in each link's frame" in result
    assert "left: [" in result
    result = changed(lambda d: d.update(sensors=[{"link": "eyes", "parent_link": None}]))
    assert result.startswith(TEXT.split("# end of")[0])


def test_empty_values_are_filled_and_emptied() -> None:
    result = changed(lambda d: d["curobo"]["lock_joints"].update(hinge=0.5))
    assert "lock_joints: {hinge: 0.5}\n" in result
    result = changed(lambda d: d["curobo"].update(empty={"a": [[1.0, 2.0], [3.0]], "b": 1}))
    assert "  after: true  # end" in result
    changed(lambda d: d["curobo"].update(collision_spheres={}))
    changed(lambda d: d.update(curobo=None))


def test_strings_are_quoted_where_needed() -> None:
    words = ["no", "1", "a: b", "# not a comment", "", "x,y", "käse", "12:30", "null"]
    changed(lambda d: d.update(words=words))
    result = changed(lambda d: d.update(name="yes"))
    assert 'name: "yes"   # lower case' in result


def test_small_numbers_stay_numbers() -> None:
    result = changed(lambda d: d.update(small=[1e-06, 1.5e-07, -2e20]))
    assert yaml.safe_load(result)["small"] == [1e-06, 1.5e-07, -2e20]


def test_anchors_raise_an_error() -> None:
    text = "a: &x {b: 1}\nc: *x\n"
    with pytest.raises(ConfigError, match="cannot be edited in place"):
        edited_yaml(text, {"a": {"b": 2}, "c": {"b": 1}})
    with pytest.raises(ConfigError, match="cannot be edited"):
        edited_yaml("a: [", {})


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.floats(-9, 9) | st.text("ab:#-1 ", max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from("pqrst"), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(before=PLAIN, after=PLAIN, flow=st.sampled_from([None, True, False]))
def test_result_of_any_edit_parses_as_the_data(before, after, flow) -> None:
    text = "# top\n" + yaml.safe_dump({"k": before, "z": 0}, default_flow_style=flow) + "# bottom\n"
    for data in ({"k": after, "z": 0}, {"k": before, "z": 0, "new": after}, {"z": 0}):
        result = edited_yaml(text, copy.deepcopy(data))
        assert yaml.safe_load(result) == data
        assert result.startswith("# top\n")
        assert result.rstrip().endswith("# bottom")


def test_the_bundled_configuration_keeps_its_comments() -> None:
    text = asset_path("r1/r1_description/urdf/r1_source_config.yaml").read_text()
    data = yaml.safe_load(text)
    data["camera_links"][0]["offset"]["position"] = [0.08, 0.0, 0.46]
    data["curobo"]["collision_spheres"]["base_link"][0]["radius"] = 0.1
    data["curobo"]["self_collision_ignore"]["torso_link4"].append("left_arm_link3")
    result = edited_yaml(text, data)
    assert yaml.safe_load(result) == data
    before, after = text.splitlines(), result.splitlines()
    assert len(before) == len(after)
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 3


def test_files_are_replaced_atomically_with_a_backup(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    assert write_with_backup(file, "a: 1\n") is None
    backup = write_with_backup(file, "a: 2\n")
    assert backup is not None
    assert (file.read_text(), backup.read_text()) == ("a: 2\n", "a: 1\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.yaml", "a.yaml.bak"]
