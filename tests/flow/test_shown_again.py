"""The same photo under two names is found by what it shows, and only the later station is refused."""

from __future__ import annotations

from datetime import date

import cv2
import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.flow.shown_again import Shown, shown, shown_before, stations_shown_before
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.report.wording.reasons import words_of
from tests.site_fixture import contents, site

FIRST, SECOND = date(2026, 3, 2), date(2026, 3, 16)


def photo(visit: int = 0, station: int = 0) -> ByteImage:
    picture = cv2.imread(str(site() / contents()["visits"][visit]["stations"][station]["left"]))
    assert picture is not None
    return np.asarray(picture, dtype=np.uint8)


def jpeg(picture: ByteImage, quality: int = 85) -> bytes:
    return bytes(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1])


def seen(picture: ByteImage, quality: int = 85) -> Shown:
    found = shown(FIRST, "A1", jpeg(picture, quality))
    assert found is not None
    return found


@pytest.mark.parametrize("quality", [95, 75, 30])
def test_a_photo_that_was_saved_again_is_the_same(quality: int) -> None:
    own = seen(photo())
    assert shown_before(seen(photo(), quality), [own]) is own


def test_a_photo_that_was_made_brighter_or_smaller_is_the_same() -> None:
    own = seen(photo())
    brighter = np.clip(255.0 * (photo() / 255.0) ** 0.8, 0, 255).astype(np.uint8)
    height, width = photo().shape[:2]
    smaller = cv2.resize(photo(), (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    again = np.asarray(cv2.resize(smaller, (width, height)), dtype=np.uint8)
    assert shown_before(seen(brighter, 75), [own]) is own
    assert shown_before(seen(again, 75), [own]) is own


def test_no_other_photo_of_the_site_is_the_same() -> None:
    photos = [seen(photo(visit, station)) for visit in (0, 1) for station in range(5)]
    for index, one in enumerate(photos):
        assert shown_before(one, photos[:index]) is None


def test_a_camera_that_has_moved_by_a_pixel_took_another_photo() -> None:
    moved = np.asarray(np.roll(photo(), 1, axis=1), dtype=np.uint8)
    assert shown_before(seen(moved), [seen(photo())]) is None


def test_the_same_view_with_a_column_more_is_another_photo() -> None:
    built = photo().copy()
    built[400:480, 600:630] = 150
    assert shown_before(seen(built), [seen(photo())]) is None


def test_the_later_station_alone_is_refused_and_the_rightful_one_kept() -> None:
    first = stations_shown_before(FIRST, {"G1": jpeg(photo()), "G2": jpeg(photo(0, 1))}, ())
    assert first.refused == {} and len(first.known) == 2
    again = {"G1": jpeg(photo(1, 0)), "G9": jpeg(photo(), 60)}
    second = stations_shown_before(SECOND, again, first.known).refused
    assert set(second) == {"G9"} and second["G9"].code is Reason.PHOTOS_SAVED_AGAIN
    assert "station G1 of visit 2026-03-02" in str(words_of(second["G9"]))


def test_a_pair_copied_to_a_second_station_of_a_visit_counts_at_the_first() -> None:
    refused = stations_shown_before(FIRST, {"A1": jpeg(photo()), "A2": jpeg(photo(), 70)}, ()).refused
    assert set(refused) == {"A2"} and "of visit" not in str(words_of(refused["A2"]))


def test_a_picture_that_shows_nothing_is_no_ones_twin() -> None:
    grey = np.full((48, 64, 3), 128, dtype=np.uint8)
    found = stations_shown_before(FIRST, {"A1": jpeg(grey), "A2": jpeg(grey), "A3": b""}, ())
    assert found.refused == {} and found.known == ()


def test_of_two_stations_the_one_whose_photos_say_their_day_is_believed() -> None:
    copied = stations_shown_before(FIRST, {"U3": jpeg(photo(1), 60)}, ())
    own = stations_shown_before(SECOND, {"U3": jpeg(photo(1))}, copied.known, {"U3"})
    assert own.refused == {} and [(one.day, one.station) for one in own.known] == [(SECOND, "U3")]
    ((whose, why),) = own.borrowed.items()
    assert whose == (FIRST, "U3") and "station U3 of visit 2026-03-16" in str(words_of(why))
    said = stations_shown_before(FIRST, {"U3": jpeg(photo(1), 60)}, (), {"U3"})
    later = stations_shown_before(SECOND, {"U3": jpeg(photo(1))}, said.known, {"U3"})
    assert later.borrowed == {} and set(later.refused) == {"U3"}, "both say theirs: the first is believed"
    here = stations_shown_before(FIRST, {"A1": jpeg(photo(), 60), "A2": jpeg(photo())}, (), {"A2"})
    assert set(here.refused) == {"A1"} and here.borrowed == {}
