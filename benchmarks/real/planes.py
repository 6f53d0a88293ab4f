"""Faces in real photographs beside a laser's or structured light's planes: area, sigma, and what was found at all.

python benchmarks/real/planes.py --check --json figures.json     scenes that were developed on, four minutes
python benchmarks/real/planes.py --scenes report --check         those kept for the report: run once
python benchmarks/real/planes.py --quick                         one pair
python benchmarks/real/planes.py --pictures FOLDER               outlines and regions over the photos

Each face is held against the truth's plane within its own outline, so the area's error is the plane's. Where a side
really ends, only those called whole would have to know, and a truth without outlines can't say. Scenes without truth
tell how even faces are, and how a wide and a narrow camera agree.

The photographs are not part of the project: ASBUILT_BIM_DATA names their folder (default ../shared/data). What is
absent is named and not judged.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.errors import MeasureError
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.pair import PairMeasurement, measure_photos
from asbuilt_bim.measure.station import OWN, MeasureOptions
from asbuilt_bim.vision.target.find import TargetOptions
from benchmarks.real.face_picture import draw
from benchmarks.real.face_truth import (
    WITHIN,
    FaceCase,
    RegionCase,
    face_case,
    not_rejected,
    regions_by_plain_matching,
    regions_by_truth,
)
from benchmarks.real.given_pixels import rectified
from benchmarks.real.scenes import STEREO, TWO_CAMERAS, Scene, chosen
from benchmarks.real.shots import Shot, readable
from benchmarks.real.two_cameras import two_camera_lines
from benchmarks.sites import absent
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

MOST_Z = 5.0
FOUND, MEASURED, SIGMA_SHARE = 0.80, 0.50, 0.08
WHOLE_ERROR, WHOLE_SIGMAS = 0.05, 3.0
FEWEST_FACES, FEWEST_REGIONS = 10, 2
"""All that the two pairs with truth have: a pair has a dozen faces, and two to ten regions."""
WITHOUT_DISC = MeasureOptions(target=TargetOptions(required=False))


@dataclass(slots=True, kw_only=True)
class Gathered:
    """What all scenes of one role gave."""

    faces: list[FaceCase] = field(default_factory=list)
    regions: list[RegionCase] = field(default_factory=list)
    plain: list[RegionCase] = field(default_factory=list)  # by plain matching, where there is no truth
    told: list[Line] = field(default_factory=list)
    scenes: list[str] = field(default_factory=list)


def measured(shot: Shot) -> PairMeasurement | MeasureError:
    """Measure a pair as the program does without a disc; what refuses it is returned, not raised."""
    try:
        return measure_photos(shot.photos, shot.rig, WITHOUT_DISC, OWN)
    except MeasureError as refused:
        return refused


def gather(scene: Scene, into: Gathered, pictures: Path | None) -> None:
    """Measure a scene's pairs; hold them against its truth, or tell how even their faces are."""
    if not scene.here:
        into.told.append(told(f"{scene.name}: absent, not judged", "", 0))
        return
    shots = readable(scene.shots())
    found = [measured(shot) for shot in shots]
    for shot, one in zip(shots, found, strict=True):
        if shot.truth_px is not None:
            into.scenes = sorted({*into.scenes, scene.name})
            _beside_truth(scene, shot, one if isinstance(one, PairMeasurement) else None, into)
        if pictures is not None and isinstance(one, PairMeasurement):
            draw(pictures / f"{scene.name} {shot.photos.name}.png", shot, one)
    into.told += _scene_lines(scene, found)
    if not scene.truth:
        cases = [case for one in found if isinstance(one, PairMeasurement)
                 for case in regions_by_plain_matching(scene.name, one)]  # fmt: skip
        into.plain += cases
        got = sum(case.became == "measured" for case in cases)
        said = sum(case.became == "said" for case in cases)
        into.told.append(
            told("  regions by plain matching: measured, said", f"{got}, {said} of {len(cases)}", len(cases))
        )


def _beside_truth(scene: Scene, shot: Shot, found: PairMeasurement | None, into: Gathered) -> None:
    assert shot.truth_px is not None
    if found is not None:
        ready = rectified(shot, found)
        flat = [face for face in found.faces if isinstance(face.frame, PlaneFrame)]
        into.faces += [face_case(scene.name, shot, found, face, ready) for face in flat]
    into.regions += regions_by_truth(scene.name, shot, found)


def _scene_lines(scene: Scene, found: list[PairMeasurement | MeasureError]) -> list[Line]:
    """Tell of a scene: faces, how even they are, their sigma, what was refused and why."""
    done = [one for one in found if isinstance(one, PairMeasurement)]
    faces = [face for one in done for face in one.faces]
    why = Counter(r.code.name for one in found for r in one.rejections)
    lines = [told(f"{scene.name}: pairs measured, faces", f"{len(done)} of {len(found)}, {len(faces)}", len(found))]
    if faces:
        even, sigma = (
            np.median([face.flatness_rms_m / face.distance_m for face in faces]),
            np.median([face.area_sigma_m2 / face.area_m2 for face in faces]),
        )
        whole = sum(face.whole for face in faces)
        text = f"{even:.2%} of the distance, {sigma:.1%}, {whole}"
        lines.append(told("  evenness and sigma of area (medians), called whole", text, len(faces)))
    return [*lines, *(told(f"  {name}", str(n), n) for name, n in sorted(why.items()))]


