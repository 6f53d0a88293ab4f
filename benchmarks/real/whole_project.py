"""Writes a scene as a project that anybody could have: photos, rig file, survey, IFC file and project.yaml."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import cv2
import ifcopenshell
import ifcopenshell.guid
import numpy as np
import yaml

from asbuilt_bim.geometry.arrays import FloatArray
from benchmarks.real.whole_draw import Drawn
from benchmarks.real.whole_places import Place
from benchmarks.real.whole_scenes import Scene
from benchmarks.real.whole_truth import Body, World

SURVEY_SIGMA_M = 0.002
CORNERS = ("top-left", "top-right", "bottom-right", "bottom-left")
VISIT = "2026-03-02"


def write_project(folder: Path, world: World, place: Place, drawn: Drawn) -> tuple[Path, dict[str, str]]:
    """Write everything into a folder; return project.yaml and each element's name by its GlobalId."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, photo in (("left.png", drawn.left), ("right.png", drawn.right)):
        cv2.imwrite(str(folder / name), photo)
    _write_rig(folder / "rig.yaml", world.scene)
    _write_survey(folder / "markers.csv", drawn)
    names = write_ifc(folder / "design.ifc", list(world.bodies.values()))
    project: dict[str, Any] = {
        "format": "asbuilt-bim/project", "version": 1, "name": world.scene.name, "ifc": "design.ifc",
        "rig": {"file": "rig.yaml"}, "target": {"diameter_m": place.disc_m, "required": False},
        "markers": {"survey": "markers.csv", "family": "apriltag_36h11", "size_m": place.tag_m,
                    "sigma_m": SURVEY_SIGMA_M},
        "visits": [{"date": VISIT, "stations": [{"name": "A", "left": "left.png", "right": "right.png"}]}],
    }  # fmt: skip
    path = folder / "project.yaml"
    path.write_text(yaml.safe_dump(project, sort_keys=False).replace(f"'{VISIT}'", VISIT), encoding="utf-8")
    return path, names


def _write_rig(path: Path, scene: Scene) -> None:
    """Write the rig as OpenCV's FileStorage does."""
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    height, width = scene.left.shape[:2]
    store.write("image_width", width)
    store.write("image_height", height)
    turn, shift = scene.right_from_left[:3, :3], scene.right_from_left[:3, 3:]
    for name, values in (("K1", scene.left_k), ("D1", scene.distortion[None]), ("K2", scene.right_k),
                         ("D2", scene.distortion[None]), ("R", turn), ("T", shift)):  # fmt: skip
        store.write(name, np.ascontiguousarray(values, dtype=np.float64))
    store.release()


def _write_survey(path: Path, drawn: Drawn) -> None:
    """Write the tags' corners with a surveyor's noise."""
    rng = np.random.default_rng(8)
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["id", "corner", "x_m", "y_m", "z_m"])
        for number, corners in drawn.tags:
            for corner, at in zip(CORNERS, corners + rng.normal(0.0, SURVEY_SIGMA_M, (4, 3)), strict=True):
                rows.writerow([number, corner, *(f"{one:.4f}" for one in at)])


def write_ifc(path: Path, bodies: list[Body]) -> dict[str, str]:
    """Write a small IFC4 file in metres, with one storey; return each element's name by its GlobalId."""
    file: Any = ifcopenshell.file(schema="IFC4")
    rooted = _rooted(file)
    units = [file.create_entity("IfcSIUnit", UnitType=kind, Name=name) for kind, name in (
        ("LENGTHUNIT", "METRE"), ("AREAUNIT", "SQUARE_METRE"), ("VOLUMEUNIT", "CUBIC_METRE"),
        ("PLANEANGLEUNIT", "RADIAN"))]  # fmt: skip
    context = file.create_entity(
        "IfcGeometricRepresentationContext", ContextType="Model", CoordinateSpaceDimension=3, Precision=1e-5,
        WorldCoordinateSystem=_axes(file, np.zeros(3), np.array([1.0, 0.0, 0.0])),
    )  # fmt: skip
    project = rooted("IfcProject", Name="Site", RepresentationContexts=[context],
                     UnitsInContext=file.create_entity("IfcUnitAssignment", Units=units))  # fmt: skip
    above = project
    for kind in ("IfcSite", "IfcBuilding", "IfcBuildingStorey"):
        held = rooted(kind, Name=kind[3:], ObjectPlacement=_placed(file, np.zeros(3), np.array([1.0, 0.0, 0.0])))
        rooted("IfcRelAggregates", RelatingObject=above, RelatedObjects=[held])
        above = held
    products = [_product(file, rooted, context, body) for body in bodies]
    rooted("IfcRelContainedInSpatialStructure", RelatingStructure=above, RelatedElements=products)
    concrete = file.create_entity("IfcMaterial", Name="Concrete C30/37", Category="concrete")
    rooted("IfcRelAssociatesMaterial", RelatingMaterial=concrete, RelatedObjects=products)
    file.write(str(path))
    return {product.GlobalId: product.Name for product in products}


def _rooted(file: Any) -> Any:
    def make(kind: str, **values: Any) -> Any:
        return file.create_entity(kind, GlobalId=ifcopenshell.guid.new(), **values)

    return make


def _product(file: Any, rooted: Any, context: Any, body: Body) -> Any:
    """Write a body: a box behind its face, or a cylinder round its axis."""
    length, deep, high = body.size_m
    if body.element.shape == "round":
        middle = _axes_2d(file, 0.0, 0.0)
        profile = file.create_entity("IfcCircleProfileDef", ProfileType="AREA", Position=middle, Radius=0.5 * length)
    else:
        middle = _axes_2d(file, 0.5 * length, 0.5 * deep)  # x to the right as seen from the front, y inwards
        profile = file.create_entity("IfcRectangleProfileDef", ProfileType="AREA", Position=middle, XDim=length,
                                     YDim=deep)  # fmt: skip
    solid = file.create_entity(
        "IfcExtrudedAreaSolid", SweptArea=profile, Depth=high,
        Position=_axes(file, np.zeros(3), np.array([1.0, 0.0, 0.0])),
        ExtrudedDirection=file.create_entity("IfcDirection", (0.0, 0.0, 1.0)),
    )  # fmt: skip
    shape = file.create_entity("IfcShapeRepresentation", ContextOfItems=context, RepresentationIdentifier="Body",
                               RepresentationType="SweptSolid", Items=[solid])  # fmt: skip
    return rooted(
        "IfcWall" if body.element.shape == "wall" else "IfcColumn", Name=body.element.name,
        ObjectPlacement=_placed(file, body.at_m, body.along),
        Representation=file.create_entity("IfcProductDefinitionShape", Representations=[shape]),
    )  # fmt: skip


def _placed(file: Any, at_m: FloatArray, along: FloatArray) -> Any:
    return file.create_entity("IfcLocalPlacement", RelativePlacement=_axes(file, at_m, along))


def _axes(file: Any, at_m: FloatArray, along: FloatArray) -> Any:
    return file.create_entity(
        "IfcAxis2Placement3D", Location=file.create_entity("IfcCartesianPoint", tuple(float(one) for one in at_m)),
        Axis=file.create_entity("IfcDirection", (0.0, 0.0, 1.0)),
        RefDirection=file.create_entity("IfcDirection", tuple(float(one) for one in along)),
    )  # fmt: skip


def _axes_2d(file: Any, x_m: float, y_m: float) -> Any:
    at = file.create_entity("IfcCartesianPoint", (float(x_m), float(y_m)))
    return file.create_entity("IfcAxis2Placement2D", Location=at)
