"""Damaged workbooks are filled or refused in words, within seconds: never a traceback, never a hanging program."""

from __future__ import annotations

import io
import random
import time
import zipfile
from pathlib import Path

import pytest

from asbuilt_bim.errors import FillError
from asbuilt_bim.report.fill.write import fill_workbook, read_map
from benchmarks.valuation.books import Book, by_hand, by_openpyxl, by_xlsxwriter, saved_report

HARM = (
    *(b"<", b">", b'"', b'r="A0"', b"&#0;", b"\xff", b"-1", b"9" * 20, b"<row>", b"</row>", b"<c/>", b't="s"', b"nan"),
    *(b'<f t="shared" si="0"/>', b'<f t="array" ref="A1:XFD1048576">A1</f>', b'<mergeCell ref="A1:XFD1048576"/>'),
)
ROUNDS = 40


def damaged(data: bytes, dice: random.Random) -> bytes:
    """Return an archive with harm in one of its XML parts."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        victim = dice.choice([name for name in old.namelist() if name.endswith((".xml", ".rels"))])
        for name in old.namelist():
            part = old.read(name)
            if name == victim:
                at, cut = dice.randrange(len(part) + 1), dice.choice([0, 0, 1, 5, 40])
                part = part[:at] + dice.choice(HARM) + part[at + cut :]
            new.writestr(name, part)
    return out.getvalue()


@pytest.fixture(scope="module")
def books(tmp_path_factory: pytest.TempPathFactory) -> list[Book]:
    folder = tmp_path_factory.mktemp("books")
    report = saved_report(folder)
    return [make(folder, report) for make in (by_xlsxwriter, by_openpyxl, by_hand)]


@pytest.mark.parametrize("number", range(3))
def test_a_damaged_workbook_is_filled_or_refused_in_words(number: int, books: list[Book], tmp_path: Path) -> None:
    book, report = books[number], saved_report(tmp_path)
    path, mapping = tmp_path / "case.xlsx", read_map(book.map)
    said = set()
    for seed in range(ROUNDS):
        path.write_bytes(damaged(book.path.read_bytes(), random.Random(seed)))
        begun = time.process_time()
        try:
            fill_workbook(path, mapping, report)
            said.add("filled")
        except FillError as refusal:
            assert str(path) in str(refusal)
            said.add("refused")
        assert time.process_time() - begun < 20.0, seed
    assert said == {"filled", "refused"}
