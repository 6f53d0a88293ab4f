"""Does a photo show what another station's photo shows, to the pixel? Then it is that photo, saved again maybe.

Two photos of one place differ by where the camera stood, by the light and by what was built. A photo that is saved
again, smaller or brighter or without EXIF, differs from itself by its compression alone. Only frames of a rig that
stood still, taken seconds apart, differ as little; such frames are one visit's, and of one station.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from types import MappingProxyType

import cv2
import numpy as np

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station_photos import SAME_SHARE

SIDE = 16
"""Pixels: the side of the coarse picture that all photos are compared by, and of the blocks of the finer one."""
FINE = 4
"""The finer picture is smaller than the kept one by this: compression's errors and grain are averaged, edges stay."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """What a station's left photo shows: coarsely, without its brightness and contrast; and the kept JPEG."""

    day: date
    station: str
    coarse: FloatArray  # (SIDE * SIDE,), mean 0, norm 1
    step: float  # by how much the coarse picture differs from itself, moved by one of its pixels
    jpeg: bytes
    says_day: bool = False  # whether the photos say that they were taken on that day


Photographed = tuple[date, str]
"""A station of a visit."""
NONE_BORROWED: Mapping[Photographed, Rejection] = MappingProxyType({})


def shown(day: date, station: str, jpeg: bytes, *, says_day: bool = False) -> Shown | None:
    """Return what a kept picture shows; None where it can't be decoded, or is all of one grey."""
    picture = _grey(jpeg)
    if picture is None:
        return None
    small = cv2.resize(picture, (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float64)
    small -= small.mean()
    norm = float(np.linalg.norm(small))
    if norm == 0.0:
        return None
    small /= norm
    step = float(np.linalg.norm(small[:, 1:] - small[:, :-1]))
    return Shown(day=day, station=station, coarse=small.ravel(), step=step, jpeg=jpeg, says_day=says_day)


def shown_before(seen: Shown, earlier: Sequence[Shown]) -> Shown | None:
    """Return the first of the earlier photos that is this one, None where none is."""
    if not earlier:
        return None
    alike = np.clip(np.array([one.coarse for one in earlier]) @ seen.coarse, -1.0, 1.0)
    apart = np.sqrt(2.0 - 2.0 * alike)
    near = (one for one, off in zip(earlier, apart, strict=True) if off < SAME_SHARE * seen.step)
    return next((one for one in near if _is_same(seen.jpeg, one.jpeg)), None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Twins:
    """What a visit's stations show again, and what all stations showed: of two that show the same one is remembered."""

    refused: dict[str, Rejection]  # by station of the visit: why its photos aren't its own
    borrowed: dict[Photographed, Rejection]  # the same of stations of earlier visits
    known: tuple[Shown, ...]


def stations_shown_before(
    day: date, pictures: Mapping[str, bytes], earlier: Iterable[Shown], of_its_day: Collection[str] = ()
) -> Twins:
    """Return which stations have another one's photos.

    `pictures` are the visit's by station, in its order; photos of the stations `of_its_day` say that they were taken
    then. Of two stations the one whose photos say their day is believed, else the one that comes first.
    """
    known = list(earlier)
    refused: dict[str, Rejection] = {}
    borrowed: dict[Photographed, Rejection] = {}
    for station in sorted(pictures, key=lambda name: name not in of_its_day):
        seen = shown(day, station, pictures[station], says_day=station in of_its_day)
        if seen is None:
            continue
        twin = shown_before(seen, known)
        if twin is not None and (twin.says_day or not seen.says_day):
            refused[station] = _again(seen, twin)
            continue
        if twin is not None:
            borrowed[twin.day, twin.station] = _again(twin, seen)
            known.remove(twin)
        known.append(seen)
    return Twins(refused=refused, borrowed=borrowed, known=tuple(known))


def _again(one: Shown, own: Shown) -> Rejection:
    """Return why a station's photos aren't its own."""
    return rejected(
        Reason.PHOTOS_OF_OTHER_STATION if one.jpeg == own.jpeg else Reason.PHOTOS_SAVED_AGAIN,
        about(SubjectKind.STATION, one.station),
        other=own.station,
        other_visit="" if one.day == own.day else own.day.isoformat(),
    )


def _is_same(one: bytes, other: bytes) -> bool:
    """Compare two pictures finely: no block differs by as much as a move of one pixel makes.

    Brightness and contrast are fitted by a curve, since programs change them when they save.
    """
    first, second = _fine(_grey(one)), _fine(_grey(other))
    if first is None or second is None or first.shape != second.shape:
        return False
    scaled = second / 255.0
    curve = np.polynomial.Polynomial.fit(scaled.ravel(), first.ravel(), deg=3, domain=[0.0, 1.0])
    off = np.abs(first - curve(scaled))
    step = float(np.abs(first[:, 1:] - first[:, :-1]).mean())
    rows, columns = (max(side // SIDE, 1) for side in off.shape)
    blocks = cv2.resize(off, (columns, rows), interpolation=cv2.INTER_AREA)
    return bool(blocks.max() < step)


def _fine(picture: FloatArray | None) -> FloatArray | None:
    if picture is None:
        return None
    size = max(picture.shape[1] // FINE, 1), max(picture.shape[0] // FINE, 1)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.float64)


def _grey(jpeg: bytes) -> FloatArray | None:
    picture = cv2.imdecode(np.frombuffer(jpeg, dtype=np.uint8), cv2.IMREAD_GRAYSCALE) if jpeg else None
    return None if picture is None else np.asarray(picture, dtype=np.float64)
