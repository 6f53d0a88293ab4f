"""Where a round column ends: at its concrete, not at the bars that stand out of it."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.measure.round import solid_heights

WIDTH = 30


def pixels(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.nonzero(mask)
    return rows.astype(np.float64), columns


def column_with_bars(top: int, foot: int, bars: tuple[int, ...], hoops: tuple[int, ...]) -> np.ndarray:
    mask = np.zeros((foot + 20, WIDTH), dtype=bool)
    mask[top:foot] = True
    for bar in bars:
        mask[5:top, bar : bar + 2] = True
    for hoop in hoops:
        mask[hoop : hoop + 2] = True
    return mask


@pytest.mark.parametrize("top", range(80, 88))
def test_starter_bars_and_hoops_over_a_column_are_not_its_height(top: int) -> None:
    rows, columns = pixels(column_with_bars(top, 300, bars=(3, 9, 17, 25), hoops=(20, 45, 70)))
    solid = solid_heights(rows, float(WIDTH))
    tops = [rows[solid & (columns == c)].min() for c in range(WIDTH)]
    assert np.median(tops) == top
    assert rows[solid].max() == 299


def test_a_thing_before_a_column_takes_nothing_off_its_height() -> None:
    mask = column_with_bars(40, 300, bars=(), hoops=())
    mask[120:180] = False
    rows, _ = pixels(mask)
    solid = solid_heights(rows, float(WIDTH))
    assert solid.all()


def test_a_column_half_hidden_over_its_whole_height_keeps_it_and_loses_its_bars() -> None:
    mask = column_with_bars(80, 300, bars=(3, 9), hoops=(20, 45))
    mask[:, 12:] = False
    rows, columns = pixels(mask)
    solid = solid_heights(rows, float(WIDTH))
    assert np.median([rows[solid & (columns == c)].min() for c in range(12)]) == 80


def test_a_mask_of_a_few_rows_is_taken_as_it_is() -> None:
    rows, _ = pixels(column_with_bars(10, 18, bars=(), hoops=()))
    assert solid_heights(rows, float(WIDTH)).all()
