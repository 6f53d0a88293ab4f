from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Annotated, Any, Literal

import pytest

from asbuilt_bim.storage.structure import Problems, Within, structure


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    size_m: Annotated[float, Within(low=0.1, high=2, unit="m", hint="millimetres?")]
    kind: Literal["round", "square"] = "round"
    day: date | None = None

    def __post_init__(self) -> None:
        if self.kind == "square" and self.day is None:
            raise ValueError("a square part needs a day")


@dataclass(frozen=True, slots=True, kw_only=True)
class Whole:
    name: str
    count: int = 3
    on: bool = False
    parts: tuple[Part, ...] = ()
    weights: dict[str, float] = field(default_factory=dict)
    pair: tuple[float, float] = (0.0, 1.0)
    several: tuple[str, ...] | str = ()
    computed: complex = 0j


def mistakes(value: object) -> list[str]:
    problems = Problems()
    structure(value, Whole, problems)
    return [f"{p.path}: {p.text}" for p in problems.found]


def test_good_values_become_dataclasses_all_the_way_down() -> None:
    problems = Problems()
    made = structure(
        {"name": "x", "parts": [{"size_m": 1, "day": date(2026, 3, 2)}], "weights": {"a": 1}, "pair": [1, 2]},
        Whole,
        problems,
    )
    assert problems.found == []
    assert made == Whole(name="x", parts=(Part(size_m=1.0, day=date(2026, 3, 2)),), weights={"a": 1.0}, pair=(1.0, 2.0))


def test_a_day_in_quotes_is_that_day() -> None:
    problems = Problems()
    assert structure({"size_m": 1, "day": "2026-03-02"}, Part, problems).day == date(2026, 3, 2)
    assert structure({"size_m": 1, "day": "02.03.2026"}, Part, problems) is None
    assert [found.text for found in problems.found] == ["expected a date such as 2026-03-02, got '02.03.2026'"]


def test_every_mistake_is_found_in_one_go() -> None:
    found = mistakes(
        {"nam": "x", "count": 1.5, "on": "yes", "parts": [{"size_m": 300}, {"kind": "sqare", "size_m": 1}]}
    )
    assert found == [
        "count: expected a whole number, got 1.5",
        "on: expected true or false, got 'yes'",
        "parts[0].size_m: expected 0.1 to 2 m, got 300 m; millimetres?",
        "parts[1].kind: expected 'round' or 'square', got 'sqare'; did you mean square?",
        "nam: unknown key; did you mean name?",
    ]


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ({"name": 12}, "name: expected text (a number or a date in quotes), got 12"),
        ({"name": " "}, "name: expected text (a number or a date in quotes), got ' '"),
        ({"name": None}, "name: expected text (a number or a date in quotes), got nothing"),
        ({"name": {"file": "cp.csv"}}, "name: expected a file's name alone; write cp.csv without {file: }"),
        ({"name": "x", "count": True}, "count: expected a whole number, got true"),
        ({"name": "x", "count": "3"}, "count: expected a whole number, got '3'"),
        ({"name": "x", "weights": {"a": True}}, "weights.a: expected a number, got true"),
        ({"name": "x", "parts": [{"size_m": "1"}]}, "parts[0].size_m: expected a number, got '1'"),
        (
            {"name": "x", "several": None},
            "several: expected a list (lines that start with '- '), or text; nothing stands there",
        ),
        ({"name": "x", "several": ["a", 1]}, "several[1]: expected text"),
        ({"name": "x", "computed": 3}, "computed: expected nothing in a file, got 3"),
        ({"name": "x", "pair": [1, float("nan")]}, "pair[1]: expected a number, got nan"),
        ({"name": "x", "pair": [1]}, "pair: expected a list of 2 values, got [1]"),
        ({"name": "x", "parts": {"size_m": 1}}, "parts: expected a list"),
        ({"name": "x", "weights": {"a": "b"}}, "weights.a: expected a number, got 'b'"),
        ({"name": "x", "parts": [{"size_m": 1, "kind": "square"}]}, "parts[0]: a square part needs a day"),
        ({"name": "x", "parts": [{"size_m": 1, "day": "soon"}]}, "parts[0].day: expected a date such as 2026-03-02"),
        ({"name": "x", "parts": [{"size_m": 1, "day": datetime(2026, 3, 2)}]}, "parts[0].day: expected a date such as"),
        ([1], ": expected keys with values, such as name, count, got [1]"),
    ],
)
def test_each_wrong_value_is_named_with_what_was_expected(value: Any, says: str) -> None:
    assert any(says in found for found in mistakes(value)), mistakes(value)


@pytest.mark.parametrize("digits", [30, "08"])  # YAML takes 08 for text
def test_a_decimal_comma_in_a_mapping_is_named_as_one(digits: int | str) -> None:
    problems = Problems()
    structure({"size_m": 0.3, digits: None}, Part, problems)
    assert [problem.text for problem in problems.found] == ["unknown key; a decimal comma? write a point"]
