"""Parts of walls and columns: what joins two to one thing, and what keeps them apart."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.vision.networks.map_geometry import Relief
from asbuilt_bim.vision.networks.part_affinity import contracted, joined
from asbuilt_bim.vision.networks.parts import Part, described, gaps, numbered_parts

H, W, F_PX = 96, 128, 110.0
LEFT, RIGHT = (slice(20, 80), slice(10, 50)), (slice(20, 80), slice(60, 110))
COLUMNS = np.arange(W, dtype=np.float32)


def parts_of(
    inverse: np.ndarray, votes: tuple[float, float] = (45.0, 75.0), columns: tuple[bool, bool] = (False, False)
) -> tuple[list[Part], np.ndarray]:
    """Two parts on a surface of this 1/Z (h, w), with the column that each votes for, and which is called a column."""
    number = np.full((H, W), -1, np.int32)
    where = np.zeros((2, H, W), np.float32)
    against = np.zeros((H, W), np.float32)
    for k, box in enumerate((LEFT, RIGHT)):
        number[box] = k
        where[:, box[0], box[1]] = np.array([votes[k], 50.0])[:, None, None]
        against[box] = -4.0 if columns[k] else 4.0
    return described(number, where, against, Relief(inverse_depth_per_m=inverse, f_px=F_PX)), gaps(number, 2)


def together(parts: list[Part], apart_px: np.ndarray) -> bool:
    one, other = joined(parts, apart_px, F_PX)
    return bool(one == other)


WALL = np.broadcast_to(0.20 + 0.0004 * COLUMNS, (H, W)).astype(np.float32)
BEHIND = WALL * np.where(COLUMNS > 55, 0.6, 1.0).astype(np.float32)


def test_what_runs_on_in_one_plane_is_one_thing_though_its_votes_scatter() -> None:
    assert together(*parts_of(WALL, votes=(58.0, 62.0)))


def test_what_votes_elsewhere_on_another_plane_is_another_thing() -> None:
    assert not together(*parts_of(BEHIND, votes=(30.0, 85.0)))


def test_a_column_before_a_wall_isnt_joined_to_it_and_two_columns_apart_are_two() -> None:
    assert not together(*parts_of(BEHIND, votes=(45.0, 45.0), columns=(True, False)))
    assert not together(*parts_of(WALL, columns=(True, True)))


def test_parts_that_stereo_does_not_know_are_joined_by_their_votes() -> None:
    nothing = np.zeros((H, W), np.float32)
    assert together(*parts_of(nothing, votes=(60.0, 60.0)))
    assert not together(*parts_of(nothing, votes=(30.0, 85.0)))


def test_many_small_doubts_outweigh_one_sure_link() -> None:
    links = np.full((4, 4), -np.inf)
    for one, other, odds in ((0, 1, 5.0), (2, 3, 5.0), (1, 2, 1.0), (0, 2, -2.0), (0, 3, -2.0), (1, 3, 0.5)):
        links[one, other] = links[other, one] = odds
    np.testing.assert_array_equal(contracted(links), [0, 0, 1, 1])
    np.testing.assert_array_equal(contracted(np.full((1, 1), -np.inf)), [0])


def test_parts_are_connected_pixels_of_one_key_and_crumbs_go_with_the_nearest() -> None:
    key = np.full((30, 40), -1, np.int32)
    key[5:25, 5:15] = 7
    key[5:25, 15:30] = 3
    key[10:12, 20:22] = 7  # four pixels: a crumb
    key[28, 38] = 3  # alone, too far from anything
    number = numbered_parts(key)
    assert set(np.unique(number)) == {-1, 0, 1}
    assert number[11, 21] == number[11, 25]
    assert number[28, 38] == -1
    assert gaps(number, 2)[0, 1] == pytest.approx(1.0, abs=0.1)
    assert (numbered_parts(np.full((8, 8), -1, np.int32)) == -1).all()
