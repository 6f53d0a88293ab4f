"""Real photographs: boards measured by rigs that never saw them, a published rig's scale, laser truth of disparity.

python benchmarks/real/rigs.py --check --json figures.json      about two minutes
python benchmarks/real/rigs.py --quick                          one real rig and the laser

The photographs are not part of the project: ASBUILT_BIM_DATA names their folder (default ../shared/data). What is
absent is named and not judged. The halves of a rig show consistency only: a board of another size cancels out.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.calibrate import calibrate_stereo
from asbuilt_bim.camera.calibration.check_length import check_board, refuse_wrong_scale
from asbuilt_bim.camera.photo.read import Photo, read_photo
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.errors import AsBuiltError
from benchmarks.real.board_areas import area_sigma, errors_by
from benchmarks.real.laser_truth import laser_lines
from benchmarks.real.published_rig import published_lines
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told

CHESS = {
    "sourishg": Board(kind="chessboard", columns=9, rows=6, square_m=0.02423),
    "stereopi": Board(kind="chessboard", columns=9, rows=6, square_m=0.025),
    "barry": Board(kind="chessboard", columns=9, rows=6, square_m=0.025),
    "euroc": Board(kind="chessboard", columns=7, rows=6, square_m=0.06),
}
HALVES_LIMIT = 0.008
SIGMAS, WITHIN = 2.0, 0.90
FEWEST_HALF = 10
"""Boards of one half of a real rig: there are 29 and 30 pairs, and no more to be had."""
Pairs = list[tuple[Photo, Photo]]


def photo_pairs(folder: str, pattern: str, right_of: Callable[[Path], Path] | None = None) -> Pairs:
    """Read the pairs of photos of a folder; none where it is absent."""
    right = right_of or (lambda path: path.with_name(path.name.replace("left", "right")))
    return [(read_photo(left), read_photo(right(left))) for left in sorted((DATA / folder).glob(pattern))]


def halves_lines(name: str, pairs: Pairs) -> list[Line]:
    """Calibrate on each half of a rig's pairs and measure the boards of the other half."""
    if not pairs:
        return [told(f"{name}: absent, not judged", "", 0)]
    board, medians, everything, pulls = CHESS[name], [], [], []
    for start in (0, 1):
        made = calibrate_stereo(pairs[start::2], board)
        errors = errors_by(made.rig, pairs[1 - start :: 2], board)
        medians.append(np.nanmedian(np.abs(errors), axis=0))
        everything.append(errors)
        sigmas = [sigma for pair in pairs[1 - start :: 2] if (sigma := area_sigma(pair, board, made)) is not None]
        pulls.append(np.abs(errors[:, 0]) / np.array(sigmas))
    all_errors = np.concatenate(everything)
    mean, n = np.mean(medians, axis=0), len(all_errors)
    within = float(np.mean(np.concatenate(pulls) <= SIGMAS))
    what = f"{name}: board's area by the other half's rig, mean of the two medians"
    return [
        line(what, f"{mean[0]:.2%}", f"<= {HALVES_LIMIT:.1%}", n, mean[0] <= HALVES_LIMIT, least_n=2 * FEWEST_HALF),
        line(
            "  within two sigma of the other half's rig and the corners",
            f"{within:.0%}",
            f">= {WITHIN:.0%}",
            n,
            within >= WITHIN,
            least_n=2 * FEWEST_HALF,
        ),
        told("  plane from the pixels of both photos instead", f"{mean[1]:.2%}", n),
        told("  signed median, corners / pixels", " / ".join(f"{m:+.2%}" for m in np.nanmedian(all_errors, axis=0)), n),
        told("  worst, corners / pixels", " / ".join(f"{m:.2%}" for m in np.nanmax(np.abs(all_errors), axis=0)), n),
    ]


def refusal_lines(swapped: Pairs, pairs: Pairs) -> list[Line]:
    """Ask that what is wrong with a rig is refused by its name."""
    if not swapped or not pairs:
        return [told("rigs to refuse: absent, not judged", "", 0)]
    true, barry = CHESS["sourishg"], DATA / "rigs/barry_swapped"
    too_large = replace(true, square_m=0.030)
    files = barry / "intrinsics.yml", barry / "extrinsics.yml"
    size = Foreign(size_px=(640, 512))
    cases: list[tuple[str, Callable[[], object]]] = [
        ("left and right are swapped", lambda: calibrate_stereo(swapped, CHESS["barry"])),
        ("left and right are swapped", lambda: read_rig(*files, replace(size, metres_per_unit=0.001))),
        ("looks like millimetres", lambda: read_rig(*files, size)),
        ("square_m", lambda: replace(true, square_m=24.23)),
        (
            "scale is off",
            lambda: refuse_wrong_scale(check_board(calibrate_stereo(pairs, too_large).rig, pairs[3], true)),
        ),
    ]
    refusals = [(name, _refusal(action)) for name, action in cases]
    wrong = [f"{name}: {text[:50]}" for name, text in refusals if name not in text]
    what = "rigs swapped, in the wrong unit, or of wrong squares: refused by name"
    right = len(refusals) - len(wrong)
    lines = [line(what, f"{right} of {len(refusals)}", "all", len(refusals), not wrong, least_n=len(refusals))]
    return lines + [told(f"  {text}", "", 1) for text in wrong]


def _refusal(action: Callable[[], object]) -> str:
    try:
        action()
    except AsBuiltError as error:
        return str(error)
    return "not refused"


def main() -> int:
    """Measure what is there and print the table."""
    args = options(__doc__ or "").parse_args()
    if absent(DATA / "rigs"):
        return 0
    ours = photo_pairs("rigs/sourishg_24.23mm", "left*.jpg")
    lines = halves_lines("sourishg", ours)
    if not args.quick:
        lines += halves_lines("stereopi", photo_pairs("rigs/stereopi/pairs", "left*.png"))
        lines += published_lines(DATA / "stereo/euroc", CHESS["euroc"])
        lines += refusal_lines(photo_pairs("rigs/barry_swapped", "left*.jpg")[::3], ours[::2])
    laser = DATA / "stereo/eth3d_playground"
    lines += laser_lines(laser) if laser.is_dir() else [told("eth3d: absent, not judged", "", 0)]
    return report("Real photographs", lines, args)


if __name__ == "__main__":
    sys.exit(main())
