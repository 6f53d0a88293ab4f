"""Rigs at rest: does what is measured scatter from frame to frame as its sigma says?

python benchmarks/real/repeats.py --check --json figures.json     what was developed on, five minutes
python benchmarks/real/repeats.py --scenes report --check         what is kept for the report: run once
python benchmarks/real/repeats.py --quick                         four frames of one rig

Two kinds. A fixed polygon of the picture scatters by its plane's noise alone. The program's own faces, found again by
how they overlap, scatter by their outlines, too, and by which pixels were taken for one face. A rig that is off is off
in every frame alike, and so is what all frames' matching does wrong: none of that shows here.

The photographs are not part of the project: ASBUILT_BIM_DATA names their folder (default ../shared/data). What is
absent is named and not judged.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.read import decode
from asbuilt_bim.camera.rectify import RectifiedPair, rectification, rectify
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.measure.planes.face_hypotheses import filled
from benchmarks.real.fixed_patches import Frame, Repeat, measured_patches, patches_of, pooled
from benchmarks.real.planes import measured
from benchmarks.real.scenes import STEREO, Scene, chosen
from benchmarks.real.shots import Shot, readable
from benchmarks.sites import absent
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

MOST_RATIO = 1.4
FEWEST_PATCHES, FEWEST_OF_SCENE, FEWEST_FRAMES = 12, 2, 3
SAME_FACE = 0.5
"""Of what two outlines cover together: the share that both cover, to be one face."""
SEEN_AGAIN = 0.6
"""Of the frames: a face found in fewer is no repeat."""
QUICK_FRAMES = 4


def matched_faces(found: list[PairMeasurement]) -> list[Repeat]:
    """Return the flat faces that are found again in most frames: each frame's best overlap with where it was first."""
    shape = found[0].detail.pair.valid_left.shape
    masks = [[(filled(f.outline_px, shape), f) for f in one.faces if isinstance(f.frame, PlaneFrame)] for one in found]
    taken: set[tuple[int, int]] = set()
    repeats: list[Repeat] = []
    for first, faces in enumerate(masks):
        for number, (mask, _) in enumerate(faces):
            if (first, number) in taken:
                continue
            same = [(k, j) for k in range(first, len(masks)) if (j := _best(mask, masks[k], k, taken)) is not None]
            if len(same) < max(FEWEST_FRAMES, SEEN_AGAIN * len(found)):
                continue
            taken.update(same)
            chosen_faces = [masks[k][j][1] for k, j in same]
            repeats.append(
                Repeat(
                    name=f"face {len(repeats) + 1}",
                    areas_m2=tuple(face.area_m2 for face in chosen_faces),
                    sigmas_m2=tuple(face.area_sigma_image_m2 for face in chosen_faces),
                )
            )
    return repeats


def _best(
    mask: BoolArray, faces: list[tuple[BoolArray, object]], frame: int, taken: set[tuple[int, int]]
) -> int | None:
    """Return the number of the frame's face that overlaps most, over a half; None where none does."""
    overlaps = [
        0.0 if (frame, j) in taken else float(np.count_nonzero(mask & other) / max(np.count_nonzero(mask | other), 1))
        for j, (other, _) in enumerate(faces)
    ]
    if not overlaps or max(overlaps) < SAME_FACE:
        return None
    return int(np.argmax(overlaps))


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneRepeats:
    """What a scene's frames gave: patches, faces found again, frames used, faces in a usual frame."""

    patches: list[Repeat]
    faces: list[Repeat]
    frames: int
    usual_faces: int = 0


