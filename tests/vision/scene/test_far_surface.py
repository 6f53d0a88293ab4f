"""A surface beyond what the rig measures is named with its distance and the limit; sky and near surfaces aren't."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.grow import GrowOptions
from asbuilt_bim.geometry.level import LevelledMap
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.scene.far_surface import far_surface
from asbuilt_bim.vision.scene.read import Scene
from tests.geometry.test_grow import B, F, H, W, facade

CLEAR = np.zeros((H, W), dtype=bool)


def scene(level: LevelledMap) -> Scene:
    labels = np.full((H, W), -1, dtype=np.int16)
    return Scene(vertical=None, level=level, pieces=(), floors=(), labels=labels, sizes=np.zeros(0, dtype=np.int64))


def test_a_facade_beyond_the_reach_is_named_with_its_distance_and_the_limit() -> None:
    options = GrowOptions()
    (one,) = far_surface(scene(facade(1.5)), CLEAR, options, "A3")
    assert one.code is Reason.SURFACE_TOO_FAR and one.subject.station == "A3"
    assert one.values["distance_m"] == pytest.approx(F * B / 1.5, rel=0.03)
    assert one.values["limit_m"] == pytest.approx(F * B / options.least_disparity_px)
    x0, y0, x1, y1 = one.values["box_px"]  # type: ignore[misc]
    assert x1 - x0 > 600 and y1 - y0 > 150  # type: ignore[operator]
    assert "a surface at about 83 m is beyond what this rig measures (limit 65 m)" in str(words_of(one))


def test_what_is_within_reach_is_sky_or_is_endlessly_far_is_not_named() -> None:
    options = GrowOptions()
    assert far_surface(scene(facade(4.0)), CLEAR, options, "A3") == ()
    assert far_surface(scene(facade(1.5)), ~CLEAR, options, "A3") == ()
    assert far_surface(scene(facade(0.05)), CLEAR, options, "A3") == ()
