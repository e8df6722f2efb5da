"""Odd numbers: each is read where its meaning is plain, and is an error otherwise."""

import warnings
from pathlib import Path

import pytest
from audit_cases import arm, both, inertial, write_case

from roboyard.audit import ERROR, audit_urdf
from roboyard.description import load_description
from roboyard.errors import RoboyardError
from roboyard.repair import repair_urdf

ODD = (
    *(
        "1e308",
        "-1e308",
        "1e-320",
        "5e-324",
        "1e155",
        "1e-160",
        "inf",
        "-inf",
        "nan",
        "1e999",
        "0x10",
        "0x1p3",
    ),
    *(
        "١",
        "１",
        "1,5",
        "1.5.2",
        "--1",
        "1_000",
        "1e",
        "1d5",
        "10mm",
        ".",
        "+",
        "1" * 40_000,
        "1e" + "9" * 4000,
    ),
)
TINY = ("1e-320", "5e-324", "1e-160")
ZERO_IS_FINE = ("position", "angle", "shape position", "dynamics", "colour")
PLACES = {
    "position": lambda n: arm(origin=f'<origin xyz="0 {n} 0"/>'),
    "angle": lambda n: arm(origin=f'<origin rpy="0 {n} 0"/>'),
    "quaternion": lambda n: arm(origin=f'<origin quat_xyzw="0 0 0 {n}"/>'),
    "shape position": lambda n: arm(tip=inertial() + both(origin=f'<origin xyz="{n} {n} {n}"/>')),
    "size": lambda n: arm(tip=inertial() + both(f'<box size="0.1 {n} 0.1"/>')),
    "radius": lambda n: arm(tip=inertial() + both(f'<cylinder radius="{n}" length="{n}"/>')),
    "mass": lambda n: arm(tip=inertial(mass=n) + both()),
    "inertia": lambda n: arm(tip=inertial(tensor=(n, 0, n, 0.01, 0, n)) + both()),
    "axis": lambda n: arm(axis=f'<axis xyz="0 {n} {n}"/>'),
    "limit": lambda n: arm(limit=f'<limit lower="{n}" upper="{n}" effort="{n}" velocity="{n}"/>'),
    "dynamics": lambda n: arm(more="", origin="", axis=f'<dynamics damping="{n}" friction="{n}"/>'),
    "colour": lambda n: arm(more=f'<material name="m"><color rgba="{n} 0 0 1"/></material>'),
}


@pytest.mark.parametrize("place", PLACES)
def test_odd_numbers_get_a_finding_without_a_warning(place: str, tmp_path: Path) -> None:
    for k, number in enumerate(ODD):
        folder = tmp_path / str(k)
        folder.mkdir()
        file = write_case(PLACES[place](number), folder)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = audit_urdf(file)
            assert result.findings or (number in TINY and place in ZERO_IS_FINE), number
            assert "not-loadable" not in result.codes or place == "axis"
            assert all(len(finding.message) <= 400 for finding in result.findings)
            if not any(finding.severity == ERROR for finding in result.findings):
                load_description(file)
            elif place not in ("mass", "inertia") or not result.of("number-huge"):  # kept as written
                with pytest.raises(RoboyardError) as caught:
                    load_description(file)
                assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    "text", ["0x10", "1d5", "10mm", "1_000", "1e", "1.5.2", "0,5", "1,5 0,5", "1,5 0 0,5"]
)
def test_text_with_two_meanings_is_not_guessed_at(text: str, tmp_path: Path) -> None:
    whole = text if " " in text else f"{text} {text} {text}"
    result = audit_urdf(write_case(arm(origin=f'<origin xyz="{whole}"/>'), tmp_path))
    assert [(f.code, f.severity) for f in result.findings] == [("number-wrong", ERROR)]


def test_a_quaternion_of_any_length_is_a_direction(tmp_path: Path) -> None:
    file = write_case(arm(origin='<origin xyz="0 0 0.2" quat_xyzw="0 0 3e307 4e307"/>'), tmp_path)
    assert audit_urdf(file).codes == ("number-sloppy",)
    assert load_description(file).joints[0].origin.quaternion == pytest.approx((0, 0, 0.6, 0.8), abs=1e-15)
    repaired = repair_urdf(file, tmp_path / "out")
    assert repaired.after.codes == ()
    assert load_description(repaired.urdf).joints[0].origin.quaternion == pytest.approx(
        (0, 0, 0.6, 0.8), abs=1e-15
    )


def test_optenv_without_a_default_is_an_error_not_a_crash(tmp_path: Path) -> None:
    file = write_case(arm(limit='<limit lower="$(optenv A)" upper="1" effort="1" velocity="1"/>'), tmp_path)
    assert audit_urdf(file).codes[0] == "number-wrong"
    with pytest.raises(RoboyardError, match="holds 0 of 1 numbers; give one number"):
        load_description(file)


def test_audit_and_reader_take_the_same_shape_of_a_geometry(tmp_path: Path) -> None:
    file = write_case(arm(tip=inertial() + both('<cone/><box size="0.1 0.1 0.1"/>')), tmp_path)
    assert "geometry-unknown" not in audit_urdf(file).codes
    assert load_description(file).link_by_name["tip"].collisions
