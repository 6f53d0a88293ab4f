"""What a person has to know of cost lines, wherever they were read."""

from collections.abc import Iterator, Sequence

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, Values, about, noted

MOST_TWICE = 10


def cost_notes(lines: Sequence[CostLine]) -> list[Note]:
    """Return the notes on the lines of a file; of those that repeat each other the first few."""
    unmeasured = [_unmeasured(line) for line in lines if line.others]
    schedules = sorted({line.schedule for line in lines})
    several = [noted(Reason.COST_SCHEDULES_SEVERAL, about(SubjectKind.DESIGN), count=len(schedules))]
    credits = [_takes_off(line) for line in lines if line.planned_quantity * line.rate < 0.0]
    return [*unmeasured, *credits, *(several if len(schedules) > 1 else ()), *list(_paid_twice(lines))[:MOST_TWICE]]


def _unmeasured(line: CostLine) -> Note:
    values: Values = {"item": _label_of(line), "others": line.others, "of": len(line.elements) + line.others}
    return noted(Reason.COST_PART_UNMEASURED, _subject(line), **values)


def _takes_off(line: CostLine) -> Note:
    amount = abs(line.planned_quantity * line.rate)
    return noted(Reason.COST_TAKES_OFF, _subject(line), item=_label_of(line), amount=amount, currency=line.currency)


def _paid_twice(lines: Sequence[CostLine]) -> Iterator[Note]:
    """Name the lines of one schedule that pay for an element by the same measure as a line before them."""
    first: dict[tuple[str, str, str], CostLine] = {}
    for line in lines:
        keys = [(line.schedule, line.measure, element) for element in line.elements]
        for old in dict.fromkeys(_label_of(first[key]) for key in keys if key in first):
            yield noted(Reason.COST_PAID_TWICE, _subject(line), item=_label_of(line), other=old, measure=line.measure)
        first |= {key: line for key in keys if key not in first}


def _subject(line: CostLine) -> Subject:
    return about(SubjectKind.COST_LINE, line.global_id)


def _label_of(line: CostLine) -> str:
    return line.name or line.global_id
