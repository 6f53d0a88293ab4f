"""`report-interactive.html`: the same result to search, filter and sort; one script of our own, no request.

What a name may do is decided here. Values go in as JSON without `<`, `>` and `&`, and the script makes text of them.
What the templates have drawn and escaped goes in packed (deflate, base64), a storey at a time, and is unpacked when it
is opened. The page's policy runs no script but the one whose digest it names.
"""

import base64
import hashlib
import json
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment
from markupsafe import Markup

from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.report.page.cards import ElementCard, tasks_by_element
from asbuilt_bim.report.page.context import Context
from asbuilt_bim.report.page.trades import trades_of
from asbuilt_bim.report.wording.completion import at_most, best_words, seen_words
from asbuilt_bim.report.wording.of_page.class_words import class_word
from asbuilt_bim.report.wording.values import area_of, day, millimetres, percent_certain, plain

SCRIPT = Path(__file__).parent / "templates" / "interactive.js"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pack:
    """A part of the page that is unpacked when it is opened."""

    key: str
    packed: str


def interactive_from(context: Context, templates: Environment) -> str:
    """Return the page of a context that has its panels."""
    script = SCRIPT.read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    own = {
        "interactive": True,
        "has_trades": trades_of(context["report"]).of == "trade",
        "has_zones": any(card.element.zones for card in context["cards"]),
        "script": Markup(script),  # ours, and without a closing tag
        "script_digest": f"sha256-{digest}",
        "rows": Markup(json_in_html(element_columns(context))),
        "packs": _packs(context),
    }
    return templates.get_template("interactive.html.j2").render({**context, **own})


def json_in_html(value: object) -> str:
    """Write JSON that can stand within a script element: no character of it can end or open a tag."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def element_columns(context: Context) -> dict[str, object]:
    """Return the elements by columns, in the order of the cards: what they are filtered and sorted by, and read as."""
    report: ProgressReport = context["report"]
    cards: Sequence[ElementCard] = context["cards"]
    elements = [card.element for card in cards]
    of_tasks = tasks_by_element(report)
    storeys, tasks = _distinct(card.storey for card in cards), _distinct(t for card in cards for t in card.tasks)
    zones = _distinct(sorted(zone for card in cards for zone in card.element.zones))
    trades = trades_of(report)
    late = {row.global_id: row.late_days for card in cards for row in card.late}
    named = {task: number for number, task in enumerate(tasks)}
    columns: dict[str, Sequence[object]] = {
        "id": [e.global_id for e in elements],
        "name": [plain(e.name) for e in elements],
        "class": [class_word(e.ifc_class) for e in elements],
        "storey": [storeys.index(card.storey) for card in cards],
        "state": [e.shown_state for e in elements],
        "task": [[named[task] for task in of_tasks.get(e.global_id, ())] for e in elements],
        "zone": [[zones.index(zone) for zone in card.element.zones] for card in cards],
        "trade": [[trades.names.index(name) for name in trades.by_element[e.global_id]] for e in elements],
        "only": _flags(context, elements),
        "lower": [round(e.completion.lower, 4) for e in elements],
        "upper": [round(e.completion.upper, 4) for e in elements],
        "seen": [round(e.completion.coverage, 4) for e in elements],
        "area": [_rounded(e.as_built_area_m2) for e in elements],
        "offset": [_rounded(None if e.offset_m is None else abs(e.offset_m)) for e in elements],
        "late": [late.get(e.global_id) for e in elements],
    }
    tables = {"storeys": [plain(one) for one in storeys], "tasks": [plain(one) for one in tasks]}
    tables["zones"] = [plain(one) for one in zones]
    tables["trades"] = [plain(one) for one in trades.names]
    return {**tables, "states": list(context["order"]), "columns": columns, "words": _words(context, elements)}


def _words(context: Context, elements: Sequence[ElementProgress]) -> dict[str, list[str]]:
    """Return by columns what the table's cells read."""
    sides = context["photographed"]
    return {
        "lower": [percent_certain(e.completion.lower) for e in elements],
        "upper": [at_most(e.completion.upper) for e in elements],
        "best": [best_words(e.completion) for e in elements],
        "seen": [seen_words(e.completion) for e in elements],
        "area": [
            area_of(e.as_built_area_m2, e.as_built_sigma_m2, sides.get(e.global_id, 0.0)).removesuffix(" m²")
            for e in elements
        ],
        "offset": [millimetres(e.offset_m, e.offset_sigma_m) for e in elements],
        "tolerance": [e.tolerance.verdict if e.tolerance else "" for e in elements],
        "last": [day(e.last_seen) for e in elements],
    }


def _flags(context: Context, elements: Sequence[ElementProgress]) -> list[list[str]]:
    """Return by which of the page's short lists each element is found."""
    lists = {
        "late": {row.global_id for row in context["late"]},
        "next": {row.element.global_id for row in context["next_rows"]},
        "since": {row.now.global_id for row in context["since"] if row.now},
        **{
            name: {e.global_id for e in elements if e.tolerance and e.tolerance.verdict == name}
            for name in ("in", "out")
        },
        "doubt": {e.global_id for e in elements if e.doubts or e.cells_conflict > 0},
    }
    return [[name for name, members in lists.items() if e.global_id in members] for e in elements]


def _packs(context: Context) -> list[Pack]:
    """Pack the elements' cards by storey, the plans, and the stations."""
    cards: Sequence[ElementCard] = context["cards"]
    storeys = _distinct(card.storey for card in cards)
    by_storey: list[dict[str, str]] = [{} for _ in storeys]
    for card, html in zip(cards, context["card_html"], strict=True):
        by_storey[storeys.index(card.storey)][card.element.global_id] = html
    found = [_pack(f"cards-{number}", one) for number, one in enumerate(by_storey)]
    names = [card.row.name for card in context["stations"]]
    stations = dict(zip(names, context["station_html"], strict=True))
    return [*found, _pack("plans", list(context["plan_html"])), _pack("stations", stations)]


def _pack(key: str, value: object) -> Pack:
    """Pack a value as JSON."""
    data = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "replace")
    return Pack(key=key, packed=base64.b64encode(zlib.compress(data, 9)).decode("ascii"))


def _distinct(names: Iterable[str]) -> list[str]:
    """Return names once each, in their order."""
    return list(dict.fromkeys(names))


def _rounded(value: float | None) -> float | None:
    """Round to a tenth of a millimetre: what rows are sorted by, never shown."""
    return None if value is None else round(value, 4)
