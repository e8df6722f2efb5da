"""Connected regions against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from roboyard.shapes.voxels.regions import label_regions


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.7, 1.0])
@pytest.mark.parametrize("shape", [(1, 1, 1), (7, 1, 4), (9, 12, 10)])
def test_regions_are_those_of_scipy(shape: tuple[int, int, int], share: float) -> None:
    wall = np.random.default_rng(3).random(shape) < share
    expected = np.zeros(shape, dtype=np.int32)
    count = ndimage.label(~wall, output=expected)
    regions = np.zeros(shape, dtype=np.int32)
    found = label_regions(wall.view(np.uint8), regions, np.empty(wall.size, dtype=np.int64))
    assert found == count
    np.testing.assert_array_equal(regions, expected)
