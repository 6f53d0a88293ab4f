"""Small IFC models built in memory: boxes and cylinders for walls, columns, slabs; three schemas, two units."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")


@dataclass
class ModelBuilder:
    """Builds one file; all is given in metres and degrees, in the site's frame, and written in the file's unit."""

    schema: str = "IFC4"
    millimetres: bool = True
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_deg: float = 0.0
    storeys: int = 2
    file: Any = field(init=False)

    def __post_init__(self) -> None:
        self.file = ifcopenshell.file(schema=self.schema)
        self.scale = 1000.0 if self.millimetres else 1.0
        self.owner = self._owner()
        self.context = self.make(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=self._axes((0, 0, 0)),
        )
        self.project = self.rooted(
            "IfcProject", Name="Test", UnitsInContext=self._units(), RepresentationContexts=[self.context]
        )
        self.site = self._spatial("IfcSite", None, self.origin_m, self.turn_deg, CompositionType="ELEMENT")
        self.building = self._spatial("IfcBuilding", self.site, (0, 0, 0), 0.0, CompositionType="ELEMENT")
        self.levels = [
            self._spatial(
                "IfcBuildingStorey",
                self.building,
                (0, 0, 3.0 * level),
                0.0,
                Name=f"Level {level}",
                Elevation=3.0 * level * self.scale,
                CompositionType="ELEMENT",
            )
            for level in range(self.storeys)
        ]
        if self.levels:
            self._aggregate(self.building, self.levels)
        self._aggregate(self.site, [self.building])
        self._aggregate(self.project, [self.site])

    def bridge_part(self, name: str, height_m: float) -> Any:
        """A part of a bridge, at a height over the site, as IFC4X3 has it in the place of a storey."""
        bridge = self._spatial("IfcBridge", self.site, (0, 0, 0), 0.0)
        part = self._spatial("IfcBridgePart", bridge, (0, 0, height_m), 0.0, Name=name, UsageType="VERTICAL")
        self._aggregate(self.site, [bridge])
        self._aggregate(bridge, [part])
        self.levels.append(part)
        return part

    def make(self, ifc_class: str, *values: Any, **attributes: Any) -> Any:
        return self.file.create_entity(ifc_class, *values, **attributes)

    def rooted(self, ifc_class: str, **attributes: Any) -> Any:
        return self.make(ifc_class, GlobalId=ifcopenshell.guid.new(), OwnerHistory=self.owner, **attributes)

    def box(
        self,
        ifc_class: str,
        name: str,
        at_m: tuple[float, float, float],
        size_m: tuple[float, float, float],
        turn_deg: float = 0.0,
        level: int | None = 0,
        material: str | None = "Concrete C30/37",
    ) -> Any:
        """A box with its corner at `at_m` (in the storey), its length along its own x."""
        length, width, height = (value * self.scale for value in size_m)
        profile = self.make(
            "IfcRectangleProfileDef",
            ProfileType="AREA",
            Position=self._axes_2d(length / 2.0, width / 2.0),
            XDim=length,
            YDim=width,
        )
        return self._product(ifc_class, name, at_m, turn_deg, level, material, self._extruded(profile, height))

    def cylinder(
        self, name: str, at_m: tuple[float, float, float], radius_m: float, height_m: float, level: int = 0
    ) -> Any:
        """A round column with its axis at `at_m`."""
        profile = self.make(
            "IfcCircleProfileDef", ProfileType="AREA", Position=self._axes_2d(0.0, 0.0), Radius=radius_m * self.scale
        )
        solid = self._extruded(profile, height_m * self.scale)
        return self._product("IfcColumn", name, at_m, 0.0, level, "Concrete", solid)

    def prism(
        self, ifc_class: str, name: str, outline_m: list[tuple[float, float]], height_m: float, down: bool = False
    ) -> Any:
        """A product of any closed outline, extruded upwards, or downwards from its height."""
        corners = [
            self.make("IfcCartesianPoint", (float(x * self.scale), float(y * self.scale)))
            for x, y in [*outline_m, outline_m[0]]
        ]
        profile = self.make(
            "IfcArbitraryClosedProfileDef",
            ProfileType="AREA",
            OuterCurve=self.make("IfcPolyline", Points=corners),
        )
        solid = self._extruded(profile, height_m * self.scale)
        if down:
            solid.Position = self._axes((0, 0, height_m * self.scale))
            solid.ExtrudedDirection = self.make("IfcDirection", (0.0, 0.0, -1.0))
        return self._product(ifc_class, name, (0, 0, 0), 0.0, 0, "Concrete", solid)

    def mirrored(self, ifc_class: str, name: str, size_m: tuple[float, float, float]) -> Any:
        """A box that comes as a mapped item, mirrored along x and made twice as long."""
        product = self.box(ifc_class, name, (0.0, 0.0, 0.0), size_m)
        source = self.make(
            "IfcRepresentationMap",
            MappingOrigin=self._axes((0, 0, 0)),
            MappedRepresentation=product.Representation.Representations[0],
        )
        target = self.make(
            "IfcCartesianTransformationOperator3DnonUniform",
            Axis1=self.make("IfcDirection", (-1.0, 0.0, 0.0)),
            Axis2=self.make("IfcDirection", (0.0, 1.0, 0.0)),
            LocalOrigin=self.make("IfcCartesianPoint", (0.0, 0.0, 0.0)),
            Scale=2.0,
            Axis3=self.make("IfcDirection", (0.0, 0.0, 1.0)),
            Scale2=1.0,
            Scale3=1.0,
        )
        item = self.make("IfcMappedItem", MappingSource=source, MappingTarget=target)
        body = self.make(
            "IfcShapeRepresentation",
            ContextOfItems=self.context,
            RepresentationIdentifier="Body",
            RepresentationType="MappedRepresentation",
            Items=[item],
        )
        product.Representation = self.make("IfcProductDefinitionShape", Representations=[body])
        return product

    def bare(self, ifc_class: str, name: str, level: int = 0) -> Any:
        """A product without a body."""
        return self._product(ifc_class, name, (0, 0, 0), 0.0, level, None, None)

    def axis_only(self, product: Any) -> None:
        """Give a product an axis as its only representation."""
        points = [self.make("IfcCartesianPoint", (float(x) * self.scale, 0.0)) for x in (0, 2)]
        axis = self.make(
            "IfcShapeRepresentation",
            ContextOfItems=self.context,
            RepresentationIdentifier="Axis",
            RepresentationType="Curve2D",
            Items=[self.make("IfcPolyline", Points=points)],
        )
        product.Representation = self.make("IfcProductDefinitionShape", Representations=[axis])

    def opening(self, wall: Any, at_m: tuple[float, float, float], size_m: tuple[float, float, float]) -> Any:
        """An opening with its corner at `at_m` in the wall's own frame."""
        hole = self.box("IfcOpeningElement", "hole", at_m, size_m, level=None, material=None)
        hole.ObjectPlacement.PlacementRelTo = wall.ObjectPlacement
        self.rooted("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=hole)
        return hole

    def parts(self, whole: Any, parts: list[Any]) -> None:
        self._aggregate(whole, parts)

    def task(self, name: str, elements: list[Any], by_process: bool = False, time: bool = True) -> Any:
        """A task that makes elements; IFC2X3 gets a work schedule and its time control."""
        if self.schema == "IFC2X3":
            task = self.rooted("IfcTask", Name=name, TaskId=name, IsMilestone=False)
            control = self.rooted("IfcScheduleTimeControl", Name=name, ScheduleStart=self._day(2026, 2, 1))
            schedule = self.rooted(
                "IfcWorkSchedule", Name="plan", Identifier="1", CreationDate=self._day(2026, 1, 1),
                StartTime=self._day(2026, 1, 1),
            )  # fmt: skip
            self.rooted(
                "IfcRelAssignsTasks",
                RelatedObjects=[task],
                RelatingControl=schedule,
                TimeForTask=control if time else None,
            )
        else:
            task = self.rooted("IfcTask", Name=name, Identification=name, IsMilestone=False)
            if time:
                task.TaskTime = self.make(
                    "IfcTaskTime", ScheduleStart="2026-02-01T00:00:00", ScheduleFinish="2026-02-14T00:00:00"
                )
        if by_process:
            self.rooted("IfcRelAssignsToProcess", RelatedObjects=elements, RelatingProcess=task)
        else:
            for element in elements:
                self.rooted("IfcRelAssignsToProduct", RelatedObjects=[task], RelatingProduct=element)
        return task

    def cost(self, name: str, elements: list[Any], ifc_class: str, value: float, rate: float) -> Any:
        """A cost item with one quantity in the file's unit and one rate; IFC4 and later."""
        named = {"IfcQuantityVolume": "VolumeValue", "IfcQuantityArea": "AreaValue", "IfcQuantityNumber": "NumberValue"}
        attribute = named.get(ifc_class, "CountValue")
        quantity = self.make(ifc_class, Name="planned", **{attribute: value})
        amount = self.make("IfcCostValue", AppliedValue=self.make("IfcMonetaryMeasure", rate))
        item = self.rooted(
            "IfcCostItem", Name=name, Identification=name, CostQuantities=[quantity], CostValues=[amount]
        )
        self.rooted("IfcRelAssignsToControl", RelatedObjects=elements, RelatingControl=item)
        if not hasattr(self, "budget"):
            self.budget = self.rooted("IfcCostSchedule", Name="budget", PredefinedType="BUDGET")
        self.rooted("IfcRelAssignsToControl", RelatedObjects=[item], RelatingControl=self.budget)
        return item

    def write(self, path: Path) -> Path:
        self.file.write(str(path))
        return path

    def _owner(self) -> Any:
        person = self.make("IfcPerson", FamilyName="Doe")
        organisation = self.make("IfcOrganization", Name="Test")
        user = self.make("IfcPersonAndOrganization", ThePerson=person, TheOrganization=organisation)
        program = self.make("IfcApplication", organisation, "1", "test", "test")
        return self.make(
            "IfcOwnerHistory",
            OwningUser=user,
            OwningApplication=program,
            ChangeAction="ADDED" if self.schema == "IFC2X3" else "NOCHANGE",
            CreationDate=1,
        )

    def _units(self) -> Any:
        prefix = "MILLI" if self.millimetres else None
        units = [
            self.make("IfcSIUnit", UnitType="LENGTHUNIT", Prefix=prefix, Name="METRE"),
            self.make("IfcSIUnit", UnitType="AREAUNIT", Name="SQUARE_METRE"),
            self.make("IfcSIUnit", UnitType="VOLUMEUNIT", Name="CUBIC_METRE"),
            self.make("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
            self.make("IfcMonetaryUnit", Currency="EUR"),
        ]
        return self.make("IfcUnitAssignment", Units=units)

    def _day(self, year: int, month: int, day: int) -> Any:
        calendar = self.make("IfcCalendarDate", DayComponent=day, MonthComponent=month, YearComponent=year)
        zone = self.make("IfcCoordinatedUniversalTimeOffset", HourOffset=0, Sense="AHEAD")
        clock = self.make("IfcLocalTime", HourComponent=0, MinuteComponent=0, SecondComponent=0.0, Zone=zone)
        return self.make("IfcDateAndTime", DateComponent=calendar, TimeComponent=clock)

    def _axes(self, at: tuple[float, float, float], turn_deg: float = 0.0) -> Any:
        angle = math.radians(turn_deg)
        return self.make(
            "IfcAxis2Placement3D",
            Location=self.make("IfcCartesianPoint", tuple(float(v) for v in at)),
            Axis=self.make("IfcDirection", (0.0, 0.0, 1.0)),
            RefDirection=self.make("IfcDirection", (math.cos(angle), math.sin(angle), 0.0)),
        )

    def _axes_2d(self, x: float, y: float) -> Any:
        return self.make("IfcAxis2Placement2D", Location=self.make("IfcCartesianPoint", (float(x), float(y))))

    def _placed(self, parent: Any, at_m: tuple[float, float, float], turn_deg: float) -> Any:
        return self.make(
            "IfcLocalPlacement",
            PlacementRelTo=parent,
            RelativePlacement=self._axes(tuple(v * self.scale for v in at_m), turn_deg),
        )

    def _spatial(
        self, ifc_class: str, parent: Any, at_m: tuple[float, float, float], turn_deg: float, **attributes: Any
    ) -> Any:
        return self.rooted(
            ifc_class,
            ObjectPlacement=self._placed(parent.ObjectPlacement if parent else None, at_m, turn_deg),
            **attributes,
        )

    def _aggregate(self, whole: Any, parts: list[Any]) -> None:
        self.rooted("IfcRelAggregates", RelatingObject=whole, RelatedObjects=parts)

    def _extruded(self, profile: Any, depth: float) -> Any:
        return self.make(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self._axes((0, 0, 0)),
            ExtrudedDirection=self.make("IfcDirection", (0.0, 0.0, 1.0)),
            Depth=depth,
        )

    def _product(
        self,
        ifc_class: str,
        name: str,
        at_m: tuple[float, float, float],
        turn_deg: float,
        level: int | None,
        material: str | None,
        solid: Any,
    ) -> Any:
        parent = self.levels[level].ObjectPlacement if level is not None and self.levels else None
        product = self.rooted(ifc_class, Name=name, ObjectPlacement=self._placed(parent, at_m, turn_deg))
        if solid is not None:
            body = self.make(
                "IfcShapeRepresentation",
                ContextOfItems=self.context,
                RepresentationIdentifier="Body",
                RepresentationType="SweptSolid",
                Items=[solid],
            )
            product.Representation = self.make("IfcProductDefinitionShape", Representations=[body])
        if level is not None and self.levels:
            self.rooted(
                "IfcRelContainedInSpatialStructure", RelatedElements=[product], RelatingStructure=self.levels[level]
            )
        if material is not None:
            self.rooted(
                "IfcRelAssociatesMaterial",
                RelatedObjects=[product],
                RelatingMaterial=self.make("IfcMaterial", Name=material),
            )
        return product