def truth_lines(gathered: Gathered) -> list[Line]:
    """Judge the faces and regions of one role."""
    cases = [case for case in gathered.faces if np.isfinite(case.truth_m2)]
    if not gathered.scenes:
        return []
    z = np.array([case.z for case in cases])
    n, where = len(z), ", ".join(gathered.scenes)
    lines = [told(f"faces beside truth ({where}); of all that were measured", f"{n} of {len(gathered.faces)}", n)]
    for sigmas, share in ((1, "68"), (2, "95")):
        within, p, holds = not_rejected(sigmas, z)
        figure = f"{within} of {n} (p {p:.2g})"
        lines.append(line(f"  within {sigmas} sigma", figure, f"{share} %, p >= 0.05", n, holds, FEWEST_FACES))
    most = float(np.max(np.abs(z), initial=0.0))
    lines.append(line("  largest error in sigmas", f"{most:.1f}", f"<= {MOST_Z:.0f}", n, most <= MOST_Z, FEWEST_FACES))
    return [*lines, *_size_lines(cases), *_whole_lines(cases), *_region_lines(gathered.regions)]


def _size_lines(cases: list[FaceCase]) -> list[Line]:
    if not cases:
        return []
    columns: dict[str, FloatArray] = {
        "area": np.abs([case.error for case in cases]),
        "tilt": np.array([case.tilt_deg for case in cases]),
        "offset": np.abs([case.offset_m / case.distance_m for case in cases]),
        "share": np.array([case.plane_share for case in cases]),
    }
    median = {key: float(np.median(values)) for key, values in columns.items()}
    mixed = int(np.count_nonzero(columns["share"] < 0.5))
    upright = np.array([case.z for case in cases if case.upright])
    within = [not_rejected(sigmas, upright)[0] for sigmas in WITHIN]
    given = [case for case in cases if np.isfinite(case.given_z)]
    z = np.array([case.given_z for case in given])
    counts = [not_rejected(sigmas, z)[0] for sigmas in WITHIN]
    tilt = float(np.median([case.given_tilt_deg for case in given])) if given else float("nan")
    text = f"{median['area']:.1%}, {median['offset']:.1%}, {median['tilt']:.0f} deg"
    return [
        told("  error of area, offset by distance, tilt (medians)", text, len(cases)),
        told("  those on an upright plane of the truth: within 1, 2 sigma", f"{within[0]}, {within[1]}", len(upright)),
        told("  outlines in which no plane holds half of the truth", str(mixed), len(cases)),
        told("  had the truth told the pixels: within 1, 2 sigma; tilt",
             f"{counts[0]}, {counts[1]}; {tilt:.0f} deg", len(given)),
    ]  # fmt: skip


def _whole_lines(cases: list[FaceCase]) -> list[Line]:
    whole = [case for case in cases if case.seen == "whole"]
    if not whole:
        return [told("  called whole: none", "", 0)]
    right = [abs(case.error) <= WHOLE_ERROR or abs(case.z) <= WHOLE_SIGMAS for case in whole]
    what, limit = "  called whole, within 5 % or 3 sigma", "all"
    return [line(what, f"{sum(right)} of {len(whole)}", limit, len(whole), all(right), least_n=1)]


def _region_lines(regions: list[RegionCase]) -> list[Line]:
    n = len(regions)
    got = sum(region.became == "measured" for region in regions)
    found = got + sum(region.became == "said" for region in regions)
    sigma = [region.sigma_share for region in regions if np.isfinite(region.sigma_share)]
    usual = float(np.median(sigma)) if sigma else float("nan")
    return [
        line("upright planar regions of 0.5 m2 and 60 px: found", f"{found} of {n}", f">= {FOUND:.0%}", n,
             found >= FOUND * n, FEWEST_REGIONS),
        line("  measured", f"{got} of {n}", f">= {MEASURED:.0%}", n, got >= MEASURED * n, FEWEST_REGIONS),
        line("  sigma of those areas, median", f"{usual:.1%}" if sigma else "none", f"<= {SIGMA_SHARE:.0%}", len(sigma),
             usual <= SIGMA_SHARE, least_n=1),
    ]  # fmt: skip


def _role(role: str, args: object) -> tuple[list[Line], Gathered]:
    """Gather the scenes of a role and judge them."""
    gathered, quick = Gathered(), bool(getattr(args, "quick", False))
    scenes = [scene for scene in chosen(role) if scene.faces and (bool(scene.truth) or not quick)]
    for scene in scenes:
        gather(scene, gathered, getattr(args, "pictures", None))
    for name, its in TWO_CAMERAS if not quick else ():
        if its == role and (STEREO / "eth3d_pairs" / f"{name}l").is_dir():
            gathered.told += two_camera_lines(name, measured)
    return [*truth_lines(gathered), *gathered.told], gathered


def main() -> int:
    """Measure what is there and print a table for each role."""
    parser = options(__doc__ or "")
    parser.add_argument("--scenes", choices=("develop", "report", "all"), default="develop")
    parser.add_argument("--pictures", type=Path, help="draw what was measured into this folder")
    args = parser.parse_args()
    if absent(STEREO):
        return 0
    lines: list[Line] = []
    summary: dict[str, object] = {}
    rows: dict[str, object] = {}
    for role in ("develop", "report") if args.scenes == "all" else (args.scenes,):
        its, gathered = _role(role, args)
        lines += [told(f"{role.upper()}", "", len(gathered.scenes)), *its]
        finite = [case for case in gathered.faces if np.isfinite(case.truth_m2)]
        summary[role] = {
            "scenes with truth": gathered.scenes,
            "z": quantiles(case.z for case in finite),
            "area error": quantiles(case.error for case in finite),
            "tilt deg": quantiles(case.tilt_deg for case in finite),
        }
        regions = [asdict(case) for case in (*gathered.regions, *gathered.plain)]
        rows[role] = [*(asdict(case) for case in gathered.faces), *regions]
    return report("Planes in real photographs", unjudged(lines) if args.quick else lines, args, summary, rows)


if __name__ == "__main__":
    sys.exit(main())
