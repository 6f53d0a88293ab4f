"""Storeys by trade: the summary above a task is its trade, unless it is a storey, a place or above everything."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from urllib.parse import quote_plus

import pytest

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.matrix import matrix_of
from asbuilt_bim.report.page.trades import NO_TASK, trades_of
from asbuilt_bim.report.page.write import page_html, write_pages
from benchmarks.chromium import DRIVEN, opened_tab
from tests.report.sample_report import FIRST, HOSTILE_MARKUP, sample_report


def with_outlines(*outlines: tuple[str, ...]) -> ProgressReport:
    """Return a result of one task an outline; elements go to them in turn, storey by storey."""
    report = sample_report()
    like = report.tasks[0]
    tasks = []
    for number, outline in enumerate(outlines):
        own = tuple(e.global_id for e in report.elements[number :: len(outlines)])
        progress = replace(like.progress, key=f"t{number}", name=f"Task {number}", elements=own)
        tasks.append(replace(like, progress=progress, outline=outline))
    return replace(report, tasks=tuple(tasks))


def test_the_summary_above_a_task_is_its_trade_and_storeys_and_the_root_are_not() -> None:
    report = with_outlines(
        ("Block H", "Formwork", "Ground floor"), ("Block H", "first FLOOR ", "Concrete"), ("Block H", "Formwork")
    )
    trades = trades_of(report)
    assert trades.of == "trade" and trades.names == ("Formwork", "Concrete")
    assert trades.by_element[report.elements[1].global_id] == ("Concrete",)


@pytest.mark.parametrize(
    "outlines",
    [
        (("Ground floor",), ("First floor",)),  # storeys alone
        (("Block H",), ("Block H",)),  # above everything
        ((), ()),
        tuple((f"Trade {n}",) for n in range(9)),  # too many to be trades
    ],
)
def test_without_trades_the_columns_are_classes(outlines: tuple[tuple[str, ...], ...]) -> None:
    trades = trades_of(with_outlines(*outlines))
    assert trades.of == "class" and trades.names == ("Columns", "Walls")


def test_summaries_that_stand_for_one_storey_each_are_places() -> None:
    report = with_outlines(("Level A",), ("Level B",))
    tasks = []
    for task, above in zip(report.tasks, (False, True), strict=True):
        own = tuple(e.global_id for e in report.elements if (e.storey == FIRST) == above)
        tasks.append(replace(task, progress=replace(task.progress, elements=own)))
    assert trades_of(replace(report, tasks=tuple(tasks))).of == "class"


def test_a_cell_holds_its_elements_and_what_the_plan_wants_of_them() -> None:
    report = with_outlines(("Walls",), ("Columns",))
    first = replace(report.tasks[0], schedule_start=datetime(2026, 1, 1, 8), schedule_finish=datetime(2026, 1, 9, 17))
    second = replace(report.tasks[1], schedule_start=None, schedule_finish=None)
    short = replace(first, progress=replace(first.progress, elements=first.progress.elements[:-1]))
    report = replace(report, tasks=(short, second))
    matrix = matrix_of(report, frozenset({report.elements[0].global_id}))
    assert matrix is not None and matrix.trades.names == ("Walls", "Columns", NO_TASK)
    walls, columns, without = matrix.rows[-1].cells
    assert walls is not None and columns is not None and without is not None
    assert (walls.elements, columns.elements, without.elements) == (3, 4, 1)
    assert (walls.planned, columns.planned, walls.late) == (1.0, None, 1)
    assert "Storeys by trade" in page_html(report, {})


@pytest.mark.skipif(not DRIVEN, reason="no Chromium that can be driven is installed")
def test_a_click_on_a_cell_leaves_its_elements_alone_and_a_hostile_trade_is_text(tmp_path: Path) -> None:
    report = with_outlines((HOSTILE_MARKUP,), ("Columns",))
    page, _ = write_pages(report, {}, tmp_path)
    with opened_tab() as tab:
        tab.size(390)
        tab.open(page.as_uri())
        tab.click(".matrix tbody tr:first-child td:nth-child(3) a")
        tab.until("document.getElementById('count').textContent === '2'")
        assert "trade=Columns" in tab.value("location.hash")
        tab.value(f"location.hash = 'trade={quote_plus(HOSTILE_MARKUP)}'")
        tab.until("document.getElementById('count').textContent === '4'")
        assert tab.value("document.querySelectorAll('main script').length") == 0
        assert tab.faults == [] and tab.asked == []