def scene_repeats(scene: Scene, most: int | None) -> SceneRepeats:
    """Measure a scene's frames again and again; those that the program refuses are left out."""
    shots, faces, usual = readable(scene.shots()[:most]), list[Repeat](), 0
    if scene.faces:
        found = [one for one in map(measured, shots) if isinstance(one, PairMeasurement)]
        frames = [Frame.of(one.detail.pair) for one in found]
        if len(found) >= FEWEST_FRAMES:
            faces, usual = matched_faces(found), int(np.median([len(one.faces) for one in found]))
    else:
        frames = [Frame.of(_rectified(shot)) for shot in shots]
    if len(frames) < FEWEST_FRAMES:
        return SceneRepeats(patches=[], faces=[], frames=len(frames))
    patches = measured_patches(frames, patches_of(frames), scene.name)
    return SceneRepeats(patches=patches, faces=faces, frames=len(frames), usual_faces=usual)


def _rectified(shot: Shot) -> RectifiedPair:
    prepared = rectification(shot.rig)
    return rectify(prepared, decode(shot.photos.left), decode(shot.photos.right), shot.photos.name)


def scene_lines(name: str, kind: str, repeats: list[Repeat], frames: int) -> list[Line]:
    """Judge a scene's scatter by the stated sigma, and tell both."""
    if not repeats:
        return [told(f"{name}, {kind}: none", f"{frames} frames", 0)]
    scatter = np.median([one.scatter_m2 / np.mean(one.areas_m2) for one in repeats])
    sigma = np.median([np.median(one.sigmas_m2) / np.mean(one.areas_m2) for one in repeats])
    ratios = [one.ratio for one in repeats]
    within = sum(ratio <= MOST_RATIO for ratio in ratios)
    what, ratio = f"{name}, {kind}: scatter in stated sigmas, {frames} frames", pooled(repeats)
    return [
        line(what, f"{ratio:.2f}", f"<= {MOST_RATIO}", len(repeats), ratio <= MOST_RATIO, FEWEST_OF_SCENE),
        told("  scatter, sigma, as shares of the area (medians)", f"{scatter:.2%}, {sigma:.2%}", len(repeats)),
        told("  of one: median, worst; not over 1.4", f"{np.median(ratios):.2f}, {max(ratios):.2f}; {within}",
             len(repeats)),
    ]  # fmt: skip


def all_scenes(patches: list[Repeat]) -> Line:
    """Judge that there are patches enough to say anything."""
    n = len(patches)
    return line("fixed patches, all scenes", str(n), f">= {FEWEST_PATCHES}", n, n >= FEWEST_PATCHES, least_n=1)


def main() -> int:
    """Measure what is there and print a table for each role."""
    parser = options(__doc__ or "")
    parser.add_argument("--scenes", choices=("develop", "report", "all"), default="develop")
    args = parser.parse_args()
    if absent(STEREO):
        return 0
    lines: list[Line] = []
    summary: dict[str, object] = {}
    rows: dict[str, object] = {}
    for role in ("develop", "report") if args.scenes == "all" else (args.scenes,):
        patches, faces = list[Repeat](), list[Repeat]()
        its = list[Line]()
        for scene in [s for s in chosen(role) if s.at_rest and (not args.quick or "room" in s.name)]:
            if not scene.here:
                its.append(told(f"{scene.name}: absent, not judged", "", 0))
                continue
            one = scene_repeats(scene, QUICK_FRAMES if args.quick else None)
            its += scene_lines(scene.name, "patches", one.patches, one.frames)
            if scene.faces:
                its += scene_lines(scene.name, "faces", one.faces, one.frames)
                again = f"{len(one.faces)} of {one.usual_faces}"
                its.append(told("  found again in most frames, of a frame's", again, one.frames))
            patches, faces = patches + one.patches, faces + one.faces
        lines += [told(role.upper(), "", len(its)), all_scenes(patches), *its]
        summary[role] = {kind: quantiles(one.ratio for one in its) for kind, its in
                         (("patches", patches), ("faces", faces))}  # fmt: skip
        rows[role] = [asdict(one) for one in (*patches, *faces)]
    return report("Rigs at rest", unjudged(lines) if args.quick else lines, args, summary, rows)


if __name__ == "__main__":
    sys.exit(main())
