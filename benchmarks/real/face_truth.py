"""Measured faces beside the truth's planes, and the truth's regions beside what was measured of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.disparity_plane import plane_of
from asbuilt_bim.geometry.plane import Plane, PlaneFrame
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement, seen
from asbuilt_bim.measure.planes.face_hypotheses import filled
from asbuilt_bim.measure.sigma.area import polygon_area
from benchmarks.real.given_pixels import UNKNOWN, Rectified, given_pixels
from benchmarks.real.laser_truth import plain_disparity
from benchmarks.real.shots import Shot
from benchmarks.real.truth_planes import (
    CAMERA_DOWN,
    PLAIN,
    Region,
    angle_deg,
    is_upright,
    plane_within,
    upright_regions,
)

WITHIN = {1: 0.6827, 2: 0.9545}
REJECT_AT = 0.05
COVERED_SHARE = 0.5
"""Of a region: a face that covers less of it didn't find it."""
NOT_MEASURABLE = frozenset({
    Reason.FACE_UNCERTAIN, Reason.FACE_WITHOUT_END, Reason.FACE_NARROW, Reason.SURFACE_TOO_FAR
})  # fmt: skip
"""What says of something seen that it can't be measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceCase:
    """A measured face beside the truth's plane in its own outline; figures are NaN where truth has no plane there."""

    scene: str
    face_id: str
    label: str
    seen: str
    area_m2: float
    sigma_m2: float
    truth_m2: float
    offset_m: float  # of the face's middle from the truth's plane
    tilt_deg: float
    upright: bool  # the truth's plane
    plane_share: float  # of the truth's pixels within the outline, on that one plane
    width_px: float
    distance_m: float
    given_z: float  # the area's error in sigmas, had the truth told which pixels lie on the plane
    given_tilt_deg: float

    @property
    def z(self) -> float:
        """Return the area's error in its own sigmas."""
        return (self.area_m2 - self.truth_m2) / self.sigma_m2

    @property
    def error(self) -> float:
        """Return the area's error as a share of the true area."""
        return self.area_m2 / self.truth_m2 - 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionCase:
    """An upright planar region of the truth: `became` measured, said (not measurable), or missed."""

    scene: str
    became: str
    area_m2: float
    side_px: float
    distance_m: float
    covered: float  # by the one face that covers most of it
    face_id: str
    sigma_share: float  # that face's sigma of its area; NaN where none


def not_rejected(sigmas: int, z: FloatArray) -> tuple[int, float, bool]:
    """Return how many of the errors (in sigmas) lie within, the binomial p, and whether sigma may be right by it."""
    within = int(np.count_nonzero(np.abs(z) <= sigmas))
    if not len(z):
        return 0, 1.0, False
    p = float(binomtest(within, len(z), WITHIN[sigmas]).pvalue)
    return within, p, p >= REJECT_AT


def face_case(scene: str, shot: Shot, found: PairMeasurement, face: MeasuredFace, ready: Rectified) -> FaceCase:
    """Hold a flat face against the plane that most of the truth within its outline lies on."""
    assert shot.truth_px is not None and isinstance(face.frame, PlaneFrame)
    mask = filled(found.photo_outline_px(face), shot.truth_px.shape)
    truth = plane_within(shot.truth_px, shot.rays(), mask)
    true_m2, offset, tilt, given = float("nan"), float("nan"), float("nan"), UNKNOWN
    if truth is not None:
        plane = plane_of(truth.q_px, shot.focal_baseline)
        true_m2 = area_on(plane, [found.detail.pair.camera.rays(ring) for ring in face.outline_px])
        offset, tilt = float(plane.distance_m(middle(face))), angle_deg(plane.normal, face.frame.normal)
        given = given_pixels(shot, found, ready, face, truth, mask)
    return FaceCase(
        scene=scene, face_id=face.face_id, label=face.label, seen=seen(face, found.options.method),
        area_m2=face.area_m2, sigma_m2=face.area_sigma_m2, truth_m2=true_m2, offset_m=offset, tilt_deg=tilt,
        upright=truth is not None and is_upright(truth.q_px),
        plane_share=truth.share if truth is not None else float("nan"), width_px=face.width_px,
        distance_m=face.distance_m, given_z=(given.area_m2 - true_m2) / given.sigma_m2,
        given_tilt_deg=given.tilt_deg,
    )  # fmt: skip


