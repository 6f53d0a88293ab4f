"""Every code has words, and every place in them is filled by the file that gives the code."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TypeGuard

import pytest

import asbuilt_bim
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about
from asbuilt_bim.report.wording.notes import NOTES, note_words
from tests.notes import unstated

PACKAGE = Path(asbuilt_bim.__file__).parent
CODES = (PACKAGE / "codes.py").read_text(encoding="utf-8")
OF_NOTES = [Reason[name] for name in re.findall(r"^    ([A-Z0-9_]+) = ", CODES.split("# Notes.")[1], re.MULTILINE)]
ANGLES = (0.0, 0.0035, -0.0002)
SAMPLES: Values = {
    **dict.fromkeys(("count", "of", "storeys", "others", "unknown", "linked", "cells", "fewest"), 1),
    **dict.fromkeys(("dated", "elements"), 1),
    **dict.fromkeys(("characters", "matches"), 7),
    **dict.fromkeys(("area_m2", "more_m2", "mean_m2", "sigma_m2", "design_m2", "length_m", "limit_m"), 1.25),
    **dict.fromkeys(("share", "coverage", "best", "lower", "upper", "area_effect", "area_effect_sigma"), 0.25),
    **dict.fromkeys(("hold_out_px", "rms_px", "rows_px", "left_px", "amount", "limit", "unit_scale"), 1.25),
    **dict.fromkeys(("certain", "planned", "sigmas"), 3.0),
    **dict.fromkeys(("ifc_class", "element", "thing", "global_id", "other", "error", "map", "other_file"), "Mauer"),
    **dict.fromkeys(
        ("other_map", "task", "end", "written", "duration", "item", "currency", "measure", "unit"), "Mauer"
    ),
    **dict.fromkeys(("column", "given", "missing", "kind", "model", "last_before", "first_after", "unit"), "Mauer"),
    **dict.fromkeys(("start", "finish", "since", "begun", "begin", "later"), "2026-03-02"),
    **dict.fromkeys(("ifc_dates", "takes_off", "rounded", "left_empty"), True),
    **dict.fromkeys(("elements", "tasks", "schedules", "stations", "visits", "columns"), ("A3",)),
    **dict.fromkeys(("gone", "added", "replaced", "files"), ("A3",)),
    **dict.fromkeys(("turn_rad", "turn_before_rad", "turn_after_rad"), ANGLES),
    **dict.fromkeys(("turn_sigma_rad", "turn_before_sigma_rad", "turn_after_sigma_rad"), ANGLES),
    "text": "Mauer",
    "cause": "survey shifted",
    "pair_rows_px": (0.41,),
    "move_m": (0.2, -0.1, 0.05),
    "turned_rad": 0.01,
    "offset_m": -0.12,
    "years": (1950, 2200),
    "tint": (0.2, 0.26),
    "counted": 1,
    **dict.fromkeys(("name", "first", "by", "why"), "Mauer"),
    **dict.fromkeys(("was", "now", "contract", "quantity", "design"), 12.5),
    **dict.fromkeys(("replaced_by", "meant"), "Mauer"),
    "known": ("A3",),
    **dict.fromkeys(("said",), True),
    **dict.fromkeys(("day", "visit", "today"), "2026-03-02"),
    "number": 2,
    **dict.fromkeys(("distance_m", "x_m", "y_m"), 0.3),
    "retention": 0.1,
    "tax": 0.19,
    "project_retention": 0.05,
    "project_tax": 0.07,
    "fits": 5,
    **dict.fromkeys(("sigma_m", "direction_sigma_rad", "second_away_m", "second_turned_rad", "second_chance"), 0.004),
    "second_storey": "Mauer",
    "lengths": 12,
    "program": "0.1.0, abc12345",
    **dict.fromkeys(("signed", "of_run"), (0.5,)),
    **dict.fromkeys(("yaw_rad", "yaw_sigma_rad"), 0.0006),
    **dict.fromkeys(("scale", "scale_sigma", "area_sigma_before", "area_sigma"), 0.004),
}


def sample(code: Reason, values: Values = SAMPLES) -> Note:
    return Note(code=code, subject=about(SubjectKind.FACE, "A3/2", "A3"), values=values)


def places(code: Reason) -> set[str]:
    """Return the values that a code's words need: those without which they fail or read otherwise."""
    whole, found = note_words(sample(code)), set()
    for key in SAMPLES:
        try:
            words = note_words(sample(code, {name: value for name, value in SAMPLES.items() if name != key}))
        except KeyError:
            words = ""
        if words != whole:
            found.add(key)
    return found


def test_every_code_of_a_note_has_words_and_no_other_code_is_among_them() -> None:
    assert set(NOTES) == {Reason.UNSTATED, *OF_NOTES}


def is_name(key: ast.expr | None) -> TypeGuard[ast.Constant]:
    return isinstance(key, ast.Constant)


def makes_a_note(node: ast.AST) -> TypeGuard[ast.Call]:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "noted"


@cache
def giving() -> dict[Path, str]:
    """Return the texts of the modules that may give a code, by path."""
    paths = (path for path in PACKAGE.rglob("*.py") if "wording" not in path.parts and path.name != "codes.py")
    return {path: path.read_text(encoding="utf-8") for path in paths}


