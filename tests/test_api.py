from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import date, datetime
from multiprocessing import current_process
from pathlib import Path
from typing import Any, get_args, get_type_hints

import ifcopenshell
import pytest

import asbuilt_bim
from asbuilt_bim import api
from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import AsBuiltError, rejected
from asbuilt_bim.progress.report import ShownState
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.result.document import read_result
from tests.camera.virtual import rig
from tests.example_package import example_package
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on
from tests.report.sample_report import sample_report
from tests.site_fixture import small_project, write

__all__ = ["example_package"]


def unphotographed(folder: Path) -> dict[str, object]:
    """A project whose one photo pair is missing: it runs through in a second, and everything is unknown."""
    folder.mkdir(parents=True)
    write_rig(rig(), folder / "any.yaml")
    contents = small_project(folder, folder / "any.yaml")
    for photo in (folder / "photos").iterdir():
        photo.unlink()
    return contents


DOCUMENTED = (Path(__file__).parent.parent / "docs/api.md").read_text(encoding="utf-8")


def test_the_public_names_are_these_and_no_others() -> None:
    assert sorted(asbuilt_bim.__all__) == [
        "AsBuiltError",
        "BimElement",
        "BimModel",
        "ElementProgress",
        "Figure",
        "Foreign",
        "Instance",
        "MeasureOptions",
        "MeasuredFace",
        "Note",
        "PairMeasurement",
        "ProgressReport",
        "Project",
        "Rejection",
        "ResultSummary",
        "Run",
        "ScheduleFile",
        "StereoRig",
        "TargetSighting",
        "Words",
        "__version__",
        "figures",
        "measure_document",
        "measure_pair",
        "note_words",
        "read_design",
        "read_elements",
        "read_project",
        "read_result",
        "read_rig",
        "read_schedule",
        "read_summary",
        "remake",
        "run",
        "save_measurement",
        "strip_asbuilt",
        "words_of",
        "write_asbuilt",
    ]


@pytest.mark.parametrize("name", [name for name in asbuilt_bim.__all__ if name != "__version__"])
def test_every_public_name_can_be_had_and_is_documented(name: str) -> None:
    assert inspect.getdoc(getattr(asbuilt_bim, name))
    assert re.search(rf"`{name}\b", DOCUMENTED), f"docs/api.md doesn't name {name}"


def test_every_type_in_a_public_signature_has_a_public_name() -> None:
    public = [getattr(asbuilt_bim, name) for name in asbuilt_bim.__all__ if name != "__version__"]
    own = {kind for one in public for call in _calls(one) for hint in get_type_hints(call).values()
           for kind in _types(hint) if kind.__module__.startswith("asbuilt_bim")}  # fmt: skip
    assert asbuilt_bim.StereoRig in own
    assert sorted(kind.__name__ for kind in own.difference(public)) == []


def _calls(public: object) -> list[Callable[..., Any]]:
    """A public function, or a public class's methods and what its properties call."""
    if not inspect.isclass(public):
        return [public] if inspect.isfunction(public) else []
    shown = [one for name, one in inspect.getmembers(public) if not name.startswith("_")]
    called = [one.fget if isinstance(one, property) else one for one in shown]
    return [one for one in called if inspect.isfunction(one) or inspect.ismethod(one)]


def _types(hint: Any) -> Iterator[type]:
    """The classes that an annotation names, however deep."""
    if isinstance(hint, list | tuple):
        for part in hint:
            yield from _types(part)
    elif isinstance(hint, type) and not get_args(hint):
        yield hint
    else:
        yield from _types(get_args(hint))


def test_arguments_are_as_documented() -> None:
    for name in ("run", "remake", "read_result"):
        told = re.search(rf"`{name}\(([^`]*)\)`", DOCUMENTED)
        assert told, name
        there = [parameter.split("=")[0].strip() for parameter in told.group(1).split(",")]
        assert sorted(there) == sorted(inspect.signature(getattr(asbuilt_bim, name)).parameters)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'measure_everything'"):
        asbuilt_bim.measure_everything  # noqa: B018


