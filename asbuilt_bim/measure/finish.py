"""A settled plane and outline become a `MeasuredFace`: Green's theorem in the face's own plane, and sigma."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.disparity_plane import plane_of
from asbuilt_bim.geometry.masks import at_pixels, nonzero
from asbuilt_bim.geometry.plane import PlaneFrame, frame_on_plane
from asbuilt_bim.geometry.polygon import polygon, ring_area, rings_area
from asbuilt_bim.geometry.transform import rigid
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.outline.border import border_sides, flat_surface
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.ends import End, Ends, judge_ends
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline
from asbuilt_bim.measure.planes.face_hypotheses import FaceHypothesis
from asbuilt_bim.measure.sigma.area import RigPart, area_per_pixel_m2, image_sigma_m2
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Settled:
    """A face hypothesis whose plane (q, covariance) and outline are final."""

    hypothesis: FaceHypothesis
    q_px: FloatArray
    covariance: FloatArray
    outline: Outline


def finish_face(
    bench: Workbench, settled: Settled, face_id: str, instance: Instance, by_rig: RigPart
) -> MeasuredFace | None:
    """Build the metric face in the LEFT frame; None where its outline encloses nothing on its plane."""
    camera = bench.pair.camera
    frame, rings_uv = outline_on_plane(settled.outline.rings, settled.q_px, camera, bench.scene.level.view.down)
    region = polygon(rings_uv)
    if not region or not np.isfinite(rings_area(rings_uv)):
        return None
    clean = max(region, key=rings_area)
    rings_px = tuple(frozen(camera.project(frame.from_uv(ring))) for ring in clean)
    area = ring_area(clean[0]) + sum(ring_area(ring) for ring in clean[1:])
    low, high = clean[0].min(axis=0), clean[0].max(axis=0)
    centroid = frame.from_uv(clean[0].mean(axis=0))
    sides = border_sides(settled.outline)
    ends = judge_ends(bench, sides, flat_surface(pixel_plane(settled.q_px, camera), settled.hypothesis.piece))
    return MeasuredFace(
        face_id=face_id,
        label=instance.label,
        score=instance.score,
        source=instance.source,
        segmenter=instance.segmenter,
        frame=frame,
        outline_uv_m=clean,
        outline_px=rings_px,
        area_m2=float(area),
        area_sigma_calibration_m2=by_rig.area_sigma_m2,
        area_sigma_image_m2=_image_sigma(settled, ends, camera),
        area_sigma_open_m2=_open_sigma(settled, ends, camera) if instance.source is not InstanceSource.GIVEN else 0.0,
        covariance=frozen(plane_covariance(settled.q_px, settled.covariance, frame, centroid, camera)),
        covariance_calibration=frozen(plane_covariance(settled.q_px, by_rig.q_covariance, frame, centroid, camera)),
        width_m=float(high[0] - low[0]),
        height_m=float(high[1] - low[1]),
        width_px=float(min(cv2.minAreaRect(rings_px[0].astype(np.float32))[1])),
        distance_m=float(np.linalg.norm(centroid)),
        cut_by_frame=ends.cut_by_frame,
        occluded=ends.occluded,
        open_edge=ends.open_edge,
        whole_probability=ends.probability,
        flatness_rms_m=_flatness(bench, settled),
        instance=settled.hypothesis.instance,
    )


def outline_on_plane(
    rings_px: Sequence[FloatArray], q_px: FloatArray, camera: RectifiedCamera, down_rectified: FloatArray
) -> tuple[PlaneFrame, tuple[FloatArray, ...]]:
    """Carry an outline to the plane: a frame in the LEFT frame, rings (N, 2) in metres, the outer counter-clockwise."""
    rectified = plane_of(q_px, camera.f_px * camera.baseline_m)
    plane = rectified.moved(rigid(camera.rectified_from_left.T, np.zeros(3)))
    up = -down_rectified @ camera.rectified_from_left
    points = [plane.intersect(np.zeros(3), camera.rays(ring)) for ring in rings_px]
    frame = frame_on_plane(plane, points[0].mean(axis=0), up)
    rings = [frame.to_uv(p) for p in points]
    turned = [frozen(ring if (ring_area(ring) > 0.0) == (i == 0) else ring[::-1]) for i, ring in enumerate(rings)]
    return frame, tuple(turned)


def plane_covariance(
    q_px: FloatArray, covariance: FloatArray, frame: PlaneFrame, centroid_m: FloatArray, camera: RectifiedCamera
) -> FloatArray:
    """Carry q's covariance to [offset along the normal (m), tilts about u and v (rad)] at the centroid, left frame."""
    length = float(np.linalg.norm(q_px))
    turn = camera.rectified_from_left
    n = -q_px / length
    by_q = -(np.eye(3) - np.outer(n, n)) / length  # of the unit normal, rectified
    by_q_left = turn.T @ by_q
    offset_by_q = camera.f_px * camera.baseline_m / length**2 * (q_px / length) - centroid_m @ by_q_left
    jacobian = np.stack([offset_by_q, -frame.v @ by_q_left, frame.u @ by_q_left])
    carried: FloatArray = jacobian @ covariance @ jacobian.T
    return carried


