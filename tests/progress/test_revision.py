"""A revised design: what is gone, new, changed, moved; and what was seen goes only where it was seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimModel, DesignFace
from asbuilt_bim.codes import REVISIONS, Reason
from asbuilt_bim.errors import ResultError
from asbuilt_bim.geometry import polygon
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.completion.records import design_face_record
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.revision import design_changes, revision_notes
from asbuilt_bim.progress.surface import SurfaceState, unseen
from asbuilt_bim.report.result.document import read_past, write_result
from asbuilt_bim.report.wording.changes import changes
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on
from tests.notes import codes
from tests.report.sample_report import sample_report

OPTIONS = ProgressOptions()
IDS = {name: f"{name}{'0' * (22 - len(name))}" for name in ("wall", "kept", "gone", "new", "round")}


def _design(folder: Path, build: Callable[[ModelBuilder], None], **options: Any) -> BimModel:
    builder = ModelBuilder(**options)
    build(builder)
    for product in [*builder.file.by_type("IfcWall"), *builder.file.by_type("IfcColumn")]:
        product.GlobalId = IDS[product.Name]
    return read_design(builder.write(folder / "design.ifc"))


def _report(design: BimModel) -> ProgressReport:
    """A report in which every face was seen built over its lower metre."""
    faces = []
    for face in design.elements and [f for e in design.elements for f in e.faces]:
        u0, v0, u1, _ = polygon.bounds(face.exposed_uv_m)
        low = polygon.intersection(face.exposed_uv_m, polygon.box(u0, v0, u1, v0 + 1.0))
        seen = replace(
            unseen(face), built_uv_m=low, outline_uv_m=low, as_built_area_m2=polygon.area(low), stations={"A1": 1.0},
            row_log_odds=np.full((16, 60), 8.0),
        )  # fmt: skip
        faces.append(design_face_record(face, seen))
    return replace(report_on(design, {}), faces=tuple(faces))


def _history(design: BimModel) -> VisitHistory:
    return remember(EMPTY_HISTORY, _report(design))


def _wall(x_m: float = 0.0, length_m: float = 4.0) -> Callable[[ModelBuilder], None]:
    return lambda builder: (builder.box("IfcWall", "wall", (x_m, 0.0, 0.0), (length_m, 0.2, 3.0)), None)[1]


def _side(design: BimModel) -> DesignFace:
    return next(face for face in design.elements[0].faces if face.role == "side")


def test_gone_new_reshaped_and_moved_elements_are_told_apart(tmp_path: Path) -> None:
    def before(builder: ModelBuilder) -> None:
        _wall()(builder)
        builder.box("IfcColumn", "kept", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
        builder.box("IfcColumn", "gone", (8.0, 0.0, 0.0), (0.4, 0.4, 3.0))
        builder.cylinder("round", (10.0, 0.0, 0.0), 0.2, 3.0)

    def after(builder: ModelBuilder) -> None:
        _wall(length_m=5.0)(builder)
        builder.box("IfcColumn", "kept", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
        builder.box("IfcColumn", "new", (12.0, 0.0, 0.0), (0.4, 0.4, 3.0))
        builder.cylinder("round", (10.5, 0.0, 0.0), 0.2, 3.0)

    old, new = _report(_design(tmp_path, before)), _report(_design(tmp_path, after))
    found = design_changes(old, new)
    names = [[e.name for e in part] for part in (found.gone, found.new, found.reshaped, found.moved)]
    assert names == [["gone"], ["new"], ["wall"], ["round"]]
    notes = revision_notes(old, new)
    kinds = [Reason.DESIGN_REMOVED, Reason.DESIGN_ADDED, Reason.DESIGN_RESHAPED, Reason.DESIGN_MOVED]
    assert codes(notes) == kinds and set(kinds) < REVISIONS
    assert notes[2].values == {"elements": ("wall wall",), "count": 1, "since": old.visit_date.isoformat()}
    assert note_words(notes[2]).startswith("Revised design (against the result of ")
    said = changes(old, new)
    assert any("wall wall: other shape in the design" in line for line in said)
    assert any("column round: moved in the design" in line for line in said)
    assert revision_notes(old, old) == ()


def test_elements_on_another_storey_of_another_task_and_of_another_name_are_told_with_what_was() -> None:
    before = sample_report()
    first, *others = before.elements
    other = next(one for one in before.storeys if one.key != first.storey)
    was = next(one.name for one in before.storeys if one.key == first.storey)
    task = before.tasks[0]
    kept = tuple(key for key in task.progress.elements if key != first.global_id)
    tasks = (replace(task, progress=replace(task.progress, elements=kept)), *before.tasks[1:])
    after = replace(before, elements=(replace(first, storey=other.key, name="New"), *others), tasks=tasks)
    assert first.global_id in task.progress.elements
    notes = revision_notes(before, after)
    told = [Reason.DESIGN_OTHER_STOREY, Reason.DESIGN_OTHER_TASK, Reason.DESIGN_RENAMED]
    assert codes(notes) == told and set(told) < REVISIONS
    assert notes[0].values["elements"] == (f"{first.kind} New ({was} -> {other.name})",)
    assert "-> none)" in note_words(notes[1]) and f"{first.name} -> New" in note_words(notes[2])
    (line,) = changes(before, after)
    moves = f"storey {was} -> {other.name}, task {task.progress.name} -> none, name {first.name} -> New"
    assert line == f"{first.kind} New: {moves}"


def test_an_element_of_another_task_of_the_same_name_is_told_with_both_globalids() -> None:
    report = sample_report()
    first = report.tasks[0].progress
    one = first.elements[0]
    walls, more = replace(first, name="Walls", elements=(one,)), replace(first, key="other", name="Walls", elements=())
    tasks = [replace(report.tasks[0], progress=progress) for progress in (walls, more)]
    moved = [
        replace(tasks[0], progress=replace(walls, elements=())),
        replace(tasks[1], progress=replace(more, elements=(one,))),
    ]
    before, after = replace(report, tasks=tuple(tasks)), replace(report, tasks=tuple(moved))
    (note,) = revision_notes(before, after)
    assert note.code is Reason.DESIGN_OTHER_TASK and f"(Walls {first.key} -> Walls other)" in note_words(note)


def test_a_storey_with_another_name_and_the_same_globalid_is_the_same() -> None:
    before = sample_report()
    storeys = tuple(replace(one, name=f"new {one.name}") for one in before.storeys)
    assert revision_notes(before, replace(before, storeys=storeys)) == ()


def test_a_storey_with_another_globalid_and_the_same_name_is_the_same() -> None:
    before = sample_report()
    storeys = tuple(replace(one, key=f"new {one.key}") for one in before.storeys)
    elements = tuple(replace(one, storey=f"new {one.storey}") for one in before.elements)
    assert revision_notes(before, replace(before, storeys=storeys, elements=elements)) == ()


def test_a_wall_that_a_revision_moved_does_not_take_along_what_was_seen_elsewhere(tmp_path: Path) -> None:
    first = _design(tmp_path, _wall())
    history = _history(first)
    moved = _design(tmp_path, lambda b: (b.box("IfcWall", "wall", (0.0, 2.0, 0.0), (4.0, 0.2, 3.0)), None)[1])
    assert _side(moved).face_id == _side(first).face_id
    assert history.earlier(IDS["wall"], _side(first), OPTIONS) is not None
    assert history.earlier(IDS["wall"], _side(moved), OPTIONS) is None


def test_a_wall_shifted_along_itself_keeps_what_was_seen_where_it_was_seen(tmp_path: Path) -> None:
    history = _history(_design(tmp_path, _wall()))
    shifted = _side(_design(tmp_path, _wall(x_m=3.0)))
    seen = history.earlier(IDS["wall"], shifted, OPTIONS)
    assert seen is not None
    assert polygon.area(seen.built_uv_m) == pytest.approx(1.0, abs=1e-6)  # one of its four metres stood there before
    assert seen.as_built_area_m2 == pytest.approx(1.0, abs=1e-6)
    world = shifted.frame.from_uv(seen.built_uv_m[0][0])
    np.testing.assert_allclose([world[:, 0].min(), world[:, 0].max()], [3.0, 4.0], atol=1e-6)
    assert seen.row_log_odds is None  # its rows are others


@pytest.mark.parametrize("move_m", [-0.04, 0.04])
def test_a_face_that_a_revision_moved_along_its_normal_is_off_by_that_much_more(move_m: float, tmp_path: Path) -> None:
    for face, seen in _moved_along_y(move_m, -0.0004, tmp_path):
        assert seen is not None and seen.tilt_rad == 0.01  # from plumb: the design has no part in it
        assert seen.offset_m == pytest.approx(-0.0004 - move_m * float(face.frame.normal[1]), abs=1e-9)


def test_what_stands_further_off_the_revised_design_than_concrete_may_no_longer_counts(tmp_path: Path) -> None:
    def sides(move_m: float, offset_m: float | None) -> list[bool]:
        found = [(f, seen) for f, seen in _moved_along_y(move_m, offset_m, tmp_path) if f.role == "side"]
        return [seen is not None for _, seen in sorted(found, key=lambda one: float(one[0].frame.normal[1]))]

    assert sides(0.09, -0.0004) == sides(0.09, None) == [False, False]  # as when its photos are judged anew
    assert sides(0.04, None) == [True, True]
    assert sides(0.04, 0.03) == [False, True]  # its back stands 7 cm off now, its front 1 cm
    assert sides(0.08, 0.04) == [False, True]  # the design went after the front: that is now 4 cm behind it


def _moved_along_y(move_m: float, offset_m: float | None, folder: Path) -> list[tuple[DesignFace, SurfaceState | None]]:
    """Return the faces of a wall that a revision moved, seen `offset_m` off its old design, and what is kept."""
    first = _design(folder, _wall())
    report = _report(first)
    told = [replace(face, surface=replace(face.surface, offset_m=offset_m, tilt_rad=0.01)) for face in report.faces]
    history = remember(EMPTY_HISTORY, replace(report, faces=tuple(told)))
    moved = _design(folder, lambda b: (b.box("IfcWall", "wall", (0.0, move_m, 0.0), (4.0, 0.2, 3.0)), None)[1])
    return [(face, history.earlier(IDS["wall"], face, OPTIONS)) for face in moved.elements[0].faces]


@pytest.mark.parametrize("radius_m", [0.21, 0.29])
def test_what_was_measured_of_a_round_column_does_not_grow_or_shrink_with_its_design(
    radius_m: float, tmp_path: Path
) -> None:
    def column(radius: float) -> Callable[[ModelBuilder], None]:
        return lambda builder: (builder.cylinder("round", (0.0, 0.0, 0.0), radius, 3.0), None)[1]

    history = _history(_design(tmp_path, column(0.25)))
    (old,) = history.faces[IDS["round"]]
    told = replace(old, surface=replace(old.surface, offset_m=0.004))
    history = replace(history, faces={IDS["round"]: (told,)})
    (new,) = _design(tmp_path, column(radius_m)).elements[0].faces
    seen = history.earlier(IDS["round"], new, OPTIONS)
    assert seen is not None
    assert seen.as_built_area_m2 == pytest.approx(old.surface.as_built_area_m2, rel=1e-3)
    assert seen.offset_m == pytest.approx(0.25 + 0.004 - radius_m, abs=1e-9)


@pytest.mark.parametrize(("radius_m", "turn_deg"), [(0.25, 0.0), (0.25, 100.0), (0.28, 100.0)])
def test_a_round_column_with_another_seam_or_radius_keeps_what_was_seen(
    radius_m: float, turn_deg: float, tmp_path: Path
) -> None:
    def column(radius: float) -> Callable[[ModelBuilder], None]:
        return lambda builder: (builder.cylinder("round", (0.0, 0.0, 0.0), radius, 3.0), None)[1]

    (old,) = _design(tmp_path, column(0.25)).elements[0].faces
    strip = polygon.box(-0.2, 0.0, 0.1, 2.0)
    seen = replace(unseen(old), built_uv_m=strip, outline_uv_m=strip, as_built_area_m2=0.6)
    report = replace(_report(_design(tmp_path, column(0.25))), faces=(design_face_record(old, seen),))
    (new,) = _design(tmp_path, column(radius_m), turn_deg=turn_deg).elements[0].faces
    carried = remember(EMPTY_HISTORY, report).earlier(IDS["round"], replace(new, face_id="other"), OPTIONS)
    assert carried is not None
    assert polygon.area(carried.built_uv_m) == pytest.approx(0.6 * radius_m / 0.25, rel=1e-3)
    middle = np.mean([p for rings in carried.built_uv_m for p in new.frame.from_uv(rings[0])], axis=0)
    expected = old.frame.from_uv(np.array([-0.05, 1.0])) - [0.0, 0.0, 1.0]
    assert np.arctan2(*middle[1::-1]) == pytest.approx(np.arctan2(*expected[1::-1]), abs=0.15)


def test_results_of_earlier_runs_come_in_the_order_of_their_visits_and_before_all_others(tmp_path: Path) -> None:
    report = sample_report()
    paths, first = [], date(2026, 2, 2)
    for day, earlier in ((date(2026, 2, 16), (first,)), (first, ())):
        paths.append(tmp_path / f"{day}.json")
        write_result(replace(report, visit_date=day, earlier_visits=earlier), paths[-1])
    assert [one.visit_date.day for one in read_past(paths, date(2026, 3, 2))] == [2, 16]
    with pytest.raises(ResultError, match="a history comes before all visits"):
        read_past(paths, date(2026, 2, 16))
    (tmp_path / "twin.json").write_bytes(paths[0].read_bytes())
    with pytest.raises(ResultError, match="name one result a visit"):
        read_past([*paths, tmp_path / "twin.json"], date(2026, 3, 2))


def test_a_result_made_without_the_visit_before_it_is_no_history_of_both(tmp_path: Path) -> None:
    paths = [tmp_path / "february.json", tmp_path / "march.json"]
    for path, day in zip(paths, (date(2026, 2, 2), date(2026, 3, 2)), strict=True):
        write_result(replace(sample_report(), visit_date=day, earlier_visits=()), path)
    with pytest.raises(ResultError, match=r"march.json: was made without the visit of 2026-02-02.*february.json"):
        read_past(paths, date(2026, 4, 1))
    assert len(read_past(paths[1:], date(2026, 4, 1))) == 1
