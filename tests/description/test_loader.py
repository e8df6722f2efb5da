"""The reader is chosen by content; what is not read is an error that names the remedy."""

import pytest

from roboyard.description import load_description
from roboyard.errors import DescriptionError


def test_content_decides_not_the_suffix(tmp_path):
    file = tmp_path / "robot.xml"
    file.write_text('<robot name="r"><link name="base"/></robot>')
    assert load_description(file).name == "r"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("arm.sdf", '<sdf version="1.7"/>', "the file has no <model>; give one that has a robot"),
        ("arm.xml", "<mujoco/>", "the model has no <body>; give one that has a robot"),
        ("arm.html", "<html/>", "the root element is <html>, not <robot>; give a URDF"),
        (
            "arm.urdf.xacro",
            '<robot><xacro:arm xmlns:xacro="x"/></robot>',
            "unknown macro name: xacro:arm",
        ),
    ],
)
def test_what_is_not_read_names_the_remedy(tmp_path, name, text, message):
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        load_description(file)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{name}:")
