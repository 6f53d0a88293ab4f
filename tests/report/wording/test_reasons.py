"""The English of rejections: every code has words, every word its values, and nothing else reads or makes any."""

from __future__ import annotations

import ast
import string
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import asbuilt_bim
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value
from asbuilt_bim.errors import Rejection
from asbuilt_bim.report.wording.notes import NOTES
from asbuilt_bim.report.wording.reasons import REJECTIONS, words_of
from asbuilt_bim.report.wording.words import Words, fill

PACKAGE = Path(asbuilt_bim.__file__).parent
WORDING = PACKAGE / "report" / "wording"
TEXTS = {"reason", "remedy", "what", "part", "value", "limit"}
"""Fields of words: for people only."""
LOOKS = {"startswith", "endswith", "removeprefix", "removesuffix", "partition", "rpartition", "split", "find", "count"}


@cache
def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if WORDING not in path.parents)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def codes_in(path: Path) -> list[tuple[str, set[str] | None]]:
    """Return each code that a module gives a rejection, with the keys of its values where they are written there."""
    found: list[tuple[str, set[str] | None]] = []
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "rejected":
            code = node.args[0]
            if isinstance(code, ast.Attribute) and isinstance(code.value, ast.Name) and code.value.id == "Reason":
                found.append((code.attr, keys_of(node.keywords)))
    return found


def keys_of(values: list[ast.keyword]) -> set[str] | None:
    """Return the keys of the values that are written there, None where some are made elsewhere."""
    keys = {word.arg for word in values if word.arg is not None}
    return keys if len(keys) == len(values) else None


def used() -> set[str]:
    """Return every code that stands in a module outside the wording."""
    return {
        node.attr
        for path in modules()
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "Reason"
    }


def test_every_code_of_a_rejection_has_words_and_every_words_a_code_that_is_given() -> None:
    given = {Reason[name] for path in modules() for name, _ in codes_in(path)}
    assert given and given <= REJECTIONS.keys()
    assert set(Reason) <= REJECTIONS.keys() | NOTES.keys() | {Reason.UNSTATED}, "a code without words"
    assert {code.name for code in REJECTIONS} <= used(), "words that no module can ever ask for"


@pytest.mark.parametrize("code", sorted(REJECTIONS), ids=lambda code: code.name)
def test_what_a_template_is_filled_with_is_what_the_code_gives(code: Reason) -> None:
    sentence = REJECTIONS[code]
    keys = [keys for path in modules() for name, keys in codes_in(path) if name == code.name and keys is not None]
    if not isinstance(sentence, Words):
        return
    texts = (getattr(sentence, name) for name in TEXTS)
    wanted = {name for text in texts for _, name, _, _ in string.Formatter().parse(text) if name} - {"name"}
    for own in keys:
        assert wanted <= own, f"{code.name} wants {wanted - own}"


def test_units_are_written_as_the_report_writes_them() -> None:
    values = {
        "share": 0.305,
        "sigma_m": 0.0123,
        "turn_rad": 0.5,
        "area_m2": 1.234,
        "size_px": (4, 3),
        "ids": ("a", "b"),
    }
    text = fill("{share:.0%} {share:+.1%} {sigma_m:mm} {turn_rad:.0fdeg} {area_m2:m2} {size_px:px} {ids:all}", values)
    assert text == "30 % +30.5 % 12 mm 29° 1.23 m² 4 x 3 px a, b"


def test_a_name_with_braces_is_no_template() -> None:
    subject = Subject(kind=SubjectKind.PHOTO, name="{left}.jpg", station="A{1}")
    words = words_of(Rejection(code=Reason.PHOTO_UNUSABLE, subject=subject, values={"detail": "{oops}: cut short"}))
    assert str(words) == "station A{1}, photo {left}.jpg: {oops}: cut short"
    assert words.at_station == "photo {left}.jpg: {oops}: cut short"


def test_a_sentence_reads_as_one_line_with_value_limit_and_remedy() -> None:
    rejection = Rejection(
        code=Reason.PHOTOS_ROWS_APART,
        subject=Subject(kind=SubjectKind.STATION, name="A3"),
        values={"rows_px": 6.04, "limit_px": 2.0},
    )
    assert str(words_of(rejection)) == (
        "station A3: rows of left and right don't correspond: the rig was knocked, or the photos are of another rig "
        "(rows 6.0 px apart, limit 2 px); calibrate the rig again, and take the station again"
    )


def test_a_sigma_over_its_limit_does_not_read_as_its_limit() -> None:
    face = Subject(kind=SubjectKind.FACE, name="A/x1", station="A")
    values: dict[str, Value] = {"label": "wall", "area_m2": 6.0, "distance_m": 37.9, "limit_share": 0.2}
    told = {
        share: words_of(Rejection(code=Reason.FACE_UNCERTAIN, subject=face, values=values | {"sigma_share": share}))
        for share in (0.204, 0.35)
    }
    assert [(one.value, one.limit) for one in told.values()] == [
        ("sigma 20.4 % of its area", "20 %"),
        ("sigma 35 % of its area", "20 %"),
    ]


def test_where_all_of_it_fits_the_design_and_may_be_chance_that_is_what_is_said() -> None:
    def told(fits: int) -> str:
        subject = Subject(kind=SubjectKind.STATION, name="G2")
        return str(
            words_of(Rejection(code=Reason.DESIGN_NOT_FOUND, subject=subject, values={"faces": 3, "fits": fits}))
        )

    assert "all its 3 measured faces fit" in told(3) and "may be chance" in told(3) and "nothing" not in told(3)
    assert "at best 2 of 3 measured faces do" in told(2)


def reads_words(tree: ast.AST) -> Iterator[int]:
    """Yield the lines that look into a rejection's words: `x.reason.startswith(...)`, `"knocked" in x.reason`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in LOOKS and is_text(node.value):
            yield node.lineno
        if isinstance(node, ast.Compare) and any(is_text(part) for part in (node.left, *node.comparators)):
            yield node.lineno


def is_text(node: ast.AST) -> bool:
    """Say whether an expression is a text of words: `r.reason`, `words_of(r).what`, `str(words_of(r))`."""
    if isinstance(node, ast.Attribute) and node.attr in TEXTS - {"value", "limit"}:
        return True
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id == "words_of" or (node.func.id == "str" and any(map(is_text, node.args)))
    return False


@pytest.mark.parametrize("path", modules(), ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_no_module_reads_what_a_rejection_says(path: Path) -> None:
    assert list(reads_words(parsed(path))) == []


@pytest.mark.parametrize(
    "line",
    [
        'x = "knocked" in rejection.reason',
        'x = r.what == "survey"',
        'x = one.reason.startswith("the rig")',
        'x = str(words_of(r)).removeprefix("station")',
        'x = words_of(r).what.split(",")',
    ],
)
def test_reading_words_would_be_found(line: str) -> None:
    assert list(reads_words(ast.parse(line))) == [1]
