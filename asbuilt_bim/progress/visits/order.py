"""Which visits contradict one another in their order? Concrete doesn't vanish: one of two has other photos, maybe."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import combinations

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.states.doubts import GONE_M2

MOST_CHOICES = 16
"""Visits among which the likeliest to be wrong are sought, by trying all choices; of more, each that contradicts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """Two visits of which one saw built what the other, by its date the later one, sees open; its elements by name."""

    earlier: date
    later: date
    elements: tuple[str, ...]


def contradictions(reports: Sequence[ProgressReport]) -> tuple[Contradiction, ...]:
    """Return which of some visits contradict each other: those that saw built what a later one would undo."""
    found: list[Contradiction] = []
    for later in reports:
        for fault in later.rejections:
            gone = fault.values.get("global_ids") if fault.code is Reason.VISIT_UNDOES else None
            if not isinstance(gone, tuple):
                continue
            names = {element.global_id: element.name or element.global_id for element in later.elements}
            for earlier in (one for one in reports if one.visit_date < later.visit_date):
                seen = _saw_built(earlier) & {str(one) for one in gone}
                elements = tuple(names[str(one)] for one in gone if one in seen)
                days = {"earlier": earlier.visit_date, "later": later.visit_date}
                found += [Contradiction(**days, elements=elements)] if elements else []
    return tuple(found)


def likeliest_wrong(found: Sequence[Contradiction], sure: Collection[date] = ()) -> frozenset[date]:
    """Return the visits that are wrong in one of the likeliest explanations: those with the fewest wrong visits.

    Two that contradict each other may each be the wrong one, or have each other's photos: neither is known to be right.
    One that contradicts several, which agree, is wrong by itself. A visit whose photos say that they are of its day is
    `sure`: it is taken for wrong only where the others alone can't explain what contradicts.
    """
    days = sorted({day for one in found for day in (one.earlier, one.later)})
    for free in ([day for day in days if day not in sure], days):
        if len(free) > MOST_CHOICES:
            return frozenset(free)
        for count in range(len(free) + 1):
            choices = [set(c) for c in combinations(free, count)]
            enough = [c for c in choices if all(one.earlier in c or one.later in c for one in found)]
            if enough:
                return frozenset().union(*enough)
    return frozenset()


def refusals(found: Sequence[Contradiction], wrong: Collection[date]) -> Mapping[date, tuple[Rejection, ...]]:
    """Return for each visit that may be wrong a rejection of the visit: what contradicts it."""
    told: dict[date, tuple[Rejection, ...]] = {}
    for day in sorted(wrong):
        own = [one for one in found if day in (one.earlier, one.later)]
        others = sorted({(one.later if one.earlier == day else one.earlier).isoformat() for one in own})
        names = tuple(dict.fromkeys(name for one in own for name in one.elements))
        subject = about(SubjectKind.VISIT, day.isoformat())
        told[day] = (rejected(Reason.VISITS_CONTRADICT, subject, others=tuple(others), elements=names),)
    return told


def _saw_built(report: ProgressReport) -> set[str]:
    """Return the elements of which the visit's own stations decided a face of which a good piece is built."""
    surfaces = [record.surface for record in report.faces]
    return {one.element for one in surfaces if one.stations and one.built_area_m2 >= GONE_M2}
