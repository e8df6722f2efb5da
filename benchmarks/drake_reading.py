"""Print how Drake reads an SDF file; run by `descriptions.py` in an environment with the package `drake`.

Standard input is JSON: `file`, `packages` (name to folder), `model` (the name of the robot) and `q` (joint
name to position). The line that begins with `row: ` gives for each body of the robot its pose, mass, centre
of mass and inertia about it, in the world's frame. Drake refuses elements that SDF does not define and
settings that it has no use for; a copy without shapes, sensors and plugins is read, so that they do not
matter.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex

DROPPED = (
    "sensor",
    "plugin",
    "visual",
    "collision",
    "light",
    "gui",
    "scene",
    "audio",
    "battery",
    "enable_wind",
)
PREFIX = re.compile(r"(</?|\s)(?!xml)(\w+):(?=\w+[\s=>/])")
OF_WORLDS = ("physics", "spherical_coordinates", "atmosphere", "wind", "magnetic_field", "road", "state")


def main() -> None:
    """Read the question and print the answer."""
    question = json.load(sys.stdin)
    plant = MultibodyPlant(time_step=0.0)
    parser = Parser(plant)
    with tempfile.TemporaryDirectory() as folder:
        copies = Copies(Path(folder), {n: Path(p) for n, p in question["packages"].items()})
        models = parser_models(parser, copies, Path(question["file"]))
    plant.Finalize()
    names = [plant.GetModelInstanceName(model) for model in models]
    own = question["model"] if question["model"] in names else names[0]
    context = plant.CreateDefaultContext()
    positions = plant.GetPositions(context)
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        name, start = local_name(plant, joint.model_instance(), joint.name(), own), joint.position_start()
        ends = {1: ("",), 2: ("", "_axis2")}.get(joint.num_positions(), ())
        for number, end in enumerate(ends):  # a joint counts to the model of its child in Drake
            own_name = question["q"].get(f"{joint.name()}{end}", 0.0)
            positions[start + number] = question["q"].get(f"{name}{end}", own_name)
    plant.SetPositions(context, positions)
    answer = {}
    for number in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(number))
        name = local_name(plant, body.model_instance(), body.name(), own)
        if name is None or (plant.IsAnchored(body) and is_default(body, context)):
            continue
        pose = plant.EvalBodyPoseInWorld(context, body)
        inertia = body.CalcSpatialInertiaInBodyFrame(context)
        R, mass, centre = pose.rotation().matrix(), inertia.get_mass(), inertia.get_com()
        tensor = np.zeros((3, 3))
        if mass > 0:
            tensor = mass * inertia.get_unit_inertia().ShiftToCenterOfMass(centre).CopyToFullMatrix3()
        answer[name] = (
            pose.GetAsMatrix4().tolist(),
            mass,
            pose.multiply(centre).tolist(),
            (R @ tensor @ R.T).tolist(),
        )
    print("row: " + json.dumps(answer))


class Copies:
    """Copies of SDF files without what Drake refuses, and of the models that they include."""

    def __init__(self, folder: Path, models: Mapping[str, Path]) -> None:
        self.folder = folder
        self.models = models
        self.made: dict[str, Path] = {}
        """Name of a model to the folder of its copy."""

    def of(self, file: Path, into: Path) -> Path:
        """Return the copy of a file in the folder `into`."""
        into.mkdir(parents=True, exist_ok=True)
        text = PREFIX.sub(r"\1\2_", file.read_text(encoding="utf-8"))  # prefixes are often not declared
        tree = ET.ElementTree(ET.fromstring(text.encode()))
        for parent in list(tree.iter()):
            for child in list(parent):
                if child.tag in DROPPED or (parent.tag == "world" and child.tag in OF_WORLDS):
                    parent.remove(child)
        for include in tree.iter("include"):
            uri = include.find("uri")
            if uri is None or uri.text is None:
                continue
            name = uri.text.strip().removeprefix("model://").rstrip("/")
            if "/" not in name and name in self.models:
                uri.text = f"model://{name}/{self.add(name)}"  # Drake resolves files alone
        place = into / file.name
        tree.write(place)
        return place

    def add(self, name: str) -> str:
        """Copy a model that a file includes and return the name of its newest file."""
        config, listed = self.models[name] / "model.config", "model.sdf"
        if config.is_file():
            versions = [(each.get("version", ""), each.text or "") for each in ET.parse(config).iter("sdf")]
            listed = max(versions)[1].strip() if versions else listed
        if name not in self.made:
            self.made[name] = self.folder / "models" / name
            self.of(self.models[name] / listed, self.made[name])
        return listed


def parser_models(parser: Parser, copies: Copies, file: Path) -> list[ModelInstanceIndex]:
    """Return the models that the copy of a file adds to the plant."""
    copy = copies.of(file, copies.folder / "robot")
    for name, folder in copies.made.items():
        parser.package_map().Add(name, str(folder))
    return parser.AddModels(str(copy))


def is_default(body: object, context: object) -> bool:
    """Return whether a body has the 1 kg and unit inertia of a link without `<inertial>`."""
    inertia = body.CalcSpatialInertiaInBodyFrame(context)  # type: ignore[attr-defined]
    return inertia.get_mass() == 1 and np.array_equal(
        inertia.get_unit_inertia().CopyToFullMatrix3(), np.eye(3)
    )


def local_name(plant: MultibodyPlant, model: ModelInstanceIndex, name: str, own: str) -> str | None:
    """Return the name of a body or joint within the robot called `own`; None for those of others."""
    place = plant.GetModelInstanceName(model)
    if place == own:
        return name
    return f"{place.removeprefix(own + '::')}::{name}" if place.startswith(own + "::") else None


if __name__ == "__main__":
    main()
