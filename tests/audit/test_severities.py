"""Findings of one code differ in remedy, severity and fix, as helps the robot at hand."""

from pathlib import Path

from audit_cases import BOX, INERTIAL, arm, both, collision, inertial, joint, link, robot, visual, write_case

from roboyard.audit import INFO, WARNING, Finding, audit_urdf


def only(text: str, code: str, folder: Path) -> Finding:
    place = folder / f"case{len(list(folder.iterdir()))}"
    place.mkdir()
    found = audit_urdf(write_case(text, place)).of(code)
    assert len(found) == 1
    return found[0]


def test_no_prismatic_joint_is_advised_to_become_continuous(tmp_path: Path) -> None:
    bounds = '<limit lower="{}" upper="{}" effort="1" velocity="1"/>'
    for code, limit in (
        ("limit-missing", ""),
        ("limit-reversed", bounds.format(1, -1)),
        ("limit-endless", bounds.format(-1e6, 1e6)),
    ):
        assert "continuous" not in only(arm(kind="prismatic", limit=limit), code, tmp_path).remedy
        assert "continuous" in only(arm(kind="revolute", limit=limit), code, tmp_path).remedy


def test_many_materials_are_one_info_finding(tmp_path: Path) -> None:
    colours = "".join(f'<material name="m{k}"><color rgba="{k} 0 0 1"/></material>' for k in (0, 1, 0.5))
    finding = only(arm(tip=INERTIAL + visual(more=colours)), "element-repeated", tmp_path)
    assert finding.severity == INFO
    assert "holds 3 <material>" in finding.message


def test_a_misspelt_attribute_is_named_with_what_it_looks_like(tmp_path: Path) -> None:
    finding = only(
        arm(limit='<limit lowr="-1" upper="1" effort="1" velocity="1"/>'), "attribute-unread", tmp_path
    )
    assert finding.severity == WARNING
    assert "write lower" in finding.remedy
    more = arm(limit='<limit lower="-1" upper="1" effort="1" velocity="1" k_velocity="3"/>')
    assert only(more, "attribute-unread", tmp_path).severity == INFO


def test_an_axis_under_a_misspelt_name_is_not_replaced_by_the_default(tmp_path: Path) -> None:
    finding = only(arm(axis='<axis xzy="0 0 1"/>'), "axis-missing", tmp_path)
    assert not finding.fixable
    assert finding.severity == WARNING
    assert only(arm(axis='<axis frame="tip"/>'), "axis-missing", tmp_path).fixable
    fixed = robot(link("base"), link("tip"), joint(kind="fixed", more='<axis xzy="0 0 1"/>'))
    assert only(fixed, "attribute-unread", tmp_path).severity == INFO


def test_repair_is_not_promised_where_there_is_nothing_to_compute_from(tmp_path: Path) -> None:
    for code, tensor in (("inertia-zero", (0,) * 6), ("inertia-not-positive", (1, 0, 0, 1, 0, -1))):
        finding = only(arm(tip=inertial(tensor=tensor)), code, tmp_path)
        assert not finding.fixable
        assert "repair" not in finding.remedy
        assert only(arm(tip=inertial(tensor=tensor) + both()), code, tmp_path).fixable


def test_a_point_mass_fixed_to_a_body_is_harmless(tmp_path: Path) -> None:
    dot = link("dot", inertial(mass="0.001", tensor=(0,) * 6))
    fixed = robot(link("base"), link("tip"), dot, joint(), joint("k", "tip", "dot", "fixed"))
    assert only(fixed, "inertia-zero", tmp_path).severity == INFO
    moving = robot(link("base"), link("tip"), dot, joint(), joint("k", "tip", "dot"))
    assert only(moving, "inertia-zero", tmp_path).severity == WARNING


def test_a_safety_volume_around_a_link_weighs_nothing(tmp_path: Path) -> None:
    guard = link("guard", collision('<box size="0.3 0.3 0.3"/>'))
    parts = (link("base"), link("tip", visual(BOX)), guard, joint(), joint("k", "tip", "guard", "fixed"))
    assert only(robot(*parts), "inertial-missing", tmp_path).element == 'link "tip"'
    alone = robot(link("base"), link("tip", collision()), joint())
    assert only(alone, "inertial-missing", tmp_path).element == 'link "tip"'
