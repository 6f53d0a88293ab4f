"""The visits as a time series: one IfcPerformanceHistory for each element, storey and task that is known of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from asbuilt_bim.ifc.names import AS_BUILT, HISTORY, HISTORY_SET, PropertyKind
from asbuilt_bim.ifc.write.entities import Marker
from asbuilt_bim.progress.report import Completion, ProgressReport

RESULT = "result.json"
"""The file beside the copy that the series come from."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """What one visit found of a thing."""

    day: date
    completion: Completion
    as_built_area_m2: float | None

    def value(self, name: str) -> float | None:
        """Return the value of one of the series of `HISTORY`; None where the visit could not tell."""
        if name == "AsBuiltArea":
            return self.as_built_area_m2
        done = self.completion
        return {"CompletionBest": done.best_shown, "CompletionLower": done.lower, "CompletionUpper": done.upper}[name]


def samples_of(reports: Sequence[ProgressReport]) -> dict[str, list[Sample]]:
    """Return what each visit found of each element, storey and task, by GlobalId, in the order of the days."""
    found: dict[str, list[Sample]] = {}
    for report in sorted(reports, key=lambda one: one.visit_date):
        day = report.visit_date
        for element in report.elements:
            sample = Sample(day=day, completion=element.completion, as_built_area_m2=element.as_built_area_m2)
            found.setdefault(element.global_id, []).append(sample)
        for group in (*report.storeys, *(task.progress for task in report.tasks)):
            sample = Sample(day=day, completion=group.completion, as_built_area_m2=None)
            found.setdefault(group.key, []).append(sample)
    return found


class HistoryWriter:
    """Writes histories into one file; the moments of the visits are made once and shared."""

    def __init__(self, marker: Marker, reports: Sequence[ProgressReport]) -> None:
        self._marker = marker
        self._samples: Mapping[str, list[Sample]] = samples_of(reports)
        self._moments: dict[date, Any] = {}
        self._made: list[Any] = []

    def write(self, thing: Any) -> None:
        """Give a thing the history of its visits; a visit that knew nothing of it has no value."""
        samples = [one for one in self._samples.get(thing.GlobalId, ()) if one.completion.coverage > 0.0]
        series = [made for name, (kind, _) in HISTORY.items() if (made := self._series(name, kind, samples))]
        if not series:
            return
        marker, key = self._marker, f"{thing.GlobalId}/history"
        history = marker.rooted(
            "IfcPerformanceHistory",
            key,
            Name="As-built progress",
            ObjectType=AS_BUILT,
            LifeCyclePhase="CONSTRUCTION",
            **({} if marker.schema == "IFC2X3" else {"PredefinedType": "USERDEFINED"}),
        )
        marker.rooted("IfcRelAssignsToControl", f"{key}/rel", RelatedObjects=[thing], RelatingControl=history)
        marker.add_set(history, HISTORY_SET, series)

    def finish(self) -> None:
        """Name the source of all series, which IFC4 demands of each; IFC2X3 has no place for it."""
        if not self._made or self._marker.schema == "IFC2X3":
            return
        make = self._marker.file.create_entity
        source = make("IfcDocumentReference", Location=RESULT, Name="result of asbuilt_bim")
        make(
            "IfcExternalReferenceRelationship",
            Name=HISTORY_SET,
            RelatingReference=source,
            RelatedResourceObjects=self._made,
        )

    def _series(self, name: str, kind: PropertyKind, samples: Sequence[Sample]) -> Any:
        known = [(one.day, value) for one in samples if (value := one.value(name)) is not None]
        if not known:
            return None
        marker, make = self._marker, self._marker.file.create_entity
        values = [
            make("IfcIrregularTimeSeriesValue", self._moment(day), [marker.measure(kind, value)])
            for day, value in known
        ]
        series = make(
            "IfcIrregularTimeSeries",
            Name=name,
            StartTime=self._moment(known[0][0]),
            EndTime=self._moment(known[-1][0]),
            TimeSeriesDataType="DISCRETE",
            DataOrigin="MEASURED",
            Values=values,
        )
        self._made.append(series)
        return make("IfcPropertyReferenceValue", Name=name, PropertyReference=series)

    def _moment(self, day: date) -> Any:
        if day not in self._moments:
            self._moments[day] = self._marker.moment(day)
        return self._moments[day]
