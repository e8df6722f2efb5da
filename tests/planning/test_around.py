"""The sphere around a link's spheres, which is found once, goes with the link."""

from __future__ import annotations

import numpy as np

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.planning import fitted_model
from roboyard.planning.spheres.sphere_model import bounding_sphere, sphere_robot


def test_the_sphere_around_a_link_is_that_of_its_spheres_where_they_are() -> None:
    model = fitted_model(load_description(assets_root() / "arm7" / "arm7.urdf"))
    names = model.coordinate_names
    for held in ({}, dict.fromkeys(names[1:3], 0.7)):  # held joints turn the links that follow
        arrays = sphere_robot(model, [name for name in names if name not in held], held).arrays
        for k, around in enumerate(arrays.around):
            own = arrays.spheres[arrays.start[k] : arrays.start[k + 1]]
            np.testing.assert_allclose(around, bounding_sphere(own), atol=1e-12)
            reach = np.linalg.norm(own[:, :3] - around[:3], axis=1) + own[:, 3]
            assert reach.max() <= around[3] + 1e-12
