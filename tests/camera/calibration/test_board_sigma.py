"""The covariance of a calibration as real boards are: corners that err together, boards that bend, prints off scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust
from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, PLACES, area_slopes
from asbuilt_bim.camera.calibration.board_sigma import BoardSigma, board_sigma, rig_covariance
from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.calibrate import rig_of_adjustment
from asbuilt_bim.camera.calibration.parameters import BoardView, layout_of, pack
from asbuilt_bim.camera.calibration.photo_advice import photo_advice
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from tests.camera.virtual import SIZE, rig, views

TRUE = rig()
BOARD = Board(kind="chessboard", columns=9, rows=6, square_m=0.08, flatness_m=0.0, print_share=0.0)
SHARED = pack(TRUE.left, TRUE.right, TRUE.right_from_left)
ROWS = layout_of(SHARED).rig_rows


def shaken(seen: list[BoardView], shift_px: float, slope_px: float, seed: int) -> list[BoardView]:
    """Move each right photo's corners by a shift and by slopes of its own."""
    rng = np.random.default_rng(seed)
    moved = []
    for view in seen:
        away = view.right_points_m[:, :2] - view.right_points_m[:, :2].mean(axis=0)
        slopes = away / away.std(axis=0)
        off = rng.normal(0.0, shift_px, 2) + slopes @ rng.normal(0.0, slope_px, (2, 2))
        moved.append(replace(view, right_px=frozen(view.right_px + off)))
    return moved


def adjusted(seen: list[BoardView], poses: FloatArray, board: Board = BOARD) -> tuple[Adjustment, BoardSigma]:
    done = adjust(SHARED, poses, seen)
    return done, board_sigma(done, seen, board)


def area_sigmas(covariance: FloatArray) -> FloatArray:
    slopes = area_slopes(replace(TRUE, covariance=frozen(covariance)), PLACES, DISTANCE_M)
    return np.sqrt(np.einsum("ni,ij,nj->n", slopes, covariance, slopes))


def test_corners_that_err_each_by_itself_have_no_trend_and_the_covariance_of_the_adjustment() -> None:
    seen, poses = views(TRUE, 20, 0.1, seed=4)
    done, sigma = adjusted(seen, poses)
    assert np.all(np.abs(np.sqrt(sigma.errors.single) - 0.1) < 0.03)
    assert np.all(np.sqrt(sigma.errors.trend) < 0.03)
    ratio = area_sigmas(sigma.covariance) / area_sigmas(rig_covariance(done))
    assert np.all((ratio > 0.8) & (ratio < 1.4))


def test_what_a_photo_s_corners_share_is_found_by_its_degree() -> None:
    found = []
    for seed in range(6):
        seen, poses = views(TRUE, 20, 0.05, seed=seed)
        found.append(adjusted(shaken(seen, 0.15, 0.06, seed), poses)[1].errors.trend)
    shift, slope, bend = np.sqrt(np.mean(found, axis=0).reshape(2, 3).sum(axis=0))
    # a shift of one photo can't be told from the opposite one of the other: both together hold it
    assert shift == pytest.approx(0.15, rel=0.35) and slope == pytest.approx(0.06, rel=0.35) and bend < 0.02


def test_areas_over_the_frame_err_as_the_sigma_of_shaken_boards_says_and_not_as_that_of_single_corners() -> None:
    """Six sigmas of a mean square of 12 calibrations, whose nine places go together."""
    pulls, naive = [], []
    for seed in range(12):
        seen, poses = views(TRUE, 14, 0.05, seed=seed)
        done, sigma = adjusted(shaken(seen, 0.1, 0.04, 100 + seed), poses)
        error = area_slopes(replace(TRUE, covariance=sigma.covariance), PLACES, DISTANCE_M) @ (
            done.shared[ROWS] - SHARED[ROWS]
        )
        pulls.append(error / area_sigmas(sigma.covariance))
        naive.append(error / area_sigmas(rig_covariance(done)))
    assert 0.3 < np.mean(np.square(pulls)) < 2.2
    assert np.mean(np.square(naive)) > 2.5


