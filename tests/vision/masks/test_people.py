from __future__ import annotations

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage
from asbuilt_bim.vision.masks.people import CELLS, pixelated, without_people


def picture() -> ByteImage:
    return np.random.default_rng(5).integers(0, 255, (240, 320, 3), dtype=np.uint8)


def figure() -> BoolArray:
    mask = np.zeros((240, 320), dtype=bool)
    mask[60:204, 100:148] = True
    return mask


def test_a_figure_is_twelve_cells_high_and_all_else_stays_to_the_pixel() -> None:
    before, people = picture(), figure()
    after = pixelated(before, people)
    rows = after[66:198, 120].astype(int)
    assert 8 <= np.count_nonzero(np.abs(np.diff(rows, axis=0)).sum(axis=1)) <= CELLS + 2
    assert np.abs(after[people].astype(int) - before[people]).mean() > 40.0
    away = np.ones_like(people)
    away[50:214, 90:158] = False
    assert np.array_equal(after[away], before[away])


def test_a_segmenter_that_looks_for_nobody_leaves_the_picture_and_one_that_does_is_asked() -> None:
    class Finder:
        name = "finder"

        def __init__(self, people: BoolArray | None) -> None:
            self.found = people

        def people(self, image: ByteImage) -> BoolArray | None:
            return self.found

    before = picture()
    for nobody in (None, object(), Finder(None), Finder(np.zeros((240, 320), dtype=bool))):
        assert without_people(before, nobody) is before  # type: ignore[arg-type]
    assert np.array_equal(without_people(before, Finder(figure())), pixelated(before, figure()))  # type: ignore[arg-type]
