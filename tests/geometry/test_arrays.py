"""Short cuts past numpy for small arrays: the same numbers, to the last digit."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import median, unique_rows
from asbuilt_bim.geometry.masks import at_pixels, nonzero
from asbuilt_bim.geometry.transform import cross


def test_cross_products_are_numpys_to_the_last_digit() -> None:
    rng = np.random.default_rng(3)
    for shape_a, shape_b in (((40, 3), (40, 3)), ((3,), (40, 3)), ((7, 4, 3), (3,)), ((3,), (3,))):
        a, b = rng.normal(size=shape_a) * 1e3, rng.normal(size=shape_b)
        assert cross(a, b).tobytes() == np.cross(a, b).tobytes()


def test_distinct_rows_are_numpys_in_its_order() -> None:
    rows = np.random.default_rng(4).integers(-2, 3, size=(200, 3))
    found, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    ours, ours_which = unique_rows(rows)
    assert np.array_equal(rows[ours], found)
    assert np.array_equal(ours, first)
    assert np.array_equal(ours_which, which.reshape(-1))


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_the_median_is_numpys_to_the_last_digit(kind: type) -> None:
    values = (np.random.default_rng(5).normal(size=1001) * 100.0).astype(kind)
    for count in (1, 2, 3, 10, 11, 1000, 1001):
        assert median(values[:count]) == float(np.median(values[:count]))


def test_a_masks_pixels_are_numpys_in_its_order() -> None:
    mask = np.zeros((20, 30), dtype=bool)
    assert [len(places) for places in nonzero(mask)] == [0, 0]
    mask[5:15, 7:20] = np.random.default_rng(6).random((10, 13)) > 0.5
    assert np.array_equal(nonzero(mask), np.nonzero(mask))
    image = np.random.default_rng(7).normal(size=(20, 30, 3))
    assert np.array_equal(at_pixels(image, *nonzero(mask)), image[mask])


def _grid(count: int) -> np.ndarray:
    """Return a square of `count` x `count` as triangles that share their corners."""
    x, y = (one.reshape(-1, 1) for one in np.meshgrid(np.arange(count), np.arange(count)))
    corner = np.hstack([x, y]).astype(np.float64)
    right, up = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    lower = np.stack([corner, corner + right, corner + right + up], axis=1)
    upper = np.stack([corner, corner + right + up, corner + up], axis=1)
    return np.concatenate([lower, upper])


def test_triangles_that_share_their_corners_become_one_region() -> None:
    (rings,) = polygon.triangles_region(_grid(5))
    assert len(rings) == 1
    assert polygon.ring_area(rings[0]) == pytest.approx(25.0)


def test_triangles_that_overlap_are_united_and_not_added_up() -> None:
    once = _grid(2)
    assert polygon.area(polygon.triangles_region(np.concatenate([once, once + 0.5]))) == pytest.approx(4.0 + 4.0 - 2.25)


def test_triangles_that_only_touch_with_part_of_a_side_are_joined() -> None:
    shifted = np.concatenate([_grid(2), _grid(2) + np.array([2.0, 0.5])])
    (rings,) = polygon.triangles_region(shifted)
    assert polygon.rings_area(rings) == pytest.approx(8.0)