@pytest.mark.usefixtures("example_package")
def test_a_run_in_python_is_a_run_with_plan_schedules_and_the_plugins_files(tmp_path: Path) -> None:
    contents = unphotographed(tmp_path / "site")
    element = asbuilt_bim.read_design(tmp_path / "site" / str(contents["ifc"])).elements[0].global_id
    (tmp_path / "site/plan.csv").write_text(
        "name,start,finish,globalids\nWalls ground floor,1.1.2026,2.1.2026,\n"
        f'"Walls ground floor, west",2026-02-01,2026-02-20,\nPainting,2026-05-01,2026-06-01,\n'
        f"Formwork of one,2026-02-01,2026-02-03,{element}\n"
    )
    contents |= {"schedule": "plan.csv", "csv": "semicolon", "writers": ["example-markdown", "example-failing"]}
    steps: list[tuple[str, int, int]] = []
    found = asbuilt_bim.run(
        write(tmp_path / "site", contents),
        tmp_path / "out",
        cache=False,
        progress=lambda step, done, total, what: steps.append((step, done, total)),
    )
    assert "not one station could be used" in found.warnings[0] and found.result.nothing_seen
    assert "example-failing" in found.warnings[-1]
    out = tmp_path / "out"
    assert (out / "extra/example-markdown/storeys.md").is_file()
    assert steps[-2:] == [("write", 0, 1), ("write", 1, 1)]  # its outputs are seen to begin and to end
    walls = next(task for task in found.result.tasks if task.progress.name == "Walls ground floor, west")
    assert walls.schedule_finish is not None
    assert walls.schedule_finish.date() == date(2026, 2, 20)
    assert walls.planned == 1.0
    formwork = next(task for task in found.result.tasks if task.progress.name == "Formwork of one")
    assert formwork.progress.elements == (element,)  # a task that the IFC doesn't have
    assert any("Painting" in asbuilt_bim.note_words(note) for note in found.result.notes)
    assert {"schedule.msp.xml", "schedule.p6.xml", "tasks.csv"} <= {p.name for p in out.iterdir()}
    again = asbuilt_bim.remake(out)
    assert again.folder != found.folder
    assert (out / "tasks.csv").read_text(encoding="utf-8-sig").startswith("Identification;Name;")
    for name in ("schedule.msp.xml", "schedule.p6.xml", "tasks.csv", "extra/example-markdown/storeys.md"):
        assert (again.folder / name).read_bytes() == (found.folder / name).read_bytes()
    assert read_result(out / "result.json").tasks == again.result.tasks


def test_what_is_known_to_be_wrong_with_a_visit_is_among_the_warnings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = rejected(Reason.DESIGN_UNLIKE, about(SubjectKind.SURVEY), faces=9)
    read = api.read_result
    monkeypatch.setattr(api, "read_result", lambda path: replace(read(path), rejections=(fault,)))
    found = asbuilt_bim.run(write(tmp_path / "site", unphotographed(tmp_path / "site")), tmp_path / "out", cache=False)
    assert not any("none of 9 measured faces" in warning for warning in found.warnings)
    again = asbuilt_bim.remake(tmp_path / "out")
    assert "known to be wrong" in again.warnings[0] and "none of 9 measured faces" in again.warnings[0]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"workers": -1}, "workers: -1 is no number of processes"),
        ({"workers": 1.5}, "no number"),
        ({"until": "2026-03-02"}, "no day"),
        ({"until": datetime(2026, 3, 2)}, "until: .* is no day; give a datetime.date"),
    ],
)
def test_a_wrong_argument_of_a_run_is_refused_before_a_file_is_read(wrong: dict[str, object], says: str) -> None:
    with pytest.raises(asbuilt_bim.AsBuiltError, match=says):
        asbuilt_bim.run("no.yaml", "nowhere", **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: asbuilt_bim.run(None, "out"), "project"),
        (lambda: asbuilt_bim.run("site/project.yaml", None), "out"),
        (lambda: asbuilt_bim.remake(None), "folder"),
        (lambda: asbuilt_bim.read_project(None), "project"),
        (lambda: asbuilt_bim.read_rig(None), "rig"),
        (lambda: asbuilt_bim.read_design(None), "path"),
        (lambda: asbuilt_bim.read_schedule(None), "path"),
        (lambda: asbuilt_bim.read_result(None), "path"),
        (lambda: asbuilt_bim.read_summary(None), "path"),
        (lambda: asbuilt_bim.strip_asbuilt(None, "w.ifc"), "source"),
        (lambda: asbuilt_bim.write_asbuilt("m.ifc", sample_report(), None), "target"),
        (lambda: asbuilt_bim.measure_pair(None, "right.jpg", "rig.yaml"), "left"),
        (lambda: asbuilt_bim.measure_pair("l.jpg", "r.jpg", rig(), segment_network=None), "segment_network"),
    ],
)
def test_what_is_no_path_is_refused_with_the_arguments_name(call: Callable[[], object], argument: str) -> None:
    with pytest.raises(AsBuiltError, match=f"^{argument}: None is no path; give a text, or a pathlib.Path"):
        call()


