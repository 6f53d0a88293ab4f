"""The as-built area of a design face: the union of all stations' outlines in its plane, never their sum."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.surface import SurfaceState

OF_WHOLE = 0.05
"""Outlines may reach past a face that was seen whole by this share of it: their borders' noise."""
APART_SIGMAS = 3.0
"""Stations whose areas of one whole face differ by more than this are flagged."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AsBuilt:
    """What was measured of one design face; None and 0 where nothing was."""

    outline_uv_m: Region
    area_m2: float | None
    sigma_calibration_m2: float
    sigma_image_m2: float
    offset_m: float | None
    offset_sigma_m: float | None
    tilt_rad: float | None
    tilt_sigma_rad: float | None = None
    notes: tuple[Note, ...] = ()
    whole: bool = False  # stations saw it whole, now, or earlier with nothing of it open


def as_built(matches: Sequence[FaceMatch], earlier: SurfaceState | None, design: DesignFace) -> AsBuilt:
    """Put a face's measurements together, this visit's and what earlier visits left.

    Measured whole by several stations: the mean by inverse variance of the image part, the calibration part in common.
    Otherwise the area of the outlines' union within the design's border, each outline with its own plane's area. Where
    a face was seen in part, a side that isn't its end may lie past it, and the area is a lower bound.
    """
    earlier = replace(earlier, whole=False) if earlier and earlier.open_uv_m else earlier  # that may have risen since
    if not matches:
        return _as_it_was(earlier)
    before = earlier.outline_uv_m if earlier is not None else polygon.EMPTY
    outline = polygon.union([before, *(match.outline_uv_m for match in matches)])
    offset, offset_sigma = _offset(matches)
    tilt, tilt_sigma = _tilt(matches)
    area, notes, whole = _area(outline, matches, earlier, design)
    return AsBuilt(
        outline_uv_m=outline, whole=whole, area_m2=area.m2, sigma_calibration_m2=area.sigma_calibration_m2,
        sigma_image_m2=area.sigma_image_m2, offset_m=offset, offset_sigma_m=offset_sigma, tilt_rad=tilt,
        tilt_sigma_rad=tilt_sigma, notes=notes,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Area:
    m2: float
    sigma_calibration_m2: float
    sigma_image_m2: float


def _area(
    outline: Region, matches: Sequence[FaceMatch], earlier: SurfaceState | None, design: DesignFace
) -> tuple[_Area, tuple[Note, ...], bool]:
    """Return the area, what to note of it, and whether stations saw it whole: these count while no more is outlined.

    Seen whole, the rest adds its border noise only, unless it is clearly more: then "whole" was mistaken.
    """
    union = _union_area(outline, matches)
    relative, image = _calibration_share(matches), _joint_sigma(matches, union)
    seen_whole = [match for match in matches if match.whole]
    notes: tuple[Note, ...] = ()
    if seen_whole:
        mean, sigma, notes = _combined(seen_whole)
        was = earlier.as_built_sigma_image_m2 if earlier is not None else 0.0  # of what it outlined in the union
        if union - mean <= APART_SIGMAS * float(np.linalg.norm([sigma, image, was])) + OF_WHOLE * mean:
            calibration = mean * _calibration_share(seen_whole)
            return _Area(m2=mean, sigma_calibration_m2=calibration, sigma_image_m2=sigma), notes, True
    if isinstance(design.frame, PlaneFrame):
        union = _union_area(polygon.intersection(outline, design.exposed_uv_m), matches)
        image = _joint_sigma(matches, union)
    before = earlier.as_built_area_m2 if earlier is not None else None
    if earlier is not None and before is not None:  # what was measured then keeps its sigma, what is more has its own
        was = earlier.as_built_sigma_image_m2
        if earlier.whole and union - before <= APART_SIGMAS * float(np.hypot(was, image)) + OF_WHOLE * before:
            calibration = earlier.as_built_sigma_calibration_m2
            return _Area(m2=before, sigma_calibration_m2=calibration, sigma_image_m2=was), notes, True
        image = float(np.hypot(was, _joint_sigma(matches, max(union - before, 0.0))))
    return _Area(m2=union, sigma_calibration_m2=union * relative, sigma_image_m2=image), notes, False


def _as_it_was(earlier: SurfaceState | None) -> AsBuilt:
    if earlier is None:
        return AsBuilt(
            outline_uv_m=(), area_m2=None, sigma_calibration_m2=0.0, sigma_image_m2=0.0,
            offset_m=None, offset_sigma_m=None, tilt_rad=None,
        )  # fmt: skip
    return AsBuilt(
        outline_uv_m=earlier.outline_uv_m,
        area_m2=earlier.as_built_area_m2,
        sigma_calibration_m2=earlier.as_built_sigma_calibration_m2,
        sigma_image_m2=earlier.as_built_sigma_image_m2,
        offset_m=earlier.offset_m,
        offset_sigma_m=earlier.offset_sigma_m,
        tilt_rad=earlier.tilt_rad,
        tilt_sigma_rad=earlier.tilt_sigma_rad,
        whole=earlier.whole,
    )


def _union_area(outline: Region, matches: Sequence[FaceMatch]) -> float:
    """Return the union's area, scaled from the design's plane to the measured planes, which it is a projection of."""
    projected = sum(polygon.area(match.outline_uv_m) for match in matches)
    own = sum(match.area_m2 for match in matches)
    return polygon.area(outline) * own / max(projected, 1e-9)


def _combined(whole: Sequence[FaceMatch]) -> tuple[float, float, tuple[Note, ...]]:
    areas = np.array([match.area_m2 for match in whole])
    sigmas = np.maximum([match.area_sigma_image_m2 for match in whole], 1e-4 * areas)
    weights = 1.0 / sigmas**2
    mean = float(weights @ areas / weights.sum())
    apart = np.abs(areas - mean) > APART_SIGMAS * sigmas
    notes = tuple(
        noted(
            Reason.AREAS_APART,
            about(SubjectKind.FACE, match.face_id, match.station),
            area_m2=match.area_m2,
            mean_m2=mean,
            sigmas=APART_SIGMAS,
        )
        for match, far in zip(whole, apart, strict=True)
        if far
    )
    spread = float(np.sqrt(weights @ (areas - mean) ** 2 / weights.sum())) if notes else 0.0
    return mean, max(float(weights.sum() ** -0.5), spread), notes


def _joint_sigma(matches: Sequence[FaceMatch], total_m2: float) -> float:
    sigmas = float(np.linalg.norm([match.area_sigma_image_m2 for match in matches]))
    return sigmas * total_m2 / max(sum(match.area_m2 for match in matches), 1e-9)


def _calibration_share(matches: Sequence[FaceMatch]) -> float:
    return float(np.mean([match.area_sigma_calibration_m2 / max(match.area_m2, 1e-9) for match in matches]))


def _offset(matches: Sequence[FaceMatch]) -> tuple[float, float]:
    sigmas = np.maximum([match.offset_sigma_m for match in matches], 1e-4)
    weights = 1.0 / sigmas**2
    offset = float(weights @ [match.offset_m for match in matches] / weights.sum())
    return offset, float(weights.sum() ** -0.5)


def _tilt(matches: Sequence[FaceMatch]) -> tuple[float | None, float | None]:
    """Return the mean tilt by area with its sigma, None where no station knows it."""
    known = [(m.area_m2, m.tilt_rad, m.tilt_sigma_rad) for m in matches if m.tilt_rad is not None]
    if not known:
        return None, None
    areas = np.array([area for area, _, _ in known])
    tilt = float(areas @ [one for _, one, _ in known] / areas.sum())
    sigmas = np.array([sigma for _, _, sigma in known if sigma is not None])
    return tilt, float(np.linalg.norm(areas * sigmas) / areas.sum()) if len(sigmas) == len(areas) else None
