"""All faces of one station: drafted, outlined, solved together, finished; what is too weak is rejected by name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.finish import Settled, finish_face
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.planes.adjust import Adjusted, Touch, adjust_planes
from asbuilt_bim.measure.planes.face_hypotheses import (
    FaceHypothesis,
    contradiction,
    face_hypotheses,
    floor_sights,
    outline_faces,
    pieces_of,
    refine_inside,
)
from asbuilt_bim.measure.round.column import fit_round_column, round_face
from asbuilt_bim.measure.sigma.area import rig_parts
from asbuilt_bim.measure.workbench import Workbench, workbench
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.scene.read import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceOptions:
    """When a face is worth reporting."""

    least_width_px: float = 12.0  # edges of 0.3 px each are 3.5 % of it; narrower is a guess
    most_sigma_share: float = 0.20  # sigma of area over area; beyond, a face was seen, and its number says nothing
    least_area_m2: float = 0.03  # a hand's breadth of a column


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationFaces:
    """The faces of a station, what was left out, and up (3,) in the left frame (None where no edge shows it)."""

    faces: tuple[MeasuredFace, ...]
    rejections: tuple[Rejection, ...]
    up: FloatArray | None


def measure_faces(
    pair: RectifiedPair,
    scene: Scene,
    instances: Sequence[Instance],
    rig: StereoRig,
    options: FaceOptions,
    marks: BoolArray | None = None,
    sky: BoolArray | None = None,
) -> StationFaces:
    """Measure every face of the instances of one pair; `marks` (H, W) is print on boards that holds no plane."""
    bench = workbench(pair, scene, marks, sky)
    settled, down = settled_faces(bench, instances)
    by_rig = rig_parts([(s.outline.rings, s.q_px) for s in settled], rig, pair.camera, bench.rows_px)
    faces: list[MeasuredFace] = []
    rejections: list[Rejection] = []
    for one, part in zip(settled, by_rig, strict=True):
        face = finish_face(bench, one, f"{pair.name}/{len(faces) + 1}", instances[one.hypothesis.instance], part)
        if face is not None:
            judge_face(face, faces, rejections, options)
    _add_round(bench, instances, rig, faces, rejections, options)
    up = frozen(-down @ pair.camera.rectified_from_left) if scene.vertical is not None else None
    return StationFaces(faces=tuple(faces), rejections=tuple(rejections), up=up)


def settled_faces(bench: Workbench, instances: Sequence[Instance]) -> tuple[list[Settled], FloatArray]:
    """Settle plane and outline of every flat face, and plumb (3,) as they show it together."""
    hypotheses = face_hypotheses(bench, instances)
    if not hypotheses:
        return [], bench.scene.level.view.down
    floors = floor_sights(bench)
    hypotheses = refine_inside(bench, outline_faces(bench, hypotheses, _start(hypotheses), floors))
    found = adjust_hypotheses(bench, hypotheses)
    hypotheses = outline_faces(bench, hypotheses, found.q_px, floors, found.joint)
    return [
        Settled(
            hypothesis=hypothesis,
            q_px=q,
            covariance=covariance + contradiction(q, covariance, hypothesis, bench),
            outline=hypothesis.outline,
        )
        for hypothesis, q, covariance in zip(hypotheses, found.q_px, found.covariance, strict=True)
        if hypothesis.outline is not None
        and (instances[hypothesis.instance].source is InstanceSource.GIVEN or not lies(q, found.down))
    ], found.down


def lies(q: FloatArray, down: FloatArray) -> bool:
    """Say whether a plane q (3,) lies rather than stands: ground and soffits look upright from afar, by few pixels."""
    return bool(abs(q @ down) > np.cos(np.pi / 4.0) * np.linalg.norm(q))


def _start(hypotheses: Sequence[FaceHypothesis]) -> FloatArray:
    return np.array([hypothesis.sight.q_px for hypothesis in hypotheses]).reshape(-1, 3)


def _add_round(
    bench: Workbench,
    instances: Sequence[Instance],
    rig: StereoRig,
    faces: list[MeasuredFace],
    rejections: list[Rejection],
    options: FaceOptions,
) -> None:
    for number, instance in enumerate(instances):
        for piece in pieces_of(bench.scene, instance):
            if bench.scene.pieces[piece].circle is None:
                continue
            mask = bench.scene.mask(piece) & instance.mask
            fit = fit_round_column(bench, piece, mask)
            if fit is not None:
                name = f"{bench.pair.name}/{len(faces) + 1}"
                judge_face(round_face(bench, fit, name, instance, number, mask, rig), faces, rejections, options)


def judge_face(
    face: MeasuredFace,
    faces: list[MeasuredFace],
    rejections: list[Rejection],
    options: FaceOptions,
    uncertain: Reason = Reason.FACE_UNCERTAIN,
) -> None:
    """Keep a face, or say that it was seen and isn't measurable, where and why; crumbs go without a word."""
    if not np.isfinite(face.area_m2) or face.area_m2 < options.least_area_m2:
        return
    station = face.face_id.rsplit("/", 1)[0]
    own = f"{station}/x{len(rejections) + 1}"  # a number of its own: the next face that is kept has that of this one
    share = face.area_sigma_m2 / face.area_m2
    code, values = None, dict[str, Value]()
    if face.width_px < options.least_width_px:
        code, values = Reason.FACE_NARROW, {"width_px": face.width_px, "limit_px": options.least_width_px}
    elif not share <= options.most_sigma_share:
        code, values = uncertain, {"limit_share": options.most_sigma_share}
        values |= {"sigma_share": share} if np.isfinite(share) else {}
    if code is None:
        faces.append(replace(face, face_id=f"{station}/{len(faces) + 1}"))
        return
    seen: dict[str, Value] = {"label": face.label, "area_m2": face.area_m2, "distance_m": face.distance_m}
    subject = about(SubjectKind.FACE, own, station)
    rejections.append(rejected(code, subject, **(seen | values | _box_px(face))))


