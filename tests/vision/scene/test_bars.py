"""Bars told from concrete: a face, bars over it and a background, laid into a rectified pair by their disparities."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import level_view, levelled_map, pixel_rays
from asbuilt_bim.vision.scene.bars import without_bars
from asbuilt_bim.vision.scene.read import Scene

HEIGHT, WIDTH, F_PX, BASELINE_M = 240, 240, 500.0, 0.25
FACE_PX, BEHIND_PX = 25, 8  # disparities: the face 5 m away, 100 px to a metre, and what lies behind
LEFT, RIGHT, TOP, FOOT = 90, 140, 30, 220  # the mask, which runs up into bars
POUR = 110
BAR_PLACES = range(LEFT + 3, RIGHT - 2, 11)
CAMERA = RectifiedCamera(
    f_px=F_PX, cx_px=120.0, cy_px=120.0, baseline_m=BASELINE_M, width_px=WIDTH, height_px=HEIGHT,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip


def grain(seed: int, strength: float) -> FloatArray:
    noise = np.random.default_rng(seed).standard_normal((HEIGHT, WIDTH + 64))
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.5)
    return np.asarray(130.0 + strength * smooth / smooth.std(), dtype=np.float64)


def area(rows: tuple[int, int], columns: tuple[int, int]) -> BoolArray:
    inside = np.zeros((HEIGHT, WIDTH), dtype=bool)
    inside[slice(*rows), slice(*columns)] = True
    return inside


def uprights(rows: tuple[int, int]) -> BoolArray:
    inside = np.zeros((HEIGHT, WIDTH), dtype=bool)
    for column in BAR_PLACES:
        inside[slice(*rows), column : column + 2] = True
    return inside


def pair_of(layers: list[tuple[BoolArray, FloatArray, int]]) -> RectifiedPair:
    """Lay (where in the left photo, texture, disparity) over each other, the first ones behind, into both photos."""
    noise = np.random.default_rng(5)
    views = []
    for right in (False, True):
        picture = np.zeros((HEIGHT, WIDTH))
        for where, texture, disparity in layers:
            shift = disparity if right else 0
            picture = np.where(np.roll(where, -shift, axis=1), np.roll(texture, -shift, axis=1)[:, :WIDTH], picture)
        dirty = np.clip(picture + noise.normal(0.0, 1.5, picture.shape), 0, 255).astype(np.uint8)
        views.append(np.repeat(dirty[..., None], 3, axis=2))
    valid = np.ones((HEIGHT, WIDTH), dtype=bool)
    return RectifiedPair(name="S", left=views[0], right=views[1], valid_left=valid, valid_right=valid, camera=CAMERA)


def scene_of(face: BoolArray) -> Scene:
    """Return what depth makes of it: one face, all of its mask at one depth."""
    rays = pixel_rays(WIDTH, HEIGHT, F_PX, CAMERA.cx_px, CAMERA.cy_px)
    disparity = np.where(face, float(FACE_PX), float(BEHIND_PX))
    sigma = np.full((HEIGHT, WIDTH), 0.2)
    level = levelled_map(disparity, sigma, level_view([0.0, -1.0, 0.0], F_PX), rays, BASELINE_M)
    pieces = tuple(
        Piece(x0_px=x0, x1_px=x1, slope=0.0, offset_px=d, circle=None, chain=chain)
        for chain, (x0, x1, d) in enumerate(((LEFT - 120.0, RIGHT - 120.0, FACE_PX), (-120.0, 120.0, BEHIND_PX)))
    )
    labels = np.where(face, 0, 1).astype(np.int16)
    return Scene(vertical=None, level=level, pieces=pieces, floors=(), labels=labels, sizes=np.bincount(labels.ravel()))


EVERYWHERE = np.ones((HEIGHT, WIDTH), dtype=bool)
NO_MARKS = ~EVERYWHERE
MASK = area((TOP, FOOT), (LEFT, RIGHT))
BEHIND = (EVERYWHERE, grain(1, 25.0), BEHIND_PX)
STEEL = grain(3, 4.0) - 90.0


def without(layers: list[tuple[BoolArray, FloatArray, int]]) -> tuple[BoolArray, BoolArray]:
    """Return what is left of the face, and what was called bars of its mask."""
    scene = without_bars(scene_of(MASK), pair_of(layers), NO_MARKS)
    return scene.mask(0), np.asarray(MASK & (scene.labels == scene.bars_label))


def test_a_face_ends_at_its_pour_line_though_depth_runs_up_into_the_bars() -> None:
    concrete = (area((POUR, FOOT), (LEFT, RIGHT)), grain(2, 8.0), FACE_PX)
    face, bars = without([BEHIND, concrete, (uprights((TOP, POUR)), STEEL, FACE_PX)])
    assert abs(np.flatnonzero(face.any(axis=1)).min() - POUR) <= 3
    assert face[POUR + 3 : FOOT, LEFT:RIGHT].all()
    assert bars[TOP : POUR - 10, LEFT:RIGHT].all()


def test_of_a_cage_alone_nothing_is_left() -> None:
    face, bars = without([BEHIND, (uprights((TOP, FOOT)), STEEL, FACE_PX)])
    assert not face.any()
    assert np.mean(bars[MASK]) > 0.95


@pytest.mark.parametrize("marks", ["none", "boards' grooves", "a joint and a stain"])
def test_concrete_is_no_bars_whatever_marks_it(marks: str) -> None:
    texture = grain(2, 8.0)
    if marks == "boards' grooves":
        texture[:, :WIDTH][uprights((TOP, FOOT))] -= 70.0
    elif marks == "a joint and a stain":
        texture[:, (LEFT + RIGHT) // 2] -= 80.0
        texture[TOP : TOP + 40, LEFT : LEFT + 20] -= 50.0
    face, _ = without([BEHIND, (MASK, texture, FACE_PX)])
    assert np.array_equal(face, MASK)


def test_a_reflection_in_wet_concrete_is_no_bars_though_the_photos_disagree_on_it() -> None:
    mirrored = (area((TOP, POUR), (LEFT, RIGHT)), grain(4, 25.0), BEHIND_PX)
    face, _ = without([BEHIND, (MASK, grain(2, 8.0), FACE_PX), mirrored])
    assert np.array_equal(face, MASK)


@pytest.mark.parametrize("line", [TOP, TOP + 30])
def test_bars_that_stand_before_the_foot_of_a_face_do_not_take_the_concrete_behind_them_away(line: int) -> None:
    concrete = (area((line, FOOT), (LEFT, RIGHT)), grain(2, 8.0), FACE_PX)
    own, before = (uprights((TOP, line)), STEEL, FACE_PX), (uprights((line + 30, FOOT)), STEEL, FACE_PX + 6)
    face, _ = without([BEHIND, concrete, own, before])
    assert face[line + 3 : FOOT, LEFT:RIGHT].all()


def test_print_on_a_board_does_not_speak() -> None:
    layers = [BEHIND, (uprights((TOP, FOOT)), STEEL, FACE_PX)]
    scene = without_bars(scene_of(MASK), pair_of(layers), MASK)
    assert np.array_equal(scene.mask(0), MASK)
