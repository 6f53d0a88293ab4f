"""What the plan wants of elements by a day: the mean over the tasks with dates that make them."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime

from asbuilt_bim.progress.completion.planned import calendar_of, planned_share
from asbuilt_bim.progress.report import ProgressReport

Spans = tuple[tuple[datetime, datetime], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedElements:
    """The elements that have planned dates, with their tasks' dates."""

    report: ProgressReport
    spans: Mapping[str, Spans]  # by GlobalId

    @property
    def days(self) -> list[date]:
        """Return every planned day."""
        return [moment.date() for spans in set(self.spans.values()) for span in spans for moment in span]

    def wanted(self, worth: Mapping[str, float]) -> "WantedWorth":
        """Return what the plan wants of worths by GlobalId; those without dates don't count."""
        by_spans: dict[Spans, float] = {}
        for key, amount in worth.items():
            if key in self.spans:
                by_spans[self.spans[key]] = by_spans.get(self.spans[key], 0.0) + amount
        return WantedWorth(report=self.report, by_spans=by_spans)


@dataclass(frozen=True, slots=True, kw_only=True)
class WantedWorth:
    """Worths by the dates that they are planned for: elements of one task are counted once."""

    report: ProgressReport
    by_spans: Mapping[Spans, float]

    @property
    def total(self) -> float:
        """Return what the plan wants in the end."""
        return sum(self.by_spans.values())

    def by(self, day: date) -> float:
        """Return what the plan wants by the end of a day."""
        calendar, wanted = calendar_of(self.report), 0.0
        for spans, amount in self.by_spans.items():
            shares = [planned_share(start, finish, day, calendar) for start, finish in spans]
            known = [share for share in shares if share is not None]
            wanted += amount * sum(known) / max(len(known), 1)
        return wanted


def planned_elements(report: ProgressReport) -> PlannedElements:
    """Return the elements of a result that have planned dates."""
    spans: dict[str, list[tuple[datetime, datetime]]] = {}
    for task in report.tasks:
        start, finish = task.schedule_start, task.schedule_finish
        if start is not None and finish is not None:
            for key in task.progress.elements:
                spans.setdefault(key, []).append((start, finish))
    known = {element.global_id for element in report.elements}
    return PlannedElements(report=report, spans={key: tuple(own) for key, own in spans.items() if key in known})
