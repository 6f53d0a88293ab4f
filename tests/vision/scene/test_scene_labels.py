"""Which pixel belongs to which surface, where two explain it."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.vision.scene.read import _tidy


def test_a_strip_that_a_floors_plane_explains_as_well_does_not_cut_a_column() -> None:
    labels = np.full((120, 60), -1, dtype=np.int16)
    labels[10:110, 20:40] = 0
    labels[70:72, :] = 1  # the floor, where its plane runs through the column's
    tidy = _tidy(labels, 1, 150)
    assert np.all(tidy[12:108, 22:38] == 0)
    assert np.all(tidy[70:72, :18] == 1)  # beside the column it is floor


def test_a_floor_before_a_column_stays_a_floor() -> None:
    labels = np.full((120, 60), -1, dtype=np.int16)
    labels[10:80, 20:40] = 0
    labels[80:120, :] = 1
    assert np.all(_tidy(labels, 1, 150)[82:, :] == 1)
