"""Does sigma hold? What the images leave open, what the calibration does, and both, against the errors made.

python benchmarks/faces/sigma.py --check --json figures.json     64 pairs, 120 virtual calibrations, 24 rigs
python benchmarks/faces/sigma.py --faces rows.json               the image part from what faces.py --rows wrote
python benchmarks/faces/sigma.py --quick                         the calibration part alone, on fewer rigs, not judged
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_synthetic.boards import Board, board_poses
from asbuilt_synthetic.lens import in_frame
from asbuilt_synthetic.model import CameraTruth, RigTruth
from asbuilt_synthetic.rig import rig_truth

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, pack, right_from_left_of
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, vector_from_rotation
from asbuilt_bim.measure.sigma.area import calibration_sigmas_m2, polygon_area
from benchmarks.faces.faces import collect, face_rows, ours
from benchmarks.faces.twins import RAYCAST_SEEDS, cycles_seeds, load_twin, read_twin, true_rig, twin_folder
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

CORNER_SIGMA_PX = 0.1  # what a printed corner is found to
CALIBRATIONS = 120
BOARDS = 20
RIGS = 24


def virtual_calibration(rig: StereoRig, seed: int) -> StereoRig:
    """Calibrate a rig from the corners of boards held before it, each corner with its own noise; nothing rendered."""
    rng = np.random.default_rng([seed, 71])
    board = Board()
    points = board.corners_m()
    truth = RigTruth(left=_truth(rig.left), right=_truth(rig.right), right_from_left=rig.right_from_left)
    views, poses = [], []
    for k, pose in enumerate(board_poses(truth, board, rng, BOARDS)):
        seen = []
        for camera, place in ((rig.left, pose), (rig.right, rig.right_from_left @ pose)):
            px = camera.project(apply(place, points))
            inside = in_frame(_truth(camera), px, 6.0)
            seen.append((points[inside], px[inside] + rng.normal(0.0, CORNER_SIGMA_PX, (int(inside.sum()), 2))))
        (left_m, left_px), (right_m, right_px) = seen
        views.append(
            BoardView(name=str(k), left_points_m=left_m, left_px=left_px, right_points_m=right_m, right_px=right_px)
        )
        poses.append(np.r_[vector_from_rotation(pose[:3, :3]), pose[:3, 3]])
    done = adjust(pack(rig.left, rig.right, rig.right_from_left), np.array(poses), views)
    size = (rig.left.width_px, rig.left.height_px)
    return replace(
        rig, left=camera_of(done.shared, 0, size), right=camera_of(done.shared, 1, size),
        right_from_left=right_from_left_of(done.shared), covariance=rig_covariance(done),
    )  # fmt: skip


def _truth(camera: Intrinsics) -> CameraTruth:
    return CameraTruth(K=camera.K, distortion=camera.distortion, width_px=camera.width_px, height_px=camera.height_px)


def calibration_pull(rig: StereoRig, calibrated: StereoRig, rng: np.random.Generator) -> tuple[float, float]:
    """Return error over sigma, and sigma over area, of a face drawn at random whose points are seen without noise."""
    corners = _face(rng)
    true_m2 = polygon_area(corners)
    rays = [
        calibrated.left.rays(rig.left.project(corners)),
        calibrated.right.rays(rig.right.project(apply(rig.right_from_left, corners)))
        @ calibrated.right_from_left[:3, :3],
    ]
    centre = -calibrated.right_from_left[:3, :3].T @ calibrated.right_from_left[:3, 3]
    points = np.array([_nearest(a, b, centre) for a, b in zip(*rays, strict=True)])
    camera = rectification(calibrated).camera
    ring = camera.project(points)
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2] @ camera.rectified_from_left.T
    middle = points.mean(axis=0) @ camera.rectified_from_left.T
    q = camera.f_px * camera.baseline_m * normal / float(normal @ middle)
    sigma = float(calibration_sigmas_m2([([ring], q)], calibrated, camera)[0])
    return (polygon_area(points) - true_m2) / sigma, sigma / true_m2


def _face(rng: np.random.Generator) -> FloatArray:
    """Draw an upright rectangle (4, 3) in the left frame, 3.5 to 8 m away, in view of both cameras."""
    width, height, distance = rng.uniform(0.3, 1.6), rng.uniform(1.5, 2.9), rng.uniform(3.8, 8.0)
    turn, aside = np.deg2rad(rng.uniform(-60.0, 60.0)), rng.uniform(-0.35, 0.4)
    along = np.array([np.cos(turn), 0.0, np.sin(turn)]) * width
    foot = distance * np.array([aside, 0.0, 1.0]) + [0.0, min(1.5, 0.38 * distance), 0.0] - 0.5 * along
    up = np.array([0.0, -min(height, 0.76 * distance), 0.0])
    return np.array([foot, foot + along, foot + along + up, foot + up])


def _nearest(a: FloatArray, b: FloatArray, centre: FloatArray) -> FloatArray:
    s, t = np.linalg.lstsq(np.stack([a, -b], axis=1), centre, rcond=None)[0]
    return np.asarray(0.5 * (a * s + b * t + centre))


def pull_lines(what: str, pulls: FloatArray, n: int, least_n: int) -> list[Line]:
    """Judge pulls: shares within one and two sigma, and chi-square per degree of freedom."""
    if not len(pulls):
        return [line(what, "none", "", 0, False)]
    one, two = float(np.mean(np.abs(pulls) <= 1.0)), float(np.mean(np.abs(pulls) <= 2.0))
    chi = float(np.mean(pulls**2))
    return [
        line(f"{what}: within one sigma", f"{one:.1%}", "60 to 76 %", n, 0.60 <= one <= 0.76, least_n),
        line("  within two sigma", f"{two:.1%}", ">= 92 %", n, two >= 0.92, least_n),
        line("  chi-square per degree of freedom", f"{chi:.2f}", "0.8 to 1.25", n, 0.8 <= chi <= 1.25, least_n),
        told("  largest error in sigmas", f"{np.abs(pulls).max():.1f}", n),
        told(
            "  chi-square without the largest hundredth",
            f"{np.mean(np.sort(pulls**2)[: -max(1, len(pulls) // 100)]):.2f}",
            n,
        ),
    ]


def image_pulls(rows: list[dict[str, Any]]) -> FloatArray:
    """Return the pulls of every face that the program measured on its own masks and called whole."""
    kept = [r for r in rows if r["way"] == "own masks" and r["found"] and r["in_view"] and r["whole"]]
    return np.array([r["pull"] for r in kept])


def calibration_pulls(count: int) -> tuple[FloatArray, FloatArray]:
    """Calibrate `count` virtual rigs; return one pull and one relative sigma each."""
    found = []
    for k in range(count):
        rig = _rig(rig_truth(100 + k % 40))
        found.append(calibration_pull(rig, virtual_calibration(rig, 1000 + k), np.random.default_rng([k, 72])))
    pulls = np.array(found)
    return pulls[:, 0], pulls[:, 1]


def _rig(truth: RigTruth) -> StereoRig:
    left, right = (
        Intrinsics(K=frozen(c.K), distortion=frozen(c.distortion), width_px=c.width_px, height_px=c.height_px)
        for c in (truth.left, truth.right)
    )
    return StereoRig(
        left=left, right=right, right_from_left=frozen(truth.right_from_left), covariance=frozen(np.zeros((14, 14)))
    )


def both_pulls(seeds: tuple[int, ...]) -> FloatArray:
    """Measure a pair each with a rig that was calibrated virtually; errors of images and calibration together."""
    pulls: list[float] = []
    for seed in seeds:
        folder = twin_folder(seed, "raycast")
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        rig = virtual_calibration(true_rig(truth), 5000 + seed)
        rows = face_rows(read_twin(load_twin(folder, rig)), "own masks", ours(False))
        pulls += image_pulls(rows).tolist()
        print(f"rig {seed} ...", file=sys.stderr, flush=True)
    return np.array(pulls)


def main() -> int:
    """Compare and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--faces", type=Path, help="what faces.py --rows wrote, to take the image part from")
    args = parser.parse_args()
    pulls, shares = calibration_pulls(25 if args.quick else CALIBRATIONS)
    lines = pull_lines("calibration, virtual rigs", pulls, len(pulls), 25 if args.quick else 100)
    lines.append(told("  sigma of an area by calibration, median", f"{np.median(shares):.2%}", len(shares)))
    if not args.quick:
        if args.faces:
            rows = json.loads(args.faces.read_text(encoding="utf-8"))["faces"]
        else:
            pairs = [(s, "raycast") for s in RAYCAST_SEEDS] + [(s, "cycles") for s in cycles_seeds()]
            rows, _ = collect(pairs, {"own masks": ours(False)})
        own = image_pulls(rows)
        lines = [*pull_lines("images, true rig", own, len(own), 300), *lines]
        together = both_pulls(RAYCAST_SEEDS[:RIGS])
        lines += pull_lines(f"both, {RIGS} rigs", together, len(together), 100)
    if args.quick:
        lines = unjudged(lines)
    spread: dict[str, object] = {"calibration_pulls": quantiles(pulls)}
    return report("Sigma against the errors made", lines, args, spread, {"calibration_pulls": pulls.tolist()})


if __name__ == "__main__":
    sys.exit(main())
