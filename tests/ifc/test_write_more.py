"""What else the copy carries: visits as time series, photos, storeys' quantities, standard sets, colours; and back."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.validate
import pytest
from click.testing import CliRunner

from asbuilt_bim.cli import app
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import strip_asbuilt, uri, write_asbuilt
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from tests.ifc.models import SCHEMAS, ModelBuilder
from tests.ifc.reports import VISIT, report_on
from tests.report.sample_report import sample_report

BEFORE = date(2026, 2, 16)
STATION = sample_report().stations[0]
BEST: dict[str, float | None] = {"full": 1.0, "half": 0.5, "none": 0.0, "hidden": None}


def _model(schema: str, folder: Path) -> Path:
    builder = ModelBuilder(schema=schema)
    made = {name: builder.box("IfcColumn", name, (2.0 * i, 0.0, 0.0), (0.4, 0.4, 3.0)) for i, name in enumerate(BEST)}
    builder.task("pour", [made["full"]])
    (item,) = made["half"].Representation.Representations[0].Items
    shade = builder.make("IfcSurfaceStyleShading", SurfaceColour=builder.make("IfcColourRgb", None, 0.5, 0.5, 0.5))
    style = builder.make("IfcSurfaceStyle", Name="grey", Side="BOTH", Styles=[shade])
    styles = [builder.make("IfcPresentationStyleAssignment", [style])] if schema == "IFC2X3" else [style]
    builder.make("IfcStyledItem", Item=item, Styles=styles, Name="it's its own")
    return builder.write(folder / f"{schema}.ifc")


def _reports(path: Path) -> tuple[ProgressReport, ProgressReport]:
    design = read_design(path)
    first = report_on(design, {"full": 0.4, "half": None, "none": None})
    first = replace(
        first,
        visit_date=BEFORE,
        elements=tuple(replace(e, last_seen=BEFORE, stations=("A1",)) for e in first.elements),
        stations=(replace(STATION, name="A1", day=BEFORE),),
    )
    last = replace(
        report_on(design, BEST), stations=tuple(replace(STATION, name=n, day=VISIT) for n in ("A1", "A 2/é"))
    )
    seen = {"full": ("A1",), "half": ("A 2/é",)}
    return first, replace(last, elements=tuple(replace(e, stations=seen.get(e.name, ())) for e in last.elements))


def _written(schema: str, folder: Path, colour: bool = False) -> tuple[Path, Path]:
    source, target = _model(schema, folder), folder / "out" / "copy.ifc"
    first, last = _reports(source)
    write_asbuilt(source, last, target, earlier=[first], colours=STATE_COLOURS if colour else None)
    return source, target


def _lines(path: Path) -> list[str]:
    return [str(entity) for entity in ifcopenshell.open(str(path))]


def _complaints(path: Path) -> set[str]:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(path), logger)
    return {f"{one.get('type')} {one.get('attribute')} {one.get('message')}" for one in logger.statements}


def _one(file: Any, ifc_class: str, name: str) -> Any:
    (thing,) = [one for one in file.by_type(ifc_class) if one.Name == name]
    return thing


def _series(thing: Any) -> dict[str, list[float]]:
    (history,) = [
        relation.RelatingControl
        for relation in thing.HasAssignments
        if relation.is_a("IfcRelAssignsToControl") and relation.RelatingControl.is_a("IfcPerformanceHistory")
    ]
    assert history.LifeCyclePhase == "CONSTRUCTION"
    (relation,) = history.IsDefinedBy
    return {
        one.Name: [value.ListValues[0].wrappedValue for value in one.PropertyReference.Values]
        for one in relation.RelatingPropertyDefinition.HasProperties
    }


@pytest.mark.parametrize("schema", SCHEMAS)
def test_visits_stand_as_time_series_and_one_that_could_not_tell_has_no_value(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    full = _series(_one(file, "IfcColumn", "full"))
    assert full["CompletionBest"] == pytest.approx([0.4, 1.0])
    assert full["CompletionUpper"] == pytest.approx([0.46, 1.0])
    assert _series(_one(file, "IfcColumn", "half"))["CompletionBest"] == pytest.approx([0.5])
    assert "AsBuiltArea" not in _series(_one(file, "IfcColumn", "none"))
    assert _series(_one(file, "IfcTask", "pour"))["CompletionBest"] == pytest.approx([0.4, 1.0])
    assert not _one(file, "IfcColumn", "hidden").HasAssignments


@pytest.mark.parametrize("schema", SCHEMAS)
def test_photos_are_documents_of_the_elements_they_decided(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    told = {}
    for relation in file.by_type("IfcRelAssociatesDocument"):
        document = relation.RelatingDocument
        assert document.Name and not document.Location.startswith(("/", "file:"))
        told[document.Name] = (document.Location, sorted(one.Name for one in relation.RelatedObjects))
    assert told.keys() == {"2026-02-16 A1", "2026-03-02 A1", "2026-03-02 A 2/é"}
    assert told["2026-03-02 A1"][1] == ["full"]
    assert told["2026-03-02 A1"][0].startswith("overlays/2026-03-02_")
    assert uri("overlays/A 2 é#%.jpg") == "overlays/A%202%20%C3%A9%23%25.jpg"


@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_storey_has_as_built_quantities_of_its_own(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    sets = ifcopenshell.util.element.get_psets(_one(file, "IfcBuildingStorey", "Level 0"))
    assert sets["AsBuilt_Quantities"]["AsBuiltArea"] == pytest.approx(1.0)
    empty = ifcopenshell.util.element.get_psets(_one(file, "IfcBuildingStorey", "Level 1"))
    assert "AsBuiltArea" not in empty["AsBuilt_Quantities"]  # nothing measured there is not 0 m2


def test_standard_sets_are_written_where_the_schema_has_them(tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written("IFC4X3", tmp_path)[1]))
    full = ifcopenshell.util.element.get_psets(_one(file, "IfcColumn", "full"))
    assert full["Pset_ConstructionOccurence"]["InstallationDate"] == "2026-03-02"
    assert full["Pset_Uncertainty"]["UncertaintyBasis"] == ["MEASUREMENT"]
    assert full["Pset_Uncertainty"]["OrthogonalUncertainty"] == pytest.approx(4.0)  # millimetres
    half = ifcopenshell.util.element.get_psets(_one(file, "IfcColumn", "half"))
    assert "Pset_ConstructionOccurence" not in half


def test_a_standard_set_of_the_designs_own_is_left_alone(tmp_path: Path) -> None:
    source = _model("IFC4X3", tmp_path)
    file = ifcopenshell.open(str(source))
    value = file.create_entity("IfcPropertySingleValue", "AssetIdentifier", None, file.create_entity("IfcLabel", "x"))
    theirs = file.create_entity(
        "IfcPropertySet", ifcopenshell.guid.new(), None, "Pset_ConstructionOccurence", None, [value]
    )
    full = _one(file, "IfcColumn", "full")
    file.create_entity("IfcRelDefinesByProperties", ifcopenshell.guid.new(), None, None, None, [full], theirs)
    file.write(str(source))
    write_asbuilt(source, report_on(read_design(source), BEST), tmp_path / "w.ifc")
    after = ifcopenshell.open(str(tmp_path / "w.ifc"))
    named = [one for one in after.by_type("IfcPropertySet") if one.Name == "Pset_ConstructionOccurence"]
    assert len(named) == 1 and [one.Name for one in named[0].HasProperties] == ["AssetIdentifier"]


@pytest.mark.parametrize("schema", SCHEMAS)
def test_colours_show_the_state_and_the_designs_own_style_comes_back(schema: str, tmp_path: Path) -> None:
    source, target = _written(schema, tmp_path, colour=True)
    file = ifcopenshell.open(str(target))
    for name, state in (("full", "complete"), ("half", "part"), ("none", "not started"), ("hidden", "unknown")):
        (item,) = _one(file, "IfcColumn", name).Representation.Representations[0].Items
        (styled,) = item.StyledByItem
        style = styled.Styles[0].Styles[0] if schema == "IFC2X3" else styled.Styles[0]
        red = int(STATE_COLOURS[state][1:3], 16) / 255.0
        assert style.Styles[0].SurfaceColour.Red == pytest.approx(red)
    assert _complaints(target) <= _complaints(source)
    strip_asbuilt(target, tmp_path / "bare.ifc")
    assert _lines(tmp_path / "bare.ifc") == _lines(source)


@pytest.mark.parametrize("shared", ["items", "representation", "shape"])
def test_a_body_that_two_elements_share_is_not_painted(shared: str, tmp_path: Path) -> None:
    builder = ModelBuilder()
    one, other = (builder.box("IfcColumn", name, (0.0, 0.0, 0.0), (0.4, 0.4, 3.0)) for name in ("full", "none"))
    if shared == "items":
        other.Representation.Representations[0].Items = one.Representation.Representations[0].Items
    elif shared == "representation":
        other.Representation.Representations = one.Representation.Representations
    else:
        other.Representation = one.Representation
    source = builder.write(tmp_path / "m.ifc")
    write_asbuilt(source, report_on(read_design(source), BEST), tmp_path / "w.ifc", colours=STATE_COLOURS)
    assert not ifcopenshell.open(str(tmp_path / "w.ifc")).by_type("IfcStyledItem")


def _shown(file: Any, product: Any) -> tuple[float, ...]:
    """The colour that the geometry kernel, which isn't ours, gives a product."""
    (material,) = ifcopenshell.geom.create_shape(ifcopenshell.geom.settings(), product).geometry.materials
    return tuple(round(value, 3) for value in material.diffuse.components)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_columns_mapped_from_one_styled_source_show_each_their_own_state(schema: str, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema)
    made = {name: builder.mirrored("IfcColumn", name, (0.4, 0.4, 3.0)) for name in ("full", "none", "hidden")}
    first = made["full"].Representation.Representations[0].Items[0].MappingSource
    for one in made.values():
        one.Representation.Representations[0].Items[0].MappingSource = first
    shade = builder.make("IfcSurfaceStyleShading", SurfaceColour=builder.make("IfcColourRgb", None, 0.5, 0.25, 0.125))
    style = builder.make("IfcSurfaceStyle", Name="brown", Side="BOTH", Styles=[shade])
    styles = [builder.make("IfcPresentationStyleAssignment", [style])] if schema == "IFC2X3" else [style]
    builder.make("IfcStyledItem", Item=first.MappedRepresentation.Items[0], Styles=styles)
    source, target = builder.write(tmp_path / "m.ifc"), tmp_path / "w.ifc"
    write_asbuilt(source, report_on(read_design(source), BEST), target, colours=STATE_COLOURS)
    file = ifcopenshell.open(str(target))
    for name, state in (("full", "complete"), ("none", "not started"), ("hidden", "unknown")):
        rgb = tuple(round(int(STATE_COLOURS[state][i : i + 2], 16) / 255.0, 3) for i in (1, 3, 5))
        assert _shown(file, _one(file, "IfcColumn", name)) == rgb
    assert _complaints(target) <= _complaints(source)
    strip_asbuilt(target, tmp_path / "bare.ifc")
    assert _lines(tmp_path / "bare.ifc") == _lines(source)


