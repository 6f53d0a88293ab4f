"""Tables to fill in: every element in its row, and each reads as what it is for once it is filled in."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from click.testing import CliRunner

from asbuilt_bim.cli import app
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.project.tables.costs import read_costs
from asbuilt_bim.project.tables.observations import read_observations
from asbuilt_bim.report.blank_tables import COSTS, OBSERVATIONS, SCHEDULE, blank_tables
from asbuilt_bim.schedule.read import read_schedule
from tests.ifc.models import ModelBuilder
from tests.project_folder import plain, write_project


def building(path: Path) -> Path:
    builder = ModelBuilder(schema="IFC4")
    builder.box("IfcWall", "=W1", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    builder.box("IfcColumn", "C, ß", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    return builder.write(path / "design.ifc")


def filled(data: bytes, **values: str) -> str:
    """Fill the columns of every row; `{n}` in a value is the row's number."""
    rows = list(csv.DictReader(io.StringIO(data.decode("utf-8-sig"))))
    out = io.StringIO()
    writer = csv.DictWriter(out, rows[0])
    writer.writeheader()
    writer.writerows(row | {k: v.format(n=n) for k, v in values.items()} for n, row in enumerate(rows, 1))
    return out.getvalue()


def test_each_table_has_every_element_and_reads_once_it_is_filled_in(tmp_path: Path) -> None:
    design = read_design(building(tmp_path))
    tables = blank_tables(design)
    ids = {element.global_id for element in design.elements}
    for data in tables.values():
        text = data.decode("utf-8-sig")
        assert all(key in text for key in ids) and "'=W1" in text
    costs = tmp_path / COSTS
    costs.write_text(filled(tables[COSTS], item="{n}", unit="m3", quantity="1.5", rate="10"), encoding="utf-8")
    assert {key for cover in read_costs(costs).covers for key in cover.global_ids} == ids
    seen = tmp_path / OBSERVATIONS
    seen.write_text(filled(tables[OBSERVATIONS], date="2026-03-02", percent="40", by="Ann"), encoding="utf-8")
    found, notes = read_observations(seen, design)
    assert {one.element for one in found} == ids and notes == ()
    plan = tmp_path / SCHEDULE
    plan.write_text(filled(tables[SCHEDULE], start="2026-03-02", finish="2026-03-06"), encoding="utf-8")
    assert {key for row in read_schedule(plan).rows for key in row.global_ids} == ids


def test_a_template_that_nobody_filled_in_holds_no_observation(tmp_path: Path) -> None:
    design = read_design(building(tmp_path))
    (tmp_path / OBSERVATIONS).write_bytes(blank_tables(design)[OBSERVATIONS])
    assert read_observations(tmp_path / OBSERVATIONS, design) == ((), ())


def test_the_command_writes_three_tables_and_never_over_one_that_is_there(tmp_path: Path) -> None:
    project = write_project(tmp_path)
    building(tmp_path)
    done = CliRunner().invoke(app, ["template", str(project), "--out", str(tmp_path / "to fill")])
    assert done.exit_code == 0, done.output
    assert sorted(file.name for file in (tmp_path / "to fill").iterdir()) == [COSTS, OBSERVATIONS, SCHEDULE]
    (tmp_path / "to fill" / COSTS).write_text("mine", encoding="utf-8")
    again = CliRunner().invoke(app, ["template", str(project), "--out", str(tmp_path / "to fill")])
    assert again.exit_code == 1 and "is there already" in again.output
    assert (tmp_path / "to fill" / COSTS).read_text(encoding="utf-8") == "mine"
    write_project(tmp_path, plain() | {"csv": "semicolon"})
    replaced = CliRunner().invoke(app, ["template", str(project), "--out", str(tmp_path / "to fill"), "--replace"])
    assert replaced.exit_code == 0 and (tmp_path / "to fill" / COSTS).read_bytes().startswith(b"\xef\xbb\xbfitem;text;")
