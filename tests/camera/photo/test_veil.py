"""A part of one lens that is veiled: named by what both photos show of the same things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.photo.overlap import match_pair
from asbuilt_bim.camera.photo.veil import veil_faults
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import PHOTO_FAULTS, Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.measure.station import RejectedStation, measure_station
from asbuilt_bim.report.wording.reasons import words_of
from tests.measure.box_world import site
from tests.measure.test_faces import rig_of
from tests.measure.test_station import FREE, StationPhotos, photo


def faults(pair: RectifiedPair) -> list[Rejection]:
    return list(veil_faults(pair, match_pair(pair)))


def veiled(image: ByteImage, share: float = 0.5) -> ByteImage:
    """Lay light over the left part of a photo, as a film of water does."""
    spoilt = image.copy()
    width = int(image.shape[1] * share)
    spoilt[:, :width] = (0.4 * image[:, :width] + 110.0).astype(np.uint8)
    return spoilt


def test_nothing_is_said_of_clean_lenses() -> None:
    assert faults(site()[1]) == []


def test_a_photo_that_was_exposed_for_half_as_long_is_not_veiled() -> None:
    pair = site()[1]
    assert faults(replace(pair, left=(pair.left * 0.6).astype(np.uint8))) == []


def test_a_veil_over_part_of_either_lens_is_named_with_its_side_and_what_to_do() -> None:
    pair = site()[1]
    for spoilt, side in (
        (replace(pair, left=veiled(pair.left)), "left"),
        (replace(pair, right=veiled(pair.right)), "right"),
    ):
        (fault,) = faults(spoilt)
        assert fault.code is Reason.PHOTO_VEILED and fault.code in PHOTO_FAULTS
        assert fault.values["side"] == side and float(str(fault.values["contrast"])) < 0.6
        assert f"wipe the {side} lens" in words_of(fault).remedy


def test_where_no_feature_is_matched_nothing_is_said() -> None:
    pair = site()[1]
    assert faults(replace(pair, right=np.full_like(pair.right, 90))) == []


def test_a_station_with_a_veiled_lens_says_so() -> None:
    pair = site()[1]
    photos = StationPhotos(name="S1", left=photo("l.png", veiled(pair.left)), right=photo("r.png", pair.right))
    found = measure_station(photos, rig_of(pair), FREE)
    reasons = found.rejections
    assert reasons[0].code is Reason.PHOTO_VEILED, [one.code for one in reasons]
    assert isinstance(found, RejectedStation) or found.faces