@cache
def keys_in(path: Path) -> set[str]:
    """Return the keys of a module's dictionaries and of the notes that it makes."""
    tree = list(ast.walk(ast.parse(giving()[path])))
    given = {str(key.value) for one in tree if isinstance(one, ast.Dict) for key in one.keys if is_name(key)}
    return given | {key.arg for one in tree if makes_a_note(one) for key in one.keywords if key.arg}


@pytest.mark.parametrize("code", OF_NOTES)
def test_every_value_in_a_sentence_is_given_by_the_files_that_give_its_code(code: Reason) -> None:
    given = {
        key for path in giving() if re.search(rf"\bReason\.{code.name}\b", giving()[path]) for key in keys_in(path)
    }
    assert places(code) - {"ifc_dates"} <= given  # the link to the IFC's task says whose dates stand


@pytest.mark.parametrize("code", OF_NOTES)
def test_sentences_are_short(code: Reason) -> None:
    sentences = re.split(r"(?<=[.;:]) ", note_words(sample(code)))
    assert max(len(sentence.split()) for sentence in sentences) <= 30


@pytest.mark.parametrize(
    ("code", "values", "words"),
    [
        (Reason.SURFACE_UNCLEAR, {"area_m2": 3.5391}, "3.54 m² in photo G1 was unclear and not counted"),
        (Reason.STARTER_BARS, {"area_m2": 0.404}, "0.40 m² in photo G1 may be starter bars and was not counted"),
        (
            Reason.PHOTOS_DISAGREE,
            {"kind": "column", "element": "B1/1F", "cells": 2, "stations": ("G1", "U4")},
            "Photos disagree about part of Column B1/1F, built or not: it counts as not seen. "
            "Look at pictures G1 and U4",
        ),
        (
            Reason.PHOTOS_DISAGREE,
            {"kind": "column", "element": "B1/1F", "stations": ("G1", "U4"), "low_m": 0.93, "high_m": 1.38},
            "Photos disagree about part of Column B1/1F (0.9 to 1.4\N{NO-BREAK SPACE}m over its foot), built or not: "
            "it counts as not seen. Look at pictures G1 and U4",
        ),
        (
            Reason.PHOTOS_DISAGREE,
            {"kind": "wall", "element": "W", "cells": 1, "stations": ("G1",)},
            "Photo G1 shows part of Wall W both built and not: it counts as not seen. Look at the picture",
        ),
        (
            Reason.OVERRIDE_UNREADABLE,
            {"written": "50"},
            "last workbook, G1/2: the override reads 5000 %, and was left out. Write one from 0 % to 100 %",
        ),
        (
            Reason.OVERRIDE_UNREADABLE,
            {"written": "80 %"},
            "last workbook, G1/2: the override is the text '80 %' and no number, and was left out. Give the cell the "
            "number format of a percentage, and type it as 50 %",
        ),
        (Reason.SEEN_LITTLE, {"coverage": 0.379}, "Only 37 % of it was seen: too little to say"),
        (
            Reason.STATIONS_NOT_USED,
            {"stations": ("A1", "A2")},
            "Stations A1, A2 of the visit of 2026-03-02 could not be used and count for nothing here",
        ),
        (Reason.NO_BODY, {"elements": ("a", "b"), "count": 5}, "no usable body, so not measured: a, b and 3 more"),
    ],
)
def test_notes_read_as_one_would_say_them_on_site(code: Reason, values: Values, words: str) -> None:
    subject = about(SubjectKind.FACE, "2026-03-02" if code == Reason.STATIONS_NOT_USED else "G1/2", "G1")
    assert note_words(Note(code=code, subject=subject, values=values)) == words


def test_braces_in_a_name_from_a_file_are_no_places_to_fill() -> None:
    values: Values = {**SAMPLES, "element": "{subject.__class__}", "tasks": ("{count}",)}
    assert "{subject.__class__}" in note_words(sample(Reason.TOUCHED_ALL_OVER, values))
    assert "'{count}'" in note_words(sample(Reason.SCHEDULE_AMBIGUOUS, values))
    assert note_words(unstated("{text} {0}")) == "{text} {0}"


def test_a_place_by_two_faces_and_a_small_chance_read_as_one_would_say_them() -> None:
    second: Values = {"second_away_m": 2.0, "second_turned_rad": 0.1, "second_chance": 2e-6, "second_storey": ""}
    values: Values = {"fits": 2, "sigma_m": 0.01, "direction_sigma_rad": 0.001, **second}
    note = Note(code=Reason.PLACED_BY_DESIGN, subject=about(SubjectKind.STATION, "G5"), values=values)
    assert "few by themselves" in note_words(note) and "Its chance is one in 500,000" in note_words(note)
    assert "few by themselves" not in note_words(replace(note, values={**values, "fits": 3}))


def test_an_angle_of_a_refined_rig_that_was_held_is_said_to_be_as_calibrated() -> None:
    values: Values = {**SAMPLES, "turn_rad": (0.001, 0.0, 0.0), "turn_sigma_rad": (0.0002, 0.0, 0.0003)}
    words = note_words(sample(Reason.RIG_USED_REFINED, values))
    assert "pitch +0.057° ± 0.011°, yaw as calibrated, roll +0.000° ± 0.017°" in words