def _image_sigma(settled: Settled, ends: Ends, camera: RectifiedCamera) -> float:
    outline = settled.outline
    edges = [
        (0.5 * (e.line.start + e.line.stop), e.line.length_px, _side_sigma_px(e, ends.of_edge(k)))
        for k, e in enumerate(outline.edges)
    ]
    around = sum(float(np.linalg.norm(np.diff(r, axis=0, append=r[:1]), axis=1).sum()) for r in outline.rings)
    free = max(0.0, around - sum(length for _, length, _ in edges))
    return image_sigma_m2(outline.rings, edges, free, settled.q_px, settled.covariance, camera)


def _side_sigma_px(edge: FaceEdge, end: End) -> float:
    """Return how far a side may lie off: one that only a mask draws is as rough as that.

    Where it isn't the face's end, that lies anywhere up to what is seen not to be the face, as far as is looked nearby.
    """
    if edge.source != "mask":
        return edge.sigma_px
    return float(np.sqrt(edge.sigma_px**2 + (1.0 - end.probability) * end.open_px**2 / 12.0))


def _open_sigma(settled: Settled, ends: Ends, camera: RectifiedCamera) -> float:
    """Return what the sides leave open farther off, in m2, where neither a photo nor anything near shows an end."""
    variance_m4 = 0.0
    for edge, end in ((edge, ends.of_edge(k)) for k, edge in enumerate(settled.outline.edges) if edge.source == "mask"):
        middle = 0.5 * (edge.line.start + edge.line.stop)
        pixels_m2 = edge.line.length_px * area_per_pixel_m2(middle, settled.q_px, camera)
        variance_m4 += (1.0 - end.probability) * (end.far_px**2 - end.open_px**2) * pixels_m2**2 / 12.0
    return float(np.sqrt(variance_m4))


def _flatness(bench: Workbench, settled: Settled) -> float:
    """Return how far the measured surface scatters about its plane, along the normal, in metres."""
    level = bench.scene.level
    rows, columns = nonzero(settled.hypothesis.mask)
    known = level.measured[rows, columns]
    rows, columns = rows[known], columns[known]
    if rows.size < 10:
        return 0.0
    expected = at_pixels(level.rays, rows, columns) @ settled.q_px
    miss = level.disparity_px[rows, columns] - expected
    miss = miss[np.abs(miss) < 1.0]
    if miss.size == 0:
        return 0.0
    height = bench.pair.camera.f_px * bench.pair.camera.baseline_m / float(np.linalg.norm(settled.q_px))
    return float(height * np.sqrt(np.mean(miss**2)) / np.mean(expected))
