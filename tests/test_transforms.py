"""Single poses take a shorter way than arrays of them, with the same bits at its end."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard import transforms

RNG = np.random.default_rng(3)
QUATERNIONS, OTHERS, VECTORS = RNG.normal(size=(40, 4)), RNG.normal(size=(40, 4)), RNG.normal(size=(40, 3))


@pytest.mark.parametrize(
    ("function", "arrays"),
    [
        (transforms.multiply, (QUATERNIONS, OTHERS)),
        (transforms.rotate, (QUATERNIONS, VECTORS)),
        (transforms.matrix_from_quaternion, (QUATERNIONS,)),
        (transforms.normalized, (QUATERNIONS,)),
        (transforms.to_wxyz, (QUATERNIONS,)),
        (transforms.from_wxyz, (QUATERNIONS,)),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_one_is_as_many(function, arrays):
    together = function(*arrays)
    for k in range(len(QUATERNIONS)):
        alone = function(*(array[k] for array in arrays))
        assert alone.dtype == float and alone.shape == together[k].shape
        np.testing.assert_array_equal(alone, together[k])
        np.testing.assert_array_equal(function(*(tuple(array[k]) for array in arrays)), alone)


def test_products_rotate_as_matrices_do():
    a, b = transforms.normalized(QUATERNIONS[0]), transforms.normalized(OTHERS[0])
    product = transforms.matrix_from_quaternion(a) @ transforms.matrix_from_quaternion(b)
    np.testing.assert_allclose(
        transforms.matrix_from_quaternion(transforms.multiply(a, b)), product, atol=1e-14
    )
    np.testing.assert_allclose(
        transforms.rotate(a, VECTORS[0]), transforms.matrix_from_quaternion(a) @ VECTORS[0], atol=1e-14
    )
    np.testing.assert_array_equal(transforms.from_wxyz(transforms.to_wxyz(a)), a)
