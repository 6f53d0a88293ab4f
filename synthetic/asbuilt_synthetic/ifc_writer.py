"""Builds the design as IFC4, in millimetres, entity by entity."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np

from asbuilt_synthetic.building import STOREY_M, STOREYS, Building, Element, Ids, Opening

_MM = 1000.0


class IfcWriter:
    """Builds the IFC file of one building, entity by entity, the same bytes for the same seed."""

    def __init__(self, building: Building) -> None:
        self.building = building
        self.ids = Ids(building.seed, "ifc")
        self.file: Any = ifcopenshell.file(schema="IFC4")
        self.products: dict[str, Any] = {}

    def build(self) -> None:
        """Build the project, its storeys and its elements."""
        self._project()
        self._spatial()
        self._elements()

    def save(self, path: Path) -> None:
        """Write the file, with a time stamp that never changes."""
        header = self.file.header
        header.file_name.name = path.name
        header.file_name.time_stamp = "2026-02-20T09:00:00"
        self.file.write(str(path))

    def new(self, kind: str, *args: Any, **kwargs: Any) -> Any:
        """Create an entity."""
        return self.file.create_entity(kind, *args, **kwargs)

    def rooted(self, kind: str, key: str, **kwargs: Any) -> Any:
        """Create a rooted entity whose GlobalId follows from the key."""
        return self.file.create_entity(kind, GlobalId=self.ids.of(f"{kind}/{key}"), **kwargs)

    def _project(self) -> None:
        units = [
            self.new("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE"),
            self.new("IfcSIUnit", UnitType="AREAUNIT", Name="SQUARE_METRE"),
            self.new("IfcSIUnit", UnitType="VOLUMEUNIT", Name="CUBIC_METRE"),
            self.new("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
            self.new("IfcSIUnit", UnitType="TIMEUNIT", Name="SECOND"),
            self.new("IfcMonetaryUnit", Currency="EUR"),
        ]
        model = self.new(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-3,
            WorldCoordinateSystem=self._axes(np.zeros(3), 0.0),
        )
        self.body = self.new(
            "IfcGeometricRepresentationSubContext",
            ContextIdentifier="Body",
            ContextType="Model",
            ParentContext=model,
            TargetView="MODEL_VIEW",
        )
        self.project = self.rooted(
            "IfcProject",
            "project",
            Name=f"{self.building.name}, shell works",
            RepresentationContexts=[model],
            UnitsInContext=self.new("IfcUnitAssignment", Units=units),
        )

    def _spatial(self) -> None:
        m = self.building.world_from_local
        at = self._placement(None, m[:3, 3], float(np.arctan2(m[1, 0], m[0, 0])))
        self.site = self.rooted("IfcSite", "site", Name="Site", CompositionType="ELEMENT", ObjectPlacement=at)
        house_at = self._placement(at, np.zeros(3), 0.0)
        house = self.rooted(
            "IfcBuilding", "building", Name=self.building.name, CompositionType="ELEMENT", ObjectPlacement=house_at
        )
        self.storeys = [
            self.rooted(
                "IfcBuildingStorey",
                name,
                Name=name,
                CompositionType="ELEMENT",
                Elevation=k * STOREY_M * _MM,
                ObjectPlacement=self._placement(house_at, np.array([0, 0, k * STOREY_M]), 0.0),
            )
            for k, name in enumerate(STOREYS)
        ]
        for key, whole, parts in (
            ("p", self.project, [self.site]),
            ("s", self.site, [house]),
            ("b", house, self.storeys),
        ):
            self.rooted("IfcRelAggregates", key, RelatingObject=whole, RelatedObjects=parts)

    def _elements(self) -> None:
        for e in self.building.elements:
            predefined = {"IfcWall": "SOLIDWALL", "IfcColumn": "COLUMN", "IfcSlab": "FLOOR"}[e.ifc_class]
            if e.name == "Ground slab":
                predefined = "BASESLAB"
            at = self._placement(self.storeys[e.storey].ObjectPlacement, _in_storey(e), e.angle_rad)
            product = self.new(
                e.ifc_class,
                GlobalId=e.global_id,
                Name=e.name,
                ObjectPlacement=at,
                Representation=self._extrusion(self._profile(e), e.height_m),
                Tag=e.name.split("/")[0].split()[1],
                PredefinedType=predefined,
            )
            self.products[e.global_id] = product
            for o in e.openings:
                self._opening(product, at, e, o)
        for k, storey in enumerate(self.storeys):
            inside = [self.products[e.global_id] for e in self.building.elements if e.storey == k]
            self.rooted("IfcRelContainedInSpatialStructure", str(k), RelatingStructure=storey, RelatedElements=inside)
        concrete = self.new("IfcMaterial", Name="Concrete C30/37", Category="concrete")
        self.rooted(
            "IfcRelAssociatesMaterial",
            "concrete",
            RelatingMaterial=concrete,
            RelatedObjects=list(self.products.values()),
        )

    def _opening(self, wall: Any, wall_at: Any, e: Element, o: Opening) -> None:
        at = self._placement(wall_at, np.array([o.start_m + o.width_m / 2, 0, o.sill_m]), 0.0)
        profile = self._rectangle(o.width_m, e.width_m + 0.2, 0.0)
        hole = self.new(
            "IfcOpeningElement",
            GlobalId=o.global_id,
            Name=f"{o.kind} of {e.name}",
            ObjectPlacement=at,
            Representation=self._extrusion(profile, o.height_m),
            PredefinedType="OPENING",
        )
        self.rooted("IfcRelVoidsElement", o.global_id, RelatingBuildingElement=wall, RelatedOpeningElement=hole)

    def _profile(self, e: Element) -> Any:
        if e.shape == "round":
            at = self.new("IfcAxis2Placement2D", Location=self.new("IfcCartesianPoint", (0.0, 0.0)))
            return self.new("IfcCircleProfileDef", ProfileType="AREA", Position=at, Radius=e.length_m / 2 * _MM)
        return self._rectangle(e.length_m, e.width_m, sum(e.x_range_m) / 2)

    def _rectangle(self, x_m: float, y_m: float, mid_x_m: float) -> Any:
        at = self.new("IfcAxis2Placement2D", Location=self.new("IfcCartesianPoint", (mid_x_m * _MM, 0.0)))
        return self.new("IfcRectangleProfileDef", ProfileType="AREA", Position=at, XDim=x_m * _MM, YDim=y_m * _MM)

    def _extrusion(self, profile: Any, height_m: float) -> Any:
        solid = self.new(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self._axes(np.zeros(3), 0.0),
            ExtrudedDirection=self.new("IfcDirection", (0.0, 0.0, 1.0)),
            Depth=height_m * _MM,
        )
        shape = self.new(
            "IfcShapeRepresentation",
            ContextOfItems=self.body,
            RepresentationIdentifier="Body",
            RepresentationType="SweptSolid",
            Items=[solid],
        )
        return self.new("IfcProductDefinitionShape", Representations=[shape])

    def _placement(self, parent: Any, at_m: np.ndarray, angle_rad: float) -> Any:
        return self.new("IfcLocalPlacement", PlacementRelTo=parent, RelativePlacement=self._axes(at_m, angle_rad))

    def _axes(self, at_m: np.ndarray, angle_rad: float) -> Any:
        x = (float(np.cos(angle_rad)), float(np.sin(angle_rad)), 0.0)
        return self.new(
            "IfcAxis2Placement3D",
            Location=self.new("IfcCartesianPoint", tuple(float(v) * _MM for v in at_m)),
            Axis=self.new("IfcDirection", (0.0, 0.0, 1.0)),
            RefDirection=self.new("IfcDirection", x),
        )


def _in_storey(e: Element) -> np.ndarray:
    return np.array([e.xy[0], e.xy[1], round(e.z_m - e.storey * STOREY_M, 6)])
