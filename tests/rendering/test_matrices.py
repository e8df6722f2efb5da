"""Matrices of cameras that are scaled, sheared or mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering.matrices import is_rotation, look_at_view, perspective, with_rigid_view


@pytest.mark.parametrize("seed", range(5))
def test_what_a_view_scales_and_mirrors_goes_into_the_projection(seed: int) -> None:
    random = np.random.default_rng(seed)
    view = look_at_view((2.0, -3.0, 1.5), (0.1, 0.2, 0.3))
    view[:3] = random.normal(size=(3, 3)) @ view[:3]
    projection = perspective(0.8, 1.5, 0.1, 10.0)
    rigid, rest = with_rigid_view(view, projection)
    assert is_rotation(rigid[:3, :3])
    np.testing.assert_allclose(rest[3], (0.0, 0.0, -1.0, 0.0), atol=1e-12)
    for point in random.normal(size=(10, 3)):
        one, two = (matrix @ (*point, 1.0) for matrix in (projection @ view, rest @ rigid))
        np.testing.assert_allclose(two / two[3], one / one[3], rtol=1e-9, atol=1e-9)


def test_mirrors_and_scales_are_no_rotations() -> None:
    assert is_rotation(look_at_view((1, 2, 3), (0, 0, 0))[:3, :3])
    assert not is_rotation(np.diag([1.0, 1.0, -1.0]))
    assert not is_rotation(1.1 * np.eye(3))
