"""Outlines of people that somebody drew: read with care, and blurred in the picture of their station and day."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest

from asbuilt_bim.errors import MaskError
from asbuilt_bim.project.tables.outlines import Outline, read_outlines, without_outlined
from tests.camera.virtual import rig
from tests.project.test_places import project
from tests.register.linked_scene import stations

DAY = date(2026, 3, 2)
MARKERS = "poses: {file: poses.csv}\n"


def outlines(folder: Path, rows: str) -> tuple[Outline, ...]:
    (folder / "people.csv").write_text("date,station,outline,x_px,y_px\n" + rows, encoding="utf-8")
    return read_outlines(project(folder, MARKERS + "people: people.csv\n"), (1280, 960))


def test_an_outline_is_the_points_of_one_name_at_one_station(tmp_path: Path) -> None:
    one, two = outlines(tmp_path, "2026-03-02,A1,p,1,2\n2026-03-02,A1,p,3,2\n2026-03-02,A1,p,3,9\n"
                        ",A1,q,1,1\n,A1,q,5,1\n,A1,q,5,5\n")  # fmt: skip
    assert (one.day, one.station, two.day) == (DAY, "A1", None)
    np.testing.assert_allclose(one.photo_px, [[1.0, 2.0], [3.0, 2.0], [3.0, 9.0]])


def test_wrong_rows_and_outlines_of_two_points_are_named(tmp_path: Path) -> None:
    with pytest.raises(MaskError) as caught:
        outlines(tmp_path, ",B9,p,1,2\n,A1,p,x,2\n,A1,q,1,2\n,A1,q,3,2\n")
    for part in ("there is no station 'B9'", "'x' is no number", "outline 'q' of 'A1' has 2 points"):
        assert part in str(caught.value)


def test_an_outline_beside_the_photo_is_refused_since_it_would_hide_nobody(tmp_path: Path) -> None:
    """Drawn on a larger picture, as a photo before it was scaled down."""
    with pytest.raises(MaskError, match=r"outline 'q' of 'A1' lies beside its photo of 1280 x 960 px"):
        outlines(tmp_path, ",A1,p,1270,2\n,A1,p,1400,2\n,A1,p,1300,90\n,A1,q,1300,1\n,A1,q,1500,1\n,A1,q,1400,5\n")


def test_what_an_outline_holds_is_coarse_in_its_own_days_picture_and_nothing_else_is() -> None:
    seen = stations()[1]
    noise = np.random.default_rng(3).integers(0, 256, (seen.camera.height_px, seen.camera.width_px, 3), dtype=np.uint8)
    jpeg = cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes()
    ring = np.array([[500.0, 300.0], [700.0, 300.0], [700.0, 700.0], [500.0, 700.0]])
    given = Outline(day=DAY, station=seen.station, photo_px=ring)
    pictures = {seen.station: jpeg, "other": jpeg}
    shown = without_outlined(pictures, [given], DAY, rig(), [seen])
    picture = cv2.imdecode(np.frombuffer(shown[seen.station], np.uint8), cv2.IMREAD_COLOR).astype(float)
    x, y = np.round(seen.camera.project(rig().left.rays(np.array([[600.0, 500.0]])))[0]).astype(int)
    assert np.abs(np.diff(picture[y - 60 : y + 60, x - 50 : x + 50], axis=1)).mean() < 8.0
    assert np.abs(np.diff(picture[20:120, 20:120], axis=1)).mean() > 40.0
    assert shown["other"] == jpeg
    assert without_outlined(pictures, [given], date(2027, 1, 1), rig(), [seen]) == pictures
    assert without_outlined(pictures, [given], DAY, rig(), []) == {"other": jpeg}  # no camera known: it stays here
    assert without_outlined(pictures, [replace(given, day=None)], DAY, rig(), [seen]) == shown