def test_a_path_that_no_file_can_have_is_refused_with_the_arguments_name() -> None:
    for call in (lambda: asbuilt_bim.run("p.yaml", "o\0"), lambda: asbuilt_bim.read_design("o\0")):
        with pytest.raises(AsBuiltError, match=r"^(out|path): 'o\\x00' is no path: it holds a null byte"):
            call()
    with pytest.raises(AsBuiltError, match=r"^path: 5 is no path"):
        asbuilt_bim.read_design(5)  # type: ignore[arg-type]


def test_a_worker_that_may_start_no_processes_is_told_so_before_a_file_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(current_process()._config, "daemon", True)  # as in a multiprocessing.Pool
    for workers in (0, 2):
        with pytest.raises(AsBuiltError, match=f"^workers: {workers} .* give 1, or call from .*ProcessPoolExecutor"):
            asbuilt_bim.run("no.yaml", "out", workers=workers)
    with pytest.raises(AsBuiltError, match="no such file"):
        asbuilt_bim.run("no.yaml", "out", workers=1)


def test_a_progress_callback_of_four_plain_arguments_is_what_the_type_asks_for() -> None:
    wanted = inspect.signature(asbuilt_bim.run).parameters["progress"].annotation
    assert wanted == Callable[[str, int, int, str], None] | None


@pytest.mark.usefixtures("example_package")
def test_a_broken_writer_or_schedule_is_refused_before_a_photo_is_read(tmp_path: Path) -> None:
    contents = unphotographed(tmp_path / "site")
    project = write(tmp_path / "site", {**contents, "writers": ["example-broken"]})
    with pytest.raises(asbuilt_bim.AsBuiltError, match="example-broken"):
        asbuilt_bim.run(project, tmp_path / "out")
    (tmp_path / "site/plan.xml").write_text("<html/>")
    project = write(tmp_path / "site", {**contents, "schedule": "plan.xml"})
    with pytest.raises(asbuilt_bim.AsBuiltError, match="neither of MS Project nor of P6"):
        asbuilt_bim.run(project, tmp_path / "out")
    with pytest.raises(asbuilt_bim.AsBuiltError, match="no such folder"):
        asbuilt_bim.remake(tmp_path / "none")


@pytest.mark.parametrize("given", [{}, {"complete": "#00FF00"}])
def test_states_without_a_colour_of_their_own_take_the_reports(given: dict[ShownState, str], tmp_path: Path) -> None:
    builder, best = ModelBuilder(), {"full": 1.0, "half": 0.5, "hidden": None}
    for at, name in enumerate(best):
        builder.box("IfcColumn", name, (2.0 * at, 0.0, 0.0), (0.4, 0.4, 3.0))
    source, target = builder.write(tmp_path / "m.ifc"), tmp_path / "w.ifc"
    asbuilt_bim.write_asbuilt(source, report_on(asbuilt_bim.read_design(source), best), target, colours=given)
    painted = {
        style.Name.removeprefix("AsBuilt_Colour "): tuple(style.Styles[0].SurfaceColour)[1:]
        for style in ifcopenshell.open(str(target)).by_type("IfcSurfaceStyle")
    }
    wanted = STATE_COLOURS | given
    assert set(painted) == {"complete", "part", "unknown"}
    for state, rgb in painted.items():
        assert rgb == pytest.approx([int(wanted[state][at : at + 2], 16) / 255.0 for at in (1, 3, 5)])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"part": "red"}, "colours: 'red' for 'part' is no colour; write #rrggbb, such as #f0a202"),
        ({"part": "#0f0"}, "colours: '#0f0' for 'part' is no colour; write #rrggbb"),
        ({"part": (0, 1, 0)}, "colours: (0, 1, 0) for 'part' is no colour"),
        ({"done": "#00ff00"}, "colours: 'done' is no state; the states are complete, complete as far as seen, part"),
        ("red", "colours: 'red' is no dictionary"),
    ],
)
def test_a_colour_that_cannot_be_read_is_refused_with_its_state(given: Any, says: str, tmp_path: Path) -> None:
    with pytest.raises(AsBuiltError, match=re.escape(says)):
        asbuilt_bim.write_asbuilt(tmp_path / "m.ifc", sample_report(), tmp_path / "w.ifc", colours=given)
