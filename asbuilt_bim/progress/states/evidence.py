"""What one station's depth says of points of the design's surface: there, seen through, hidden, or nothing."""

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache, partial

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rotate, unit
from asbuilt_bim.match.score import point_sigma_m
from asbuilt_bim.measure.depth_reference import unpack, unpack_occluder_free
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.colour import ConcreteColour, TintedPicture, tinted_picture
from asbuilt_bim.register.pose import PlacedStation, StationPose
from asbuilt_bim.register.scale import ScaleDoubt
from asbuilt_bim.vision.stereo.occluder_free import OCCLUDER_FREE_SIGMA_PX

AROUND_PX = 7
"""Reference pixels round one that the second look must see past all of: the matcher smears a bar over so many."""

FRAME = 0.02
"""Of the width, which a lens's distortion bends a rectified photo's border in. What stands so far left that the right
photo doesn't show it can only be matched with something farther: there "farther" says nothing of it."""


NO_TINTS = frozen(np.zeros((0, 2)))

_VIEWS_KEPT = 8  # open at once: as many as look at one place, mostly


class Verdict(IntEnum):
    """What a station's depth says of one sample."""

    NOT_FACED = 0  # out of the frame, too far, or turned away
    NOT_MEASURED = 1
    NEAR = 2  # the measured surface is there
    BEHIND = 3  # one sees through where it should be
    BEFORE = 4  # something stands before it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationView:
    """A placed station whose pictures are compressed still, and what concrete looks like there, where that is known."""

    placed: PlacedStation
    colour: ConcreteColour | None = None
    doubt: ScaleDoubt | None = None

    @property
    def pose(self) -> StationPose:
        """Return where the station stood."""
        return self.placed.pose

    @property
    def camera(self) -> RectifiedCamera:
        """Return the camera that its pixels are of."""
        return self.placed.measurement.camera


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenView:
    """A station's disparity in full-size pixels, NaN not measured, 0 sky; (h, w) in reference pixels.

    `occluder_free_px` (h, w) is the same with bars and other thin things taken out of the photos. `picture` is None
    where nothing is judged by its colour. All that takes 14 MB: it is opened to be asked, and let go.
    """

    pose: StationPose
    camera: RectifiedCamera
    disparity_px: Float32Array
    sigma_px: Float32Array
    scale: int
    occluder_free_px: Float32Array | None = None
    colour: ConcreteColour | None = None
    picture: TintedPicture | None = None
    faces: tuple[MeasuredFace, ...] = ()
    doubt: ScaleDoubt | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Faced:
    """Samples in a station's left frame: points and outward normals (N, 3), pixels (N, 2), and which it faces (n,)."""

    points: FloatArray
    facing: FloatArray
    pixels: FloatArray
    asked: NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """Verdicts (N,) uint8 of `Verdict`, and where each surface point lies along its normal (N,) in metres.

    Each is what the sample's own pixel says, whatever its neighbours do. `offset_m` (N,) is how far before the design
    its surface stands, `common_m` (N,) the error of it that all samples share, by the rig and the pose. `drop_m` (N,)
    is how far the line of sight falls within the tolerance: lower over its foot, a surface can't be distinguished from
    the ground behind it. `tinted` says where it can't be concrete, `through` where one sees past it between bars.
    """

    verdict: NDArray[np.uint8]
    offset_m: FloatArray
    common_m: FloatArray
    drop_m: FloatArray
    tinted: BoolArray
    through: BoolArray


@lru_cache(maxsize=_VIEWS_KEPT)
def open_view(view: StationView) -> OpenView:
    """Read a station's depth reference and its picture."""
    reference = view.placed.measurement.depth_ref
    disparity, sigma, scale = unpack(reference)
    return OpenView(
        pose=view.pose, camera=view.camera, disparity_px=disparity, sigma_px=sigma, scale=scale,
        occluder_free_px=_nearest(unpack_occluder_free(reference)), colour=view.colour,
        picture=tinted_picture(view.placed.measurement) if view.colour is not None else None,
        faces=view.placed.measurement.faces, doubt=view.doubt,
    )  # fmt: skip


def _nearest(disparity_px: Float32Array | None) -> Float32Array | None:
    """Return of a disparity (h, w) the largest round each pixel; NaN stays: shreds of bars left over make it err."""
    if disparity_px is None:
        return None
    known = np.isfinite(disparity_px)
    nearest = cv2.dilate(np.where(known, disparity_px, np.float32(0.0)), np.ones((AROUND_PX, AROUND_PX), np.uint8))
    return np.where(known, nearest, np.float32(np.nan)).astype(np.float32)


def faced(view: StationView, points_m: FloatArray, normals: FloatArray, options: ProgressOptions) -> Faced:
    """Say which world points (N, 3) of design surface with outward normals (N, 3) lie before a station."""
    left_from_world = inverse(view.pose.world_from_left)
    points, facing = apply(left_from_world, points_m), rotate(left_from_world, normals)
    pixels = view.camera.project(points)
    asked = np.flatnonzero(_faced(view, points, facing, pixels, options))
    return Faced(points=points, facing=facing, pixels=pixels, asked=asked)


