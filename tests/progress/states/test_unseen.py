"""What no station sees is counted, and not judged: neither at the first visit nor at those after it."""

from __future__ import annotations

from datetime import date

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.states import classify
from asbuilt_bim.project.options import Options
from asbuilt_bim.report.result.convert import report_to_plain
from tests.ifc.models import ModelBuilder

_FIRST, _SECOND = date(2026, 3, 2), date(2026, 3, 16)


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> BimModel:
    builder = ModelBuilder()
    for number in range(4):
        builder.box("IfcWall", f"W{number}", (0.0, 3.0 * number, 0.0), (5.0, 0.2, 3.0))
    builder.box("IfcSlab", "S", (0.0, 0.2, 1.0), (5.0, 2.8, 0.2))
    return read_design(builder.write(tmp_path_factory.mktemp("unseen") / "model.ifc"))


def _visit(design: BimModel, history: VisitHistory, day: date) -> ProgressReport:
    return monitor((), (), (), design, history, day, Options())


def test_no_element_that_no_station_sees_is_judged(design: BimModel, monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[object] = []
    monkeypatch.setattr(classify, "decide_element", lambda *asked: judged.append(asked))
    first = _visit(design, EMPTY_HISTORY, _FIRST)
    second = _visit(design, remember(EMPTY_HISTORY, first), _SECOND)
    assert not judged
    assert [element.cells_unknown for element in second.elements] == [12.0 * 20.0] * 4


def test_a_second_visit_that_sees_nothing_says_what_judging_would(
    design: BimModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    history = remember(EMPTY_HISTORY, _visit(design, EMPTY_HISTORY, _FIRST))
    counted = report_to_plain(_visit(design, history, _SECOND))
    monkeypatch.setattr(classify, "knows_anything", lambda state: state is not None)
    assert report_to_plain(_visit(design, history, _SECOND)) == counted
