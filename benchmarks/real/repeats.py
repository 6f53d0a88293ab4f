"""Rigs at rest: does what is measured scatter from frame to frame as its sigma says?

python benchmarks/real/repeats.py --check --json figures.json     what was developed on, five minutes
python benchmarks/real/repeats.py --scenes report --check         what is kept for the report: run once
python benchmarks/real/repeats.py --quick                         three frames of one rig

Two kinds. A fixed polygon of the picture scatters by its plane's noise alone. The program's own faces, found again by
how they overlap, scatter by their outlines, too, and by which pixels were taken for one face. A rig that is off is off
in every frame alike, and so is what all frames' matching does wrong: none of that shows here.

The photographs are not part of the project: ASBUILT_BIM_DATA names their folder (default ../shared/data). What is
absent is named and not judged.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence, Set
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.read import decode
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair, rectification, rectify
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.measure.planes.face_hypotheses import filled
from benchmarks.real.face_truth import area_on
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
QUICK_FRAMES = 3


Masked = tuple[BoolArray, MeasuredFace]
"""A flat face and its pixels (H, W) in the rectified photo."""


def matched_faces(found: list[PairMeasurement]) -> list[Repeat]:
    """Return the flat faces that are found again in most frames: each frame's best overlap with where it was first."""
    camera, shape = found[0].detail.pair.camera, found[0].detail.pair.valid_left.shape
    frames = [
        [(filled(face.outline_px, shape), face) for face in one.faces if isinstance(face.frame, PlaneFrame)]
        for one in found
    ]
    taken: set[tuple[int, int]] = set()
    repeats: list[Repeat] = []
    for first, faces in enumerate(frames):
        for number, (mask, _) in enumerate(faces):
            if (first, number) in taken:
                continue
            same = [
                (k, j) for k in range(first, len(frames)) if (j := best_overlap(mask, frames[k], k, taken)) is not None
            ]
            if len(same) >= max(FEWEST_FRAMES, SEEN_AGAIN * len(found)):
                taken.update(same)
                its = [frames[k][j][1] for k, j in same]
                repeats.append(_repeat_of(its, f"face {len(repeats) + 1}", camera))
    return repeats


def _repeat_of(faces: list[MeasuredFace], name: str, camera: RectifiedCamera) -> Repeat:
    """Gather one face's areas, and what they would be with only its plane, or only its outline, changing."""
    outlines = [[camera.rays(ring) for ring in face.outline_px] for face in faces]
    planes = [face.frame.plane for face in faces if isinstance(face.frame, PlaneFrame)]
    return Repeat(
        name=name,
        areas_m2=tuple(face.area_m2 for face in faces),
        sigmas_m2=tuple(face.area_sigma_image_m2 for face in faces),
        by_plane_m2=tuple(area_on(plane, outlines[0]) for plane in planes),
        by_outline_m2=tuple(area_on(planes[0], outline) for outline in outlines),
    )


def best_overlap(mask: BoolArray, faces: Sequence[Masked], frame: int, taken: Set[tuple[int, int]]) -> int | None:
    """Return the number of the frame's face that overlaps most, over a half; None where none does."""
    overlaps = [
        0.0 if (frame, j) in taken else np.count_nonzero(mask & other) / max(1, int(np.count_nonzero(mask | other)))
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
    scatter = float(np.median([one.scatter_m2 / float(np.mean(one.areas_m2)) for one in repeats]))
    sigma = float(np.median([float(np.median(one.sigmas_m2)) / float(np.mean(one.areas_m2)) for one in repeats]))
    ratios = [one.ratio for one in repeats]
    within = sum(ratio <= MOST_RATIO for ratio in ratios)
    parts: list[Line] = []
    if repeats[0].by_plane_m2:
        parts.append(told("  of its plane alone, of its outline alone (medians)", _parts(repeats), len(repeats)))
    what, ratio = f"{name}, {kind}: scatter in stated sigmas, {frames} frames", pooled(repeats)
    return [
        line(what, f"{ratio:.2f}", f"<= {MOST_RATIO}", len(repeats), ratio <= MOST_RATIO, FEWEST_OF_SCENE),
        told("  scatter, sigma, as shares of the area (medians)", f"{scatter:.2%}, {sigma:.2%}", len(repeats)),
        told("  of one: median, worst; not over 1.4", f"{np.median(ratios):.2f}, {max(ratios):.2f}; {within}",
             len(repeats)),
        *parts,
    ]  # fmt: skip


def _parts(repeats: list[Repeat]) -> str:
    """Say how the faces' areas would scatter by their planes alone, and by their outlines alone."""
    columns = [(one.by_plane_m2, one.by_outline_m2, float(np.mean(one.areas_m2))) for one in repeats]
    by_plane = np.median([np.std(plane, ddof=1) / mean for plane, _, mean in columns if plane])
    by_outline = np.median([np.std(outline, ddof=1) / mean for _, outline, mean in columns if outline])
    return f"{by_plane:.2%}, {by_outline:.2%}"


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