def judge(
    view: OpenView,
    points_m: FloatArray,
    normals: FloatArray,
    seen: Faced,
    options: ProgressOptions,
    tints: FloatArray = NO_TINTS,
) -> Evidence:
    """Ask a station about world points (N, 3) of design surface with outward normals (N, 3), `seen` as `faced` says.

    `tints` (k, 2) are concrete's as well: those of faces that lie where only concrete does.

    Disparities are compared, where noise is even: the design's tangent plane at the sample predicts one. The tolerance
    is the building's, plus sigmas of the disparity, the rig and the pose, plus how far it may lie elsewhere where
    lengths are doubtful.
    """
    points, facing, pixels, asked = seen.points, seen.facing, seen.pixels, seen.asked
    verdict = np.full(len(points), Verdict.NOT_FACED, dtype=np.uint8)
    tinted, through = (np.zeros(len(points), dtype=bool) for _ in range(2))
    offset, common, drop = (np.full(len(points), np.inf) for _ in range(3))
    if len(asked):
        elsewhere = np.zeros(len(asked)) if view.doubt is None else view.doubt.reach_m(points_m[asked])
        tolerance = options.building_tolerance_m + elsewhere
        pose_sigma = point_sigma_m(view.pose, points_m[asked], normals[asked])
        both = _on_both(view, points[asked], pixels[asked])
        look = partial(_look, view, points[asked], facing[asked], pixels[asked], both, pose_sigma, tolerance, options)
        found = look(view.disparity_px, view.sigma_px)
        verdict[asked], offset[asked], common[asked] = found.verdict, found.offset_m, found.common_m
        blurred = options.sigmas * found.common_m + elsewhere > options.max_blur_m
        verdict[asked[blurred & (found.verdict == Verdict.NEAR)]] = Verdict.NOT_MEASURED
        towards = unit(points_m[asked] - view.pose.world_from_left[:3, 3])
        steepness = -towards[:, 2] / np.abs(np.sum(towards * normals[asked], axis=1))
        drop[asked] = np.maximum(steepness, 0.0) * (tolerance + options.sigmas * found.sigma_m)
        if view.occluder_free_px is not None:
            past = look(view.occluder_free_px, np.full_like(view.occluder_free_px, OCCLUDER_FREE_SIGMA_PX))
            through[asked] = past.verdict == Verdict.BEHIND
        if view.colour is not None and view.picture is not None:
            tinted[asked] = ~view.picture.fits(view.colour.palette.with_tints(tints), pixels[asked])
    return Evidence(verdict=verdict, offset_m=offset, common_m=common, drop_m=drop, tinted=tinted, through=through)


def _faced(
    view: StationView, points: FloatArray, facing: FloatArray, pixels: FloatArray, options: ProgressOptions
) -> BoolArray:
    distance = np.linalg.norm(points, axis=1)
    towards = -np.sum(points * facing, axis=1) / np.maximum(distance, 1e-9)
    with np.errstate(invalid="ignore"):
        inside = np.all((pixels >= -0.5) & (pixels < [view.camera.width_px - 0.5, view.camera.height_px - 0.5]), axis=1)
    turned = towards > np.cos(np.radians(options.max_incidence_deg))
    faced: BoolArray = inside & turned & (distance < options.max_distance_m)
    return faced


def _on_both(view: OpenView, points: FloatArray, pixels: FloatArray) -> BoolArray:
    """Say which points (N, 3) in the left frame, at pixels (N, 2), the right photo shows as well."""
    camera = view.camera
    depth = points @ camera.rectified_from_left[2]
    right: BoolArray = pixels[:, 0] - camera.f_px * camera.baseline_m / depth > FRAME * camera.width_px
    return right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Look:
    """What the pixels of n samples say, (n,) each, in metres."""

    verdict: NDArray[np.uint8]
    sigma_m: FloatArray
    offset_m: FloatArray
    common_m: FloatArray


def _look(
    view: OpenView,
    points: FloatArray,
    facing: FloatArray,
    pixels: FloatArray,
    both: BoolArray,
    pose_sigma: FloatArray,
    tolerance_m: FloatArray,
    options: ProgressOptions,
    disparity_px: Float32Array,
    sigma_px: Float32Array,
) -> _Look:
    height, width = disparity_px.shape
    column, row = np.clip(np.floor((pixels + 0.5) / view.scale).astype(int), 0, [width - 1, height - 1]).T
    measured, noise = (one[row, column].astype(np.float64) for one in (disparity_px, sigma_px))
    along = np.sum(view.camera.rays(pixels) * facing, axis=1)
    power = view.camera.f_px * view.camera.baseline_m
    predicted = power * along / np.sum(points * facing, axis=1)  # the tangent plane is linear in disparity
    with np.errstate(divide="ignore", invalid="ignore"):
        px_per_m = predicted**2 / (power * np.abs(along))  # of disparity, for a metre along the normal
        allowed = options.sigmas * np.hypot(noise, pose_sigma * px_per_m) + tolerance_m * px_per_m
        off = measured - predicted
        sigma = np.hypot(noise / px_per_m, pose_sigma)  # what the rig errs by in common is in the noise
        common = np.hypot(options.rig_sigma_px / px_per_m, pose_sigma)
    verdict = np.full(measured.shape, Verdict.NEAR, dtype=np.uint8)
    verdict[off < -allowed] = Verdict.BEHIND
    verdict[off > allowed] = Verdict.BEFORE
    verdict[~np.isfinite(measured) | (along >= 0.0)] = Verdict.NOT_MEASURED
    verdict[(verdict == Verdict.BEHIND) & ~both] = Verdict.NOT_MEASURED
    return _Look(verdict=verdict, sigma_m=sigma, offset_m=off / px_per_m, common_m=common)
