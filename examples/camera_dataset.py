"""Pictures for learning, of random scenes: colour, depth and the object in each pixel, with poses as JSON.

python examples/camera_dataset.py FOLDER [COUNT]
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from roboyard import Camera, World
from roboyard.assets import asset_path

MODELS = ("duck_vhacd.urdf", "domino/domino.urdf", "lego/lego.urdf", "cube_small.urdf", "jenga/jenga.urdf")
"""Objects of the scenes."""


def scene(random: np.random.Generator) -> tuple[World, dict[int, str]]:
    """A world with objects that fell on a table, and the name of each body id."""
    world = World()
    world.add_plane()
    world.add_box(
        (0.8, 0.8, 0.02), (0, 0, 0.39), mass=0, rgba=(*random.uniform(0.3, 0.9, 3), 1), name="table"
    )
    names = {}
    for k in range(random.integers(3, 8)):
        model = MODELS[random.integers(len(MODELS))]
        at = (*random.uniform(-0.2, 0.2, 2), 0.5 + 0.12 * k)
        turn = random.normal(size=4)
        body = world.add_urdf(asset_path(model), position=at, orientation=turn / np.linalg.norm(turn))
        names[body.id] = Path(model).stem
    world.step(480)
    return world, names


def main(folder: Path, count: int = 20, seed: int = 0) -> int:
    """Write `count` samples; return the number of labelled objects."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(seed)
    labelled = 0
    for k in range(count):
        world, names = scene(random)
        angle, height = random.uniform(0, 2 * np.pi), random.uniform(0.6, 0.9)
        eye = (0.5 * np.cos(angle), 0.5 * np.sin(angle), height)
        camera = Camera.look_at(eye=eye, target=(0, 0, 0.42), width=320, height=240)
        image = world.render(camera)
        bodies = image.segmentation[..., 0]
        Image.fromarray(image.rgba[..., :3]).save(folder / f"{k:05d}_rgb.png")
        millimetres = np.clip(1000 * image.depth, 0, 65535).astype(np.uint16)
        Image.fromarray(millimetres).save(folder / f"{k:05d}_depth.png")
        Image.fromarray((bodies + 1).astype(np.uint8)).save(folder / f"{k:05d}_objects.png")
        objects = []
        for body in world.bodies:
            rows, columns = np.nonzero(bodies == body.id)
            if body.id in names and len(rows):
                position, quaternion = body.pose
                objects.append({
                    "pixel_value": body.id + 1, "name": names[body.id],
                    "box": [int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max())],
                    "position": position.tolist(), "quaternion": quaternion.tolist(),
                })  # fmt: skip
        labelled += len(objects)
        sample = {"eye": eye, "target": (0, 0, 0.42), "objects": objects}
        (folder / f"{k:05d}.json").write_text(json.dumps(sample, indent=1), encoding="utf-8")
    print(f"{count} samples with {labelled} labelled objects in {folder}")
    return labelled


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 20)
