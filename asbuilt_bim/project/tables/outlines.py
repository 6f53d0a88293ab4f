"""Outlines of people that somebody drew in left photos: blurred in every picture that a run writes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import date

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import MaskError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.tables.places import MOST_PIXEL, known_station, number_of
from asbuilt_bim.storage.table_file import Columns, day_in, read_table, refused_rows
from asbuilt_bim.vision.masks.bounds import check_outlines
from asbuilt_bim.vision.masks.given import GivenMask, mask_of
from asbuilt_bim.vision.masks.people import pixelated

OUTLINES: Columns = {
    "date": ("day", "datum", "visit"),
    "station": ("name",),
    "outline": ("polygon", "person"),
    "x_px": ("column", "u", "x"),
    "y_px": ("row", "v", "y"),
}
"""What a column of outlines may be called."""
QUALITY = 85


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outline:
    """Round a person in a station's left photo as it was taken: `photo_px` (N, 2); a `day` of None is every visit's."""

    day: date | None
    station: str
    photo_px: FloatArray


def read_outlines(project: Project, size_px: tuple[int, int]) -> tuple[Outline, ...]:
    """Read the outlines that a project names, none where it names no table; `size_px` is the left photos' size.

    Raises:
        MaskError: the table can't be used; every row that is wrong is named, up to eight.
    """
    if project.people is None:
        return ()
    table = read_table(project.people, OUTLINES, ("station", "outline", "x_px", "y_px"), MaskError)
    points: dict[tuple[date | None, str, str], list[list[float]]] = {}
    faults: list[str] = []
    for row in table.rows:
        try:
            known_station(project, row)
            key = day_in(row, "date"), row.text("station").strip(), row.text("outline").strip()[:60]
            pixel = [number_of(row, axis, table, -MOST_PIXEL, MOST_PIXEL) for axis in ("x_px", "y_px")]
            points.setdefault(key, []).append(pixel)
        except ValueError as problem:
            faults.append(f"row {row.number}: {problem}")
    for (_, station, name), ring in points.items():
        what = f"outline '{name}' of '{station[:60]}'"
        if len(ring) < 3:
            faults.append(f"{what} has {len(ring)} points; three or more are expected")
        elif outside_photo(np.array(ring), size_px):
            faults.append(
                f"{what} lies beside its photo of {size_px[0]} x {size_px[1]} px, so nobody would be hidden; "
                "draw it in the left photo as it was taken"
            )
    refused_rows(project.people, faults, MaskError)
    found = tuple(Outline(day=day, station=name, photo_px=frozen(ring)) for (day, name, _), ring in points.items())
    try:
        check_outlines([_as_mask(one.photo_px) for one in found])
    except MaskError as problem:
        raise MaskError(f"{project.people}: {problem}") from problem
    return found


def outside_photo(ring: FloatArray, size_px: tuple[int, int]) -> bool:
    """Say whether an outline (N, 2) in pixels lies wholly beside a photo of so many columns and rows."""
    return bool((ring.max(axis=0) < -0.5).any() or (ring.min(axis=0) > np.array(size_px) - 0.5).any())


def without_outlined(
    pictures: Mapping[str, bytes],
    outlines: Iterable[Outline],
    day: date,
    rig: StereoRig,
    measured: Iterable[StationMeasurement],
) -> dict[str, bytes]:
    """Return a visit's pictures by station (JPEG, rectified) with all that outlines hold in coarse cells.

    A station that wasn't measured has no known camera: its picture is left out where an outline is of it.
    """
    cameras = {one.station: one.camera for one in measured}
    shown = dict(pictures)
    for name in {one.station for one in outlines if one.day in (None, day)} & shown.keys():
        own = [one.photo_px for one in outlines if one.station == name and one.day in (None, day)]
        if name not in cameras or not (done := _blurred(shown[name], own, rig, cameras[name])):
            del shown[name]
        else:
            shown[name] = done
    return shown


def _as_mask(ring: FloatArray) -> GivenMask:
    return GivenMask(label="wall", name="an outline", polygons=((ring,),))  # a mask has a class; nothing asks for it


def _blurred(jpeg: bytes, outlines: Iterable[FloatArray], rig: StereoRig, camera: RectifiedCamera) -> bytes:
    """Return a picture again, b"" where it can't be read or made."""
    image = cv2.imdecode(np.frombuffer(jpeg, dtype=np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        return b""
    height, width = image.shape[:2]
    scale = width / camera.width_px
    small = replace(
        camera, f_px=camera.f_px * scale, cx_px=(camera.cx_px + 0.5) * scale - 0.5,
        cy_px=(camera.cy_px + 0.5) * scale - 0.5, width_px=width, height_px=height,
    )  # fmt: skip
    picture = np.asarray(image, dtype=np.uint8)
    for ring in outlines:  # one by one: two people who touch have faces of their own
        people = mask_of(_as_mask(ring), rig.left, small)
        picture = pixelated(picture, people) if people.any() else picture
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return data.tobytes() if done else b""
