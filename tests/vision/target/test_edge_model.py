"""Edges between colours in a JPEG: they are where they were drawn, before black, grey and white."""

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.vision.target.edge_model import colour_planes, likely_blur, place_edges, profiles_across
from asbuilt_bim.vision.target.ellipse import Ellipse

RED = np.array([0.01, 0.01, 0.14])  # linear BGR of red paint in shade
SIZE, FINE, REACH_PX = 96, 4, 6.0


def jpeg(grey: float, blur_px: float, at_px: float, slope: float) -> ByteImage:
    """Return a JPEG of a red half plane, left of a slanted edge, before an even grey."""
    fine = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    return shown((fine[None] + slope * (fine[:, None] - 48.0) < at_px).astype(np.float64), grey, blur_px)


def shown(red: FloatArray, grey: float, blur_px: float) -> ByteImage:
    """Return a JPEG of what is `red` (0 or 1, on the fine raster) before an even grey."""
    share = red.reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))[..., None]
    light = cv2.GaussianBlur(share * RED + (1.0 - share) * grey, None, blur_px)
    done = (255.0 * light ** (1 / 2.2)).astype(np.uint8)
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", done, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_COLOR))


def along(at_px: float, slope: float) -> tuple[FloatArray, FloatArray]:
    """Return points of the edge and its outward directions."""
    y = np.arange(24.0, 72.0, 1.2)
    outward = np.array([1.0, slope]) / np.hypot(1.0, slope)
    return np.stack([at_px - slope * (y - 48.0), y], axis=-1), np.tile(outward, (len(y), 1))


@pytest.mark.parametrize("blur_px", [0.6, 1.2])
@pytest.mark.parametrize("grey", [0.005, 0.1, 0.9])
def test_an_edge_lies_where_it_was_drawn_before_black_grey_and_white(grey: float, blur_px: float) -> None:
    misses = []
    for at_px, slope in ((44.3, 0.3), (47.6, -0.4), (50.1, 0.1)):
        points, outward = along(at_px, slope)
        # the search starts beside the edge, as it does in a photo
        start = points + 0.5 * outward
        planes = colour_planes(jpeg(grey, blur_px, at_px, slope))
        blur = likely_blur([profiles_across(planes, start, outward, REACH_PX)])
        placed = place_edges(planes, start, outward, REACH_PX, blur)
        misses.append(np.nanmean(np.sum((placed.points - points) * outward, axis=1)))
    assert abs(np.mean(misses)) < 0.1


def test_blur_does_not_move_a_bent_edge_inwards() -> None:
    disc = Ellipse(x_px=47.3, y_px=48.6, major_px=26.0, minor_px=11.0, angle_rad=0.4)
    fine = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    grid = np.stack(np.meshgrid(fine, fine), axis=-1).reshape(-1, 2)
    red = (disc.distance_px(grid) < 0.0).astype(np.float64).reshape(SIZE * FINE, SIZE * FINE)
    planes = colour_planes(shown(red, 0.1, 2.0))
    points, outward = disc.outline(80)
    at_ends = disc.bend(80) > 0.1
    miss = [
        np.nanmean(disc.distance_px(place_edges(planes, points, outward, REACH_PX, 2.0, bend).points)[at_ends])
        for bend in (0.0, disc.bend(80))
    ]
    assert at_ends.sum() > 5 and miss[0] < -0.2 and abs(miss[1]) < 0.15


def test_an_edge_is_not_found_where_it_is_looked_for() -> None:
    planes = colour_planes(jpeg(0.1, 2.0, 46.2, 0.2))
    points, outward = along(46.2, 0.2)
    found = [
        float(np.nanmedian(np.sum((placed.points - points) * outward, axis=1)))
        for aside in (-0.6, 0.6)
        for placed in [place_edges(planes, points + aside * outward, outward, 3.5, 2.0)]
    ]
    assert found[1] - found[0] < 0.5 * 1.2


def test_profiles_of_one_colour_say_nothing_of_how_well_edges_fit() -> None:
    planes = colour_planes(jpeg(0.3, 0.8, 46.2, 0.2))
    points, outward = along(46.2, 0.2)
    flat = np.array([[80.0, y] for y in np.linspace(20.0, 70.0, 3 * len(points))])
    alone = place_edges(planes, points, outward, REACH_PX, 0.8)
    among = place_edges(planes, np.r_[points, flat], np.r_[outward, np.tile(outward[0], (len(flat), 1))], REACH_PX, 0.8)
    assert np.median(among.sigma_px[: len(points)]) < 1.5 * np.median(alone.sigma_px)


def test_a_profile_that_something_behind_runs_across_is_trusted_less() -> None:
    points, outward = along(46.2, 0.2)
    photo = jpeg(0.3, 0.8, 46.2, 0.2)
    photo[60:, 46:] = 0
    placed = place_edges(colour_planes(photo), points, outward, REACH_PX, 0.85)
    beside = points[:, 1] > 62
    assert np.median(placed.sigma_px[beside]) > 3.0 * np.median(placed.sigma_px[points[:, 1] < 56])