def _box_px(face: MeasuredFace) -> dict[str, Value]:
    """Return what a face's outer ring spans in the rectified left photo: x0, y0, x1, y1, whole pixels.

    A corner far off on a plane seen edge-on may have no pixel; a ring without any gives no box.
    """
    ring = face.outline_px[0][np.isfinite(face.outline_px[0]).all(axis=1)]
    if not len(ring):
        return {}
    low, high = np.floor(ring.min(axis=0)), np.ceil(ring.max(axis=0))
    return {"box_px": (int(low[0]), int(low[1]), int(high[0]), int(high[1]))}


def thumbnail(pair: RectifiedPair, most_width_px: int = 1280, quality: int = 85) -> bytes:
    """Return the rectified left photo as a JPEG without any EXIF, at most `most_width_px` wide."""
    image = pair.left
    if image.shape[1] > most_width_px:
        height = round(image.shape[0] * most_width_px / image.shape[1])
        image = np.asarray(cv2.resize(image, (most_width_px, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return bytes(data) if done else b""


def adjust_hypotheses(bench: Workbench, hypotheses: Sequence[FaceHypothesis]) -> Adjusted:
    """Solve the face hypotheses' planes together."""
    scene = bench.scene
    vertical = scene.vertical
    sigma = vertical.sigma_rad if vertical is not None else np.radians(10.0)
    return adjust_planes(
        [hypothesis.sight for hypothesis in hypotheses],
        _touches(bench, hypotheses),
        scene.level.view.down,
        max(sigma, 1e-3),
    )


def _touches(bench: Workbench, hypotheses: Sequence[FaceHypothesis]) -> list[Touch]:
    """Return which face hypotheses of one instance meet in a visible edge."""
    camera = bench.pair.camera
    place = {hypothesis.piece: i for i, hypothesis in enumerate(hypotheses)}
    touches: list[Touch] = []
    for i, hypothesis in enumerate(hypotheses):
        piece = bench.scene.pieces[hypothesis.piece]
        j = place.get(hypothesis.piece + 1)
        if (
            j is None
            or not piece.convex_next
            or hypotheses[j].instance != hypothesis.instance
            or hypothesis.outline is None
        ):
            continue
        shared = [e for e in hypothesis.outline.edges if e.neighbour == hypotheses[j].piece and e.course == "upright"]
        if not shared:
            continue
        edge = max(shared, key=lambda e: e.line.length_px)
        ends = np.stack([edge.line.start, edge.line.stop])
        rays = np.ones((2, 3))
        rays[:, :2] = (ends - [camera.cx_px, camera.cy_px]) / camera.f_px
        slope = pixel_plane(hypothesis.sight.q_px - hypotheses[j].sight.q_px, camera)[:2]
        off_px = edge.sigma_px * float(np.hypot(slope[0], slope[1]))
        touches.append(Touch(one=i, other=j, rays=rays, off_px=off_px))
    return touches
