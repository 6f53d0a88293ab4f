"""Photos that no project file names yet: today's, as they come from the camera, made into stations."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from asbuilt_bim.errors import OptionError, PhotoError
from asbuilt_bim.project.found import PICTURES, VIDEOS, name_of, partner_of, photos_in
from asbuilt_bim.project.model import Project, Station
from asbuilt_bim.project.stations import counted
from asbuilt_bim.storage.regular_file import file_alike


def stations_of(photos: Sequence[Path], project: Project) -> tuple[Station, ...]:
    """Return the stations in a folder of photos, or in photos named in pairs: left, right, left, right.

    Where the project's own photos hold both eyes in one file, so do these. A photo without its partner stays a
    station, whose other photo is missing.

    Raises:
        OptionError: what is named isn't there, or is no folder, and no pairs.
        PhotoError: the folder holds no photos, or nobody can tell which camera took them.
    """
    known = [station for visit in project.visits for station in visit.stations]
    side_by_side = bool(known) and all(station.side_by_side for station in known)
    if len(photos) == 1 and not photos[0].exists():
        alike = file_alike(photos[0], folders=True)
        raise OptionError(f"{photos[0]}: there is no such folder or file{alike}; check the path")
    if len(photos) == 1 and photos[0].is_dir():
        return _in_folder(photos[0], side_by_side=side_by_side)
    folders = [path for path in photos if path.is_dir()]
    if folders:
        raise OptionError(f"{folders[0]}: is a folder; name one folder alone, or photos in pairs")
    if side_by_side:
        return _named_apart([Station(name=path.stem, left=path, right=path) for path in photos])
    if len(photos) % 2:
        raise OptionError(_odd(photos))
    pairs = zip(photos[::2], photos[1::2], strict=True)
    named = [Station(name=name_of(left, right), left=left, right=right) for left, right in pairs]
    if twice := next((one.name for one in named if one.left == one.right), ""):
        raise OptionError(f"{twice}: is named as left and as right photo")
    return _named_apart(named)


def _odd(photos: Sequence[Path]) -> str:
    """Say why an odd number of photos are no pairs, and of one alone which is missing."""
    if len(photos) > 1:
        return f"{len(photos)} photos are no pairs; name a folder, or left and right in turn"
    pair = partner_of(photos[0])
    other = "the other eye's" if pair is None else next(one.name for one in pair if one != photos[0])
    return f"{photos[0].name} alone is no pair; name {other} too, or the folder"


def _named_apart(stations: Sequence[Station]) -> tuple[Station, ...]:
    """Return stations whose names differ: photos of two folders may have one name."""
    names = [station.name for station in stations]
    return tuple(
        station if names.count(station.name) == 1 else replace(station, name=f"{station.name} ({number})")
        for number, station in enumerate(stations, start=1)
    )


def _in_folder(folder: Path, *, side_by_side: bool) -> tuple[Station, ...]:
    """Return the stations in a folder, or in the two that it holds, one a camera, in the order that people count in.

    Raises:
        PhotoError: it holds none.
    """
    try:
        photos = photos_in(folder)
    except OSError as problem:
        raise PhotoError(f"{folder}: can't be read: {problem.strerror or problem}") from problem
    if not photos and not side_by_side and (sides := _camera_folders(folder)):
        named = [Station(name=one.stem, left=one, right=sides[1] / one.name) for one in photos_in(sides[0])]
        return _named_apart(sorted(named, key=lambda one: counted(one.name)))
    if not photos:
        others = left_over([folder], ())
        said = f", but {len(others)} pictures such as {others[0]}: convert them to JPEG, in full size" if others else ""
        remedy = _of_videos(folder) or ("" if others else "; name the folder with today's pairs")
        raise PhotoError(f"{folder}: holds no photos that can be read (jpg, png){said}{remedy}")
    if side_by_side:
        return tuple(Station(name=path.stem, left=path, right=path) for path in photos)
    pairs = dict.fromkeys(pair for photo in photos if (pair := partner_of(photo)) is not None)
    if not pairs:
        count = "the camera of its only photo" if len(photos) == 1 else f"which camera took its {len(photos)} photos"
        raise PhotoError(
            f"{folder}: nobody can tell {count}; name them left and right "
            f"(A1_left.jpg, A1_right.jpg), or name the photos in pairs{_of_videos(folder)}"
        )
    named = [Station(name=name_of(left, right), left=left, right=right) for left, right in pairs]
    return _named_apart(sorted(named, key=lambda one: counted(one.name)))


def _camera_folders(folder: Path) -> tuple[Path, Path] | None:
    """Return the folders of the left and the right camera where a folder holds both, with photos of one name."""
    for inside in sorted(folder.iterdir()):
        pair = partner_of(inside) if inside.is_dir() else None
        if pair is not None and pair[0] == inside and pair[1].is_dir():
            names = [{one.name for one in photos_in(side)} for side in pair]
            if names[0] & names[1]:
                return pair
    return None


def _of_videos(folder: Path) -> str:
    """Say what becomes of a folder's videos; "" where it holds none."""
    if any(one.suffix.lower() in VIDEOS and not one.name.startswith(".") for one in folder.iterdir()):
        return "; its videos aren't looked at here: name them under video in the project file, and run it"
    return ""


def left_over(photos: Sequence[Path], stations: Sequence[Station]) -> tuple[str, ...]:
    """Return the names of the pictures in a folder that are of no station: they say no side, or can't be read here."""
    if len(photos) != 1 or not photos[0].is_dir():
        return ()
    used = {path for one in stations for path in (one.left, one.right)}
    inside = (one for one in photos[0].iterdir() if one.is_file() and not one.name.startswith("."))
    return tuple(sorted(one.name for one in inside if one.suffix.lower() in PICTURES and one not in used))