def region_case(
    scene: str,
    region: Region,
    faces: Sequence[tuple[MeasuredFace, BoolArray]],
    said: Sequence[BoolArray],
) -> RegionCase:
    """Say what became of a region, by the face that covers most of it; `faces`, `said`: with pixels in its raster."""
    shares = [(_covered(region.mask, mask), face) for face, mask in faces]
    covered, best = max(shares, key=lambda one: one[0], default=(0.0, None))
    measured = best is not None and covered >= COVERED_SHARE
    named = any(_covered(region.mask, mask) >= COVERED_SHARE for mask in said)
    return RegionCase(
        scene=scene, became="measured" if measured else "said" if named else "missed", area_m2=region.area_m2,
        side_px=region.side_px, distance_m=region.distance_m, covered=covered,
        face_id=best.face_id if best is not None and covered > 0.0 else "",
        sigma_share=best.area_sigma_m2 / best.area_m2 if best is not None and measured else float("nan"),
    )  # fmt: skip


def regions_by_truth(scene: str, shot: Shot, found: PairMeasurement | None) -> list[RegionCase]:
    """Say what became of the truth's regions; `found` None: the pair was refused."""
    assert shot.truth_px is not None
    shape, faces, said = shot.truth_px.shape, list[tuple[MeasuredFace, BoolArray]](), list[BoolArray]()
    if found is not None:
        faces = [(face, filled(found.photo_outline_px(face), shape)) for face in found.faces]
        said = said_of(found, shape)
    return [
        region_case(scene, region, faces, said)
        for region in upright_regions(shot.truth_px, shot.rays(), shot.focal_baseline)
    ]


def regions_by_plain_matching(scene: str, found: PairMeasurement) -> list[RegionCase]:
    """Say what became of the regions that plain matching shows where there is no truth."""
    pair, regions = found.detail.pair, plain_regions(found)
    shape = pair.valid_left.shape
    faces, said = (
        [(face, filled(face.outline_px, shape)) for face in found.faces],
        said_of(found, shape, rectified=True),
    )
    return [region_case(scene, one, faces, said) for one in regions]


def plain_regions(found: PairMeasurement) -> list[Region]:
    """Return the upright planar regions by plain matching, in the rectified photo."""
    pair, up = found.detail.pair, found.detail.measurement.vertical
    camera = pair.camera
    down = CAMERA_DOWN if up is None else -camera.rectified_from_left @ up
    rows, columns = np.indices(pair.valid_left.shape)
    left_rays = camera.rays(np.stack([columns, rows], axis=-1).astype(np.float64))
    rays = left_rays @ camera.rectified_from_left.T
    return upright_regions(plain_disparity(pair), rays, camera.f_px * camera.baseline_m, PLAIN, down)


def said_of(found: PairMeasurement, shape: tuple[int, ...], *, rectified: bool = False) -> list[BoolArray]:
    """Return where (H, W) the program said "seen and not measurable", in the original left photo or the rectified one.

    A rejection tells its place in `box_px` (x0, y0, x1, y1) of the rectified photo. One without it can't be held
    against a place, so it doesn't count.
    """
    rings = [ring for one in found.rejections if (ring := _ring_of(one)) is not None]
    if not rectified:
        rings = [found.rig.left.project(found.detail.pair.camera.rays(ring)) for ring in rings]
    return [filled([ring], shape) for ring in rings]


def _ring_of(one: Rejection) -> FloatArray | None:
    box = one.values.get("box_px")
    if one.code not in NOT_MEASURABLE or not isinstance(box, tuple) or len(box) != 4:
        return None
    x0, y0, x1, y1 = box
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=np.float64)


def area_on(plane: Plane, rings: Sequence[FloatArray]) -> float:
    """Return the area on a plane of rings of rays (N, 3), the first the outer one."""
    areas = [polygon_area(plane.intersect(np.zeros(3), ring)) for ring in rings]
    return areas[0] - sum(areas[1:])


def middle(face: MeasuredFace) -> FloatArray:
    """Return the mean of a flat face's corners (3,) in the left frame."""
    assert isinstance(face.frame, PlaneFrame)
    return face.frame.from_uv(face.outline_uv_m[0].mean(axis=0))


def _covered(region: BoolArray, mask: BoolArray) -> float:
    return float(np.count_nonzero(region & mask)) / max(float(np.count_nonzero(region)), 1.0)
