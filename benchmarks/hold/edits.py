"""Faults of meaning: each changes a copy of a site as somebody might by mistake. Nothing of them is damaged."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import ifcopenshell
import ifcopenshell.guid
import numpy as np
import yaml
from ifcopenshell.util.unit import calculate_unit_scale

from asbuilt_bim.geometry.arrays import FloatArray

FOOT_M = 0.3048
Edit = Callable[[Path, Path], None]
"""Changes a copy of a site; the second folder is another site of the same kind of rig."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault by its name; `anew`: its stations are measured anew, which takes a minute. `quick`: part of --quick."""

    name: str
    edit: Edit
    anew: bool = False
    quick: bool = False


def project_of(site: Path) -> dict[str, Any]:
    """Read a site's project file."""
    loaded: dict[str, Any] = yaml.safe_load((site / "project.yaml").read_text(encoding="utf-8"))
    return loaded


def _change(site: Path, change: Callable[[dict[str, Any]], None]) -> None:
    project = project_of(site)
    change(project)
    (site / "project.yaml").write_text(yaml.safe_dump(project, sort_keys=False), encoding="utf-8")


# --- the survey


def _survey(change: Callable[[FloatArray, list[str]], FloatArray]) -> Edit:
    """Return an edit that changes the surveyed corners (n, 3), given with each one's marker id."""

    def edit(site: Path, _: Path) -> None:
        path = site / str(project_of(site)["markers"]["survey"])
        rows = list(csv.DictReader(path.open(encoding="utf-8")))
        corners = np.array([[float(row[key]) for key in ("x_m", "y_m", "z_m")] for row in rows])
        changed = change(corners, [row["id"] for row in rows])
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            for row, (x, y, z) in zip(rows, changed, strict=True):
                writer.writerow(row | {"x_m": f"{x:.4f}", "y_m": f"{y:.4f}", "z_m": f"{z:.4f}"})

    return edit


def moved(*move_m: float) -> Edit:
    """Return an edit that moves the survey."""
    return _survey(lambda corners, _: corners + np.array(move_m))


def turned(degrees: float) -> Edit:
    """Return an edit that turns the survey about its middle."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return _survey(lambda corners, _: (corners - corners.mean(axis=0)) @ turn.T + corners.mean(axis=0))


def scaled(factor: float) -> Edit:
    """Return an edit that scales the survey about its middle."""
    return _survey(lambda corners, _: (corners - corners.mean(axis=0)) * factor + corners.mean(axis=0))


mirrored = _survey(lambda corners, _: corners[:, [1, 0, 2]])
in_feet = _survey(lambda corners, _: corners / FOOT_M)


def _exchange_tags(corners: FloatArray, ids: list[str]) -> FloatArray:
    first, second = list(dict.fromkeys(ids))[:2]
    is_first, is_second = (np.array(ids) == one for one in (first, second))
    changed = corners.copy()
    changed[is_first], changed[is_second] = corners[is_second], corners[is_first]
    return changed


def _move_tag(corners: FloatArray, ids: list[str]) -> FloatArray:
    return np.where((np.array(ids) == ids[0])[:, None], corners + np.array([0.3, 0.0, 0.0]), corners)


# --- rig, photos and visits


def _photos(site: Path) -> list[list[Path]]:
    return [
        [site / station[side] for station in visit["stations"] for side in ("left", "right")]
        for visit in project_of(site)["visits"]
    ]


def _saved_again(source: Path, target: Path, quality: int = 88) -> None:
    """Save a photo again, without EXIF."""
    picture = cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    assert picture is not None
    cv2.imwrite(str(target), picture, [cv2.IMWRITE_JPEG_QUALITY, quality])


def other_rig(site: Path, other: Path) -> None:
    """Calibrate from the photos of another rig's boards."""
    shutil.rmtree(site / "calibration")
    shutil.copytree(other / "calibration", site / "calibration")


def sides_exchanged(site: Path, _: Path) -> None:
    """Name the left photos right, and the right ones left, of every station."""

    def change(project: dict[str, Any]) -> None:
        for visit in project["visits"]:
            for station in visit["stations"]:
                station["left"], station["right"] = station["right"], station["left"]

    _change(site, change)


def photos_of_other_site(site: Path, other: Path) -> None:
    """Take the last visit's photos from another site, without EXIF."""
    for source, target in zip(_photos(other)[-1], _photos(site)[-1], strict=False):
        _saved_again(source, target)


def visits_exchanged(site: Path, _: Path) -> None:
    """Exchange the visits' dates."""

    def change(project: dict[str, Any]) -> None:
        first, last = project["visits"][0], project["visits"][-1]
        first["date"], last["date"] = last["date"], first["date"]

    _change(site, change)


def visits_exchanged_without_exif(site: Path, other: Path) -> None:
    """Exchange the visits' dates where no photo says when it was taken."""
    for photos in _photos(site):
        for photo in photos:
            _saved_again(photo, photo, 95)
    visits_exchanged(site, other)


def visits_exchanged_by_clock(site: Path, _: Path) -> None:
    """Exchange the visits' dates, and say that the camera's clock is to blame for what EXIF tells."""

    def change(project: dict[str, Any]) -> None:
        first, last = project["visits"][0], project["visits"][-1]
        first["date"], last["date"] = last["date"], first["date"]
        first["camera_clock_wrong"] = last["camera_clock_wrong"] = True

    _change(site, change)


def last_visits_photos(site: Path, _: Path) -> None:
    """Give the first visit's photos again at the last one, saved again without EXIF."""
    first, last = _photos(site)[0], _photos(site)[-1]
    for source, target in zip(first, last, strict=False):
        _saved_again(source, target)


