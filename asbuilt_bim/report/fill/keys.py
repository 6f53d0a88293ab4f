"""What a result knows by each kind of key, and which keys stand for more than one thing."""

from collections import Counter, defaultdict
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field

from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.fill.mapping import TableMap
from asbuilt_bim.report.fill.quantities import OF_BILL_LINES, OF_COST_LINES, OF_ELEMENTS, OF_GROUPS, Quantity
from asbuilt_bim.report.fill.sheet import Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What a key stands for: its name for people, its quantities by name, and its unit (of a cost line)."""

    name: str
    quantities: Mapping[str, Quantity]
    unit: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyIndex:
    """What a result knows by key; `ambiguous` says of a key that stands for several things what they are.

    `former` are GlobalIds that an element had in earlier exports: a row may still name one.
    """

    known: dict[Hashable, Known] = field(default_factory=dict)
    ambiguous: dict[Hashable, str] = field(default_factory=dict)
    former: dict[Hashable, Hashable] = field(default_factory=dict)


def index_of(table: TableMap, report: ProgressReport) -> KeyIndex:
    """Return what rows of a table can stand for."""
    wanted = frozenset(table.columns.values())
    if table.key.global_id:
        return _elements(report, wanted)
    if table.key.cost_code:
        return _cost_lines(report, table.schedule, wanted)
    return _groups(report, wanted, by_type=bool(table.key.type_name))


def key_of(table: TableMap, values: tuple[Value, ...]) -> Hashable:
    """Return the key that the cells of a row make up; None where one of them is empty.

    Raises:
        ValueError: a number stands where a code is wanted, and 1.10 as a number is 1.1.
    """
    texts = [_text(value) for value in values]
    if not all(texts):
        return None
    return (_kind(texts[0]), *texts[1:]) if table.key.ifc_class else texts[0]


def _text(value: Value) -> str:
    if isinstance(value, float):
        if not value.is_integer():
            raise ValueError(
                f"holds the number {value:g}, and a code such as {value:g}0 would be the same: make it text"
            )
        value = int(value)
    return " ".join(str(value).split()) if value is not None else ""


def _kind(ifc_class: str) -> str:
    """Return a class as rows name it: IfcWall, IfcWallStandardCase and wall are one."""
    return ifc_class.casefold().removeprefix("ifc").removesuffix("standardcase").removesuffix("elementedcase")


def _elements(report: ProgressReport, wanted: frozenset[str]) -> KeyIndex:
    index = KeyIndex()
    for one in report.elements:
        values = {name: OF_ELEMENTS[name](one) for name in wanted}
        index.known[one.global_id] = Known(name=one.name or one.global_id, quantities=values)
    former = [(old, one.global_id) for one in report.elements for old in one.former_ids if old not in index.known]
    index.former.update(former)
    return index


def _cost_lines(report: ProgressReport, schedule: str, wanted: frozenset[str]) -> KeyIndex:
    index = KeyIndex()
    lines: dict[str, list[CostProgress]] = defaultdict(list)
    in_bill = {one.line.global_id: one for bill in bills(report) for one in bill.lines if not one.gone}
    for line in report.cost_lines:
        code = _text(line.identification)
        if code and schedule in ("", line.schedule):
            lines[code].append(line)
    for code, (first, *others) in lines.items():
        if others:
            names = ", ".join(
                f"'{one.name}'{f' of {one.schedule}' if one.schedule else ''}" for one in (first, *others)
            )
            index.ambiguous[code] = f"{len(others) + 1} cost lines have the code {code}: {names}; name one schedule"
        else:
            billed = in_bill[first.global_id]
            values: dict[str, Quantity] = {name: OF_COST_LINES[name](first) for name in wanted & OF_COST_LINES.keys()}
            values |= {name: OF_BILL_LINES[name](billed) for name in wanted & OF_BILL_LINES.keys()}
            index.known[code] = Known(name=first.name or code, quantities=values, unit=first.unit)
    return index


def _groups(report: ProgressReport, wanted: frozenset[str], *, by_type: bool) -> KeyIndex:
    index = KeyIndex()
    storeys = {storey.key: _text(storey.name) for storey in report.storeys}
    count = Counter(storeys.values())
    groups: dict[tuple[str, ...], list[ElementProgress]] = defaultdict(list)
    for element in report.elements:
        made_as = (_text(element.type_name),) if by_type else ()
        groups[_kind(element.ifc_class), storeys.get(element.storey, ""), *made_as].append(element)
    for key, members in groups.items():
        storey = key[1]
        if count[storey] > 1:
            again = f"{count[storey]} storeys are called '{storey}': give the rows GlobalIds instead"
            index.ambiguous[key] = again
        elif all(key):
            values = {name: OF_GROUPS[name](members) for name in wanted}
            index.known[key] = Known(name=", ".join(key), quantities=values)
    return index