@pytest.mark.parametrize("colour", [False, True])
@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_second_run_gives_the_same_file_line_by_line_and_strip_the_source(
    schema: str, colour: bool, tmp_path: Path
) -> None:
    source, target = _written(schema, tmp_path, colour)
    first, last = _reports(source)
    again, bare = tmp_path / "again.ifc", tmp_path / "bare.ifc"
    write_asbuilt(target, last, again, earlier=[first], colours=STATE_COLOURS if colour else None)
    assert _lines(again) == _lines(target)
    strip_asbuilt(again, bare)
    assert _lines(bare) == _lines(source)
    assert _complaints(target) <= _complaints(source)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_ours_is_known_by_name_where_another_program_gave_it_other_global_ids(schema: str, tmp_path: Path) -> None:
    source, target = _written(schema, tmp_path)
    file, original = ifcopenshell.open(str(target)), ifcopenshell.open(str(source))
    theirs = {one.GlobalId for one in original.by_type("IfcRoot")}
    for one in file.by_type("IfcRoot"):
        if one.GlobalId not in theirs:
            one.GlobalId = ifcopenshell.guid.new()
    file.write(str(tmp_path / "exported.ifc"))
    first, last = _reports(source)
    write_asbuilt(tmp_path / "exported.ifc", last, tmp_path / "again.ifc", earlier=[first])
    assert _lines(tmp_path / "again.ifc") == _lines(target)
    strip_asbuilt(tmp_path / "exported.ifc", tmp_path / "bare.ifc")
    assert _lines(tmp_path / "bare.ifc") == _lines(source)