def _wrong_disc(share: float) -> Edit:
    def change(project: dict[str, Any]) -> None:
        project["target"]["diameter_m"] = round(project["target"]["diameter_m"] * (1.0 + share), 6)

    return lambda site, _: _change(site, change)


def _wrong_board(share: float) -> Edit:
    def change(project: dict[str, Any]) -> None:
        boards = project["rig"]["boards"]
        for key in ("square_m", "marker_m"):
            boards[key] = round(boards[key] * (1.0 + share), 6)

    return lambda site, _: _change(site, change)


# --- the design


def _design(change: Callable[[ifcopenshell.file], None]) -> Edit:
    def edit(site: Path, _: Path) -> None:
        path = site / str(project_of(site)["ifc"])
        file = ifcopenshell.open(str(path))
        change(file)
        file.write(str(path))

    return edit


def _elements(file: ifcopenshell.file) -> list[Any]:
    return sorted((*file.by_type("IfcWall"), *file.by_type("IfcColumn")), key=lambda one: str(one.Name))


def _move(file: ifcopenshell.file, product: Any, move_m: tuple[float, float, float]) -> None:
    """Move a product in its placement's own frame; its placement is its own afterwards."""
    placement = product.ObjectPlacement
    axes = placement.RelativePlacement
    here = axes.Location.Coordinates
    unit_m = calculate_unit_scale(file)
    there = file.createIfcCartesianPoint(tuple(float(a) + b / unit_m for a, b in zip(here, move_m, strict=True)))
    place = file.createIfcAxis2Placement3D(there, axes.Axis, axes.RefDirection)
    product.ObjectPlacement = file.createIfcLocalPlacement(placement.PlacementRelTo, place)


def _elements_moved(count: int, move_m: float) -> Edit:
    def change(file: ifcopenshell.file) -> None:
        columns = [one for one in _elements(file) if one.is_a("IfcColumn")]
        for column in columns[:count]:
            _move(file, column, (move_m, 0.0, 0.0))

    return _design(change)


def _storey_moved(file: ifcopenshell.file) -> None:
    storey = min(file.by_type("IfcBuildingStorey"), key=lambda one: float(one.Elevation or 0.0))
    for relation in file.by_type("IfcRelContainedInSpatialStructure"):
        if relation.RelatingStructure == storey:
            for product in relation.RelatedElements:
                _move(file, product, (0.2, 0.0, 0.0))


def _element_twice(file: ifcopenshell.file) -> None:
    wall = file.by_type("IfcWall")[0]
    twin = _copy(file, wall)
    for relation in file.by_type("IfcRelContainedInSpatialStructure"):
        if wall in relation.RelatedElements:
            relation.RelatedElements = (*relation.RelatedElements, twin)


def _copy(file: ifcopenshell.file, product: Any) -> Any:
    """Return the same product under another GlobalId."""
    twin = file.create_entity(product.is_a())
    for index, value in enumerate(product):
        twin[index] = value
    twin.GlobalId = ifcopenshell.guid.new()
    return twin


def _other_units(file: ifcopenshell.file) -> None:
    """Say that the file's lengths are in centimetres, whatever they were."""
    for assignment in file.by_type("IfcUnitAssignment"):
        for unit in assignment.Units:
            if unit.is_a("IfcSIUnit") and unit.UnitType == "LENGTHUNIT":
                unit.Prefix = "CENTI"


FAULTS = (
    Fault(name="survey moved by 5 cm in x", edit=moved(0.05, 0.0, 0.0)),
    Fault(name="survey moved by 10 cm in x and y", edit=moved(0.10, 0.10, 0.0)),
    Fault(name="survey moved by 20 cm in y", edit=moved(0.0, 0.20, 0.0), quick=True),
    Fault(name="survey moved by 30 cm in z", edit=moved(0.0, 0.0, 0.30)),
    Fault(name="survey turned by 0.5 degrees", edit=turned(0.5)),
    Fault(name="survey turned by 2 degrees", edit=turned(2.0), quick=True),
    Fault(name="survey 1 % too large", edit=scaled(1.01)),
    Fault(name="survey mirrored", edit=mirrored, quick=True),
    Fault(name="survey in feet", edit=in_feet, quick=True),
    Fault(name="two tags exchanged", edit=_survey(_exchange_tags)),
    Fault(name="a tag moved by 30 cm", edit=_survey(_move_tag)),
    Fault(name="another rig's calibration", edit=other_rig, anew=True),
    Fault(name="left and right exchanged", edit=sides_exchanged, anew=True),
    Fault(name="another site's photos", edit=photos_of_other_site, anew=True),
    Fault(name="visits exchanged", edit=visits_exchanged, quick=True),
    Fault(name="visits exchanged, clock blamed", edit=visits_exchanged_by_clock, quick=True),
    Fault(name="visits exchanged, no EXIF", edit=visits_exchanged_without_exif, anew=True),
    Fault(name="last visit's photos again, no EXIF", edit=last_visits_photos, anew=True),
    Fault(name="disc given 1 % too large", edit=_wrong_disc(0.01), anew=True),
    Fault(name="disc given 5 % too large", edit=_wrong_disc(0.05), anew=True),
    Fault(name="disc given 10 % too large", edit=_wrong_disc(0.10), anew=True),
    Fault(name="board given 1 % too large", edit=_wrong_board(0.01), anew=True),
    Fault(name="design in other units", edit=_design(_other_units), quick=True),
    Fault(name="design's lowest storey moved by 20 cm", edit=_design(_storey_moved)),
    Fault(name="three columns of the design moved by 20 cm", edit=_elements_moved(3, 0.20)),
    Fault(name="a column of the design moved by 30 cm", edit=_elements_moved(1, 0.30)),
    Fault(name="a wall of the design twice", edit=_design(_element_twice)),
)
