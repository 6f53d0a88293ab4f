"""What a face takes from the one that it meets: pixels that no depth was found in, and where a faint edge lies."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.measure.outline import fit as outline
from asbuilt_bim.measure.outline.contour import Side
from asbuilt_bim.measure.outline.edges import EdgeFit, Line
from asbuilt_bim.measure.outline.face_cost import bridged, chroma_of
from asbuilt_bim.measure.planes.crossing import Crossing

HEIGHT, WIDTH = 40, 100


def raster() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a face to the right of column 50, one that it meets to the left of 30, disparity off and colour."""
    own = np.zeros((HEIGHT, WIDTH), dtype=bool)
    other = np.zeros_like(own)
    own[:, 50:90], other[:, 10:30] = True, True
    off = np.where(own, 0.0, np.nan).astype(np.float32)
    return own, other, off, np.full((HEIGHT, WIDTH, 3), 120, dtype=np.uint8)


def test_dark_concrete_between_two_faces_that_meet_belongs_to_them() -> None:
    own, other, off, colour = raster()
    filled = bridged(own, other, other, off, colour, chroma_of(colour), gap_px=31)
    assert filled[:, 30:50].all()
    assert not filled[:, :30].any()


def test_what_lies_between_a_face_and_a_thing_that_it_does_not_meet_is_not_filled() -> None:
    own, other, off, colour = raster()
    filled = bridged(own, np.zeros_like(own), other, off, colour, chroma_of(colour), gap_px=31)
    assert not filled[:, 30:50].any()


def test_a_gap_that_is_measured_behind_the_faces_stays_open() -> None:
    own, other, off, colour = raster()
    off[:, 34:46] = -9.0
    assert not bridged(own, other, other, off, colour, chroma_of(colour), gap_px=31)[:, 34:46].any()


@pytest.mark.parametrize(("photos_px", "at_px", "sigma_px"), [(0.37, 50.5, 0.5), (0.12, 50.905, 0.293)])
def test_a_shared_edge_lies_between_what_the_photos_show_and_where_planes_meet_by_their_weights(
    monkeypatch: pytest.MonkeyPatch, photos_px: float, at_px: float, sigma_px: float
) -> None:
    crossing = Line(start=np.array([50.0, 90.0]), stop=np.array([50.0, 10.0]))
    photo = Line(start=np.array([51.0, 90.0]), stop=np.array([51.0, 10.0]))
    fit = EdgeFit(
        line=photo,
        sigma_px=photos_px,
        ambiguity_px=0.0,
        strength=0.25,
    )
    monkeypatch.setattr(outline, "_crossing", lambda *_: Crossing(line=crossing, sigma_px=0.37))
    monkeypatch.setattr(outline, "_neighbour", lambda *_: 2)
    monkeypatch.setattr(outline, "find_edge", lambda *_, **__: fit)
    monkeypatch.setattr(outline, "pixel_plane", lambda *_: np.zeros(3))
    side = Side(course="upright", line=crossing, points=np.array([[50.0, 90.0], [50.0, 10.0]]))
    around = type("A", (), {})()
    around.labels, around.frame = np.zeros((100, 100), np.int16), np.zeros((100, 100), bool)
    around.planes, around.camera, around.gradients, around.texture_grey = {1: np.zeros(3)}, None, None, 2.0
    edge = outline._settle(side, 1, around)
    assert edge is not None
    assert edge.line.start[0] == pytest.approx(at_px, abs=0.005)
    assert edge.sigma_px == pytest.approx(sigma_px, abs=0.005)


def test_where_planes_tell_an_edge_that_no_photo_shows_the_left_photo_alone_is_not_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = Line(start=np.array([50.0, 90.0]), stop=np.array([50.0, 10.0]))
    asked: list[bool] = []

    def find_edge(*_: object, alone: bool = False) -> None:
        asked.append(alone)

    monkeypatch.setattr(outline, "_crossing", lambda *_: Crossing(line=line, sigma_px=0.37))
    monkeypatch.setattr(outline, "_neighbour", lambda *_: 2)
    monkeypatch.setattr(outline, "find_edge", find_edge)
    monkeypatch.setattr(outline, "pixel_plane", lambda *_: np.zeros(3))
    around = type("A", (), {})()
    around.labels, around.frame = np.zeros((100, 100), np.int16), np.zeros((100, 100), bool)
    around.planes, around.camera, around.gradients, around.texture_grey = {1: np.zeros(3)}, None, None, 2.0
    side = Side(course="upright", line=line, points=np.array([[50.0, 90.0], [50.0, 10.0]]))
    edge = outline._settle(side, 1, around)
    assert edge is not None and (edge.source, edge.sigma_px) == ("planes", 0.37)
    assert asked == [False]
