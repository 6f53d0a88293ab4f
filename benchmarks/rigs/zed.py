"""A stereo camera off the shelf with its factory numbers: rows before and after refining, and known distances.

python benchmarks/rigs/zed.py --check --json figures.json      about a minute
python benchmarks/rigs/zed.py --quick                          one pair, not judged

A ZED in a corridor, by the file that its maker gives. ROWS: what `--refine-rig` leaves of how far apart they lie, the
worse median of both halves of the photo. DISTANCES: a board on a chair, stated 5 and 10 m away, against the refined rig
and what such a rig is trusted to. The photographs are not part of the project: ASBUILT_BIM_DATA names their folder.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.overlap import match_pair
from asbuilt_bim.camera.rectify import RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.measure.sigma.area import left_of_disparity_px
from asbuilt_bim.vision.stereo.rig_health import (
    StationHealth,
    judge,
    levelled,
    refined_rig,
    station_health,
)
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told, unjudged

FOLDER = DATA / "stereo/zed_corridor"
ROWS_LIMIT_PX = 0.3
SIZES = {"720": (5, 10, 15, 20, 25, 30), "1080": (5, 10)}
BOARDS = {
    ("720", 5): (632, 437, 22),
    ("720", 10): (624, 391, 12),
    ("1080", 5): (946, 695, 40),
    ("1080", 10): (927, 604, 22),
}
"""Where the board lies in the left photo as it is, and half its pattern's width: marked by hand. Further off it is too
small to be told from the chair."""
_MATCH_PX = 0.1
Pair = tuple[str, np.ndarray, np.ndarray]


def pairs(size: str, stated_m: tuple[int, ...]) -> list[tuple[int, Pair]]:
    """Read the raw pairs of a size by the distance that is stated."""
    found = []
    for distance in stated_m:
        names = [f"indoor_{size}/INDOOR-ZED-{size}-{side}1-UNREC-{distance:02d}.png" for side in "LR"]
        images = [cv2.imread(str(FOLDER / name), cv2.IMREAD_COLOR) for name in names]
        if images[0] is not None and images[1] is not None:
            found.append((distance, (f"{size} {distance} m", images[0], images[1])))
    return found


def factory_rig(size: str) -> StereoRig:
    """Read the maker's numbers for a size of photos, as the program does; `width` is what such a rig is trusted to."""
    return read_rig(
        FOLDER / "SN21531_from_m.conf", None, Foreign(size_px=(1280, 720) if size == "720" else (1920, 1080))
    )


def health_of(rig: StereoRig, pair: Pair) -> tuple[RectifiedPair, StationHealth | None]:
    """Rectify a pair and ask what its matches say of the rig."""
    rectified = rectify(rectification(rig), pair[1], pair[2], pair[0])
    return rectified, station_health(rectified, match_pair(rectified), rig)


def size_lines(size: str, stated_m: tuple[int, ...]) -> list[Line]:
    """Refine the rig from all pairs of a size and measure rows and distances again."""
    rig = factory_rig(size)
    given = pairs(size, stated_m)
    healths = [health for _, pair in given if (health := health_of(rig, pair)[1]) is not None]
    if not healths:
        return [told(f"{size}: no pair has matches enough", "", 0)]
    verdict, camera = judge(healths, rig), healths[0].camera
    refined = refined_rig(rig, levelled(verdict, camera), camera)
    again = [health_of(refined, pair) for _, pair in given]
    after = [health.fit.rows_px for _, health in again if health is not None]
    pitch, yaw, roll = np.rad2deg(levelled(verdict, camera).correction_rad[:3])
    lines = [
        told(f"{size}: rows by the factory's numbers, each pair", _several(verdict.station_rows_px), len(healths)),
        line(f"{size}: rows after refining, the worst pair", f"{max(after):.2f} px", f"< {ROWS_LIMIT_PX:g} px",
             len(after), max(after) < ROWS_LIMIT_PX, least_n=2),
        told(f"  turned by (pitch, yaw, roll) {pitch:+.3f}, {yaw:+.3f}, {roll:+.3f} degrees; state before",
             verdict.state, len(healths)),
    ]  # fmt: skip
    for distance, pair in given:
        if (size, distance) in BOARDS:
            lines.append(distance_line(refined, size, distance, pair))
    return lines


def distance_line(rig: StereoRig, size: str, stated_m: int, pair: Pair) -> Line:
    """Measure the board's distance along the rig's axis, by its pattern in both rectified photos."""
    prepared = rectification(rig)
    rectified = rectify(prepared, pair[1], pair[2], pair[0])
    x, y, half = BOARDS[size, stated_m]
    camera = rectified.camera
    ray = rig.left.rays(np.array([float(x), float(y)])) @ camera.rectified_from_left.T
    at = ray[:2] / ray[2] * camera.f_px + [camera.cx_px, camera.cy_px]
    column, row = (round(float(value)) for value in at)
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (rectified.left, rectified.right))
    pattern = left[row - half : row + half + 1, column - half : column + half + 1]
    likeness = cv2.matchTemplate(right[row - half - 1 : row + half + 2], pattern, cv2.TM_CCOEFF_NORMED).max(axis=0)
    likeness = likeness[: column - half + 1]  # nothing lies behind infinity
    best = int(np.argmax(likeness))
    before, here, after = (float(likeness[min(max(best + k, 0), len(likeness) - 1)]) for k in (-1, 0, 1))
    disparity = column - half - best - 0.5 * (before - after) / (before - 2.0 * here + after)
    measured = camera.f_px * camera.baseline_m / disparity
    q = np.array([0.0, 0.0, disparity])
    modes = left_of_disparity_px(at[None], q, camera, np.array(rig.width.turn_rad), rig.width.lens_px)
    by_photos = float(np.hypot(np.linalg.norm(modes), _MATCH_PX)) / disparity
    sigma = measured * float(np.hypot(by_photos, rig.width.scale_share))
    off = abs(measured - stated_m)
    return line(
        f"{size}: the board stated at {stated_m} m", f"{measured:.2f} ± {sigma:.2f} m", "within 2 sigma", 1,
        off <= 2.0 * sigma, least_n=1,
    )  # fmt: skip


def _several(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.2f}" for value in values) + " px"


def main() -> int:
    """Measure what is there and print the table."""
    args = options(__doc__ or "").parse_args()
    if absent(FOLDER):
        return 0
    lines = [one for size, stated in SIZES.items() for one in size_lines(size, stated[:1] if args.quick else stated)]
    if args.quick:
        lines = unjudged(lines)
    return report("A camera off the shelf", lines, args)


if __name__ == "__main__":
    sys.exit(main())