def test_a_print_off_scale_is_a_baseline_off_scale_and_twice_that_of_an_area() -> None:
    seen, poses = views(TRUE, 14, 0.05, seed=1)
    _, sigma = adjusted(seen, poses, replace(BOARD, print_share=0.002))
    _, _, flat, printed = sigma.by_source
    assert not flat.any()
    scale = np.sqrt(printed[11, 11]) / TRUE.baseline_m  # and what a stretch one way does
    assert 0.002 * 0.99 < scale < 0.002 * 1.3
    assert 0.004 * 0.99 < np.median(area_sigmas(printed)) < 0.004 * 1.4


def test_a_bent_board_moves_the_rig_as_its_source_says() -> None:
    """The corners of a board that is bent by 0.3 mm, against one sigma of such a flatness."""
    seen, poses = views(TRUE, 14, 0.0, seed=2)
    bent = []
    flat = BOARD.points_m[:, :2]
    middle, half = 0.5 * (flat.min(axis=0) + flat.max(axis=0)), 0.5 * np.ptp(flat, axis=0)
    for view in seen:
        u = (view.left_points_m[:, 0] - middle[0]) / half[0]
        out = np.c_[np.zeros((len(u), 2)), 0.0003 * u * u]
        bent.append(replace(view, left_points_m=view.left_points_m + out, right_points_m=view.right_points_m + out))
    done = adjust(SHARED, poses, bent)  # the true board is flat: taken for bent, it errs the other way
    _, sigma = adjusted(seen, poses, replace(BOARD, flatness_m=0.0003))
    moved = done.shared[ROWS] - SHARED[ROWS]
    slopes = area_slopes(replace(TRUE, covariance=sigma.covariance), PLACES, DISTANCE_M)
    assert np.all(np.abs(slopes @ moved) < 1.2 * area_sigmas(sigma.by_source[2]) + 1e-5)
    assert np.abs(slopes @ moved).max() > 0.0003


def test_what_a_bent_board_does_to_every_photo_is_not_an_error_of_each_photo_too() -> None:
    """Boards bent at random by what their flatness says: their bends were counted twice."""
    told, untold = [], []
    flat = BOARD.points_m[:, :2]
    middle, half = 0.5 * (flat.min(axis=0) + flat.max(axis=0)), 0.5 * np.ptp(flat, axis=0)
    for seed in range(6):
        seen, poses = views(TRUE, 12, 0.03, seed=seed)
        bow_m = np.random.default_rng(seed).normal(0.0, 0.0015, 3)
        bent = []
        for view in seen:
            u, v = ((view.left_points_m[:, :2] - middle) / half).T
            out = np.c_[np.zeros((len(u), 2)), np.stack([u * u, u * v, v * v], axis=1) @ bow_m]
            bent.append(replace(view, left_points_m=view.left_points_m + out, right_points_m=view.right_points_m + out))
        done = adjust(SHARED, poses, bent)
        told.append(board_sigma(done, bent, replace(BOARD, flatness_m=0.0015)).errors.trend.sum())
        untold.append(board_sigma(done, bent, BOARD).errors.trend.sum())
    assert np.mean(told) < 0.5 * np.mean(untold)


def test_the_photos_that_are_advised_bring_the_worst_place_to_what_is_promised_or_less() -> None:
    seen, poses = views(TRUE, 8, 0.1, seed=3)
    done, sigma = adjusted(seen, poses)
    found = rig_of_adjustment(done, SIZE, sigma.covariance, len(seen))
    advice = photo_advice(done.shared, found, BOARD, sigma, (1.2, 1.8))
    worst = area_sigmas(sigma.covariance).max()
    assert 1 <= len(advice) <= 3
    assert [one.worst for one in advice] == sorted((one.worst for one in advice), reverse=True)
    assert advice[0].worst < 0.97 * worst