def test_a_new_visit_replaces_the_state_of_the_one_before(tmp_path: Path) -> None:
    source = _model("IFC4", tmp_path)
    first, last = _reports(source)
    write_asbuilt(source, first, tmp_path / "1.ifc")
    write_asbuilt(tmp_path / "1.ifc", last, tmp_path / "2.ifc", earlier=[first])
    file = ifcopenshell.open(str(tmp_path / "2.ifc"))
    full = _one(file, "IfcColumn", "full")
    (progress,) = [r for r in full.IsDefinedBy if r.RelatingPropertyDefinition.Name == "AsBuilt_Progress"]
    values = {p.Name: p.NominalValue.wrappedValue for p in progress.RelatingPropertyDefinition.HasProperties}
    assert (values["State"], values["VisitDate"]) == ("complete", "2026-03-02")


def test_ifc2x3_without_an_owner_history_gets_one_and_loses_it_again(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC2X3")
    builder.box("IfcColumn", "full", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    owner = builder.owner
    for root in builder.file.by_type("IfcRoot"):
        root.OwnerHistory = None
    builder.file.remove(owner)
    source, target, bare = builder.write(tmp_path / "m.ifc"), tmp_path / "w.ifc", tmp_path / "b.ifc"
    write_asbuilt(source, report_on(read_design(source), BEST), target)
    file = ifcopenshell.open(str(target))
    assert all(one.OwnerHistory for one in file.by_type("IfcPropertySet"))
    strip_asbuilt(target, bare)
    assert _lines(bare) == _lines(source)


def test_two_tasks_that_share_one_time_are_left_alone(tmp_path: Path) -> None:
    builder = ModelBuilder()
    columns = [builder.box("IfcColumn", name, (2.0 * i, 0, 0), (0.4, 0.4, 3.0)) for i, name in enumerate(BEST)]
    one, other = builder.task("a", columns[:1]), builder.task("b", columns[1:2])
    other.TaskTime = one.TaskTime
    source = builder.write(tmp_path / "m.ifc")
    write_asbuilt(source, report_on(read_design(source), BEST), tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    assert _one(file, "IfcTask", "a").TaskTime.Completion is None
    said = ifcopenshell.util.element.get_psets(_one(file, "IfcTask", "a"))["AsBuilt_Progress"]["Basis"]
    assert said == "task time shared"


def test_the_strip_command_writes_the_source_again_and_refuses_to_overwrite(tmp_path: Path) -> None:
    source, target = _written("IFC4", tmp_path)
    bare = tmp_path / "bare.ifc"
    done = CliRunner().invoke(app, ["strip", str(target), "--out", str(bare)])
    assert done.exit_code == 0 and "taken out" in done.output
    assert _lines(bare) == _lines(source)
    refused = CliRunner().invoke(app, ["strip", str(target), "--out", str(target)])
    assert refused.exit_code == 1 and "would overwrite its own source" in refused.output
    nothing = CliRunner().invoke(app, ["strip", str(source), "--out", str(tmp_path / "x.ifc")])
    assert nothing.exit_code == 0 and "carries nothing of asbuilt-bim" in nothing.output
