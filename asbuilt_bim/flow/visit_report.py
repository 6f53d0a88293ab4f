"""What a visit's report says beyond its own photos: photo paths, and what other visits have to do with it."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, each_once, noted
from asbuilt_bim.errors import Rejection
from asbuilt_bim.flow.measure_visit import picture_name
from asbuilt_bim.match.survey_trust import SHIFTS
from asbuilt_bim.progress.report import OF_SCALE, ProgressReport
from asbuilt_bim.project.check import NEAR
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.report.tables import lost_stations


def with_undoing_noted(reports: Sequence[ProgressReport]) -> tuple[ProgressReport, ...]:
    """Say in a report that counts which later visit would undo what it saw: that one has older photos, it seems."""
    told: list[ProgressReport] = []
    for index, report in enumerate(reports):
        later = [one for one in reports[index + 1 :] if any(r.code is Reason.VISIT_UNDOES for r in one.rejections)]
        subject = about(SubjectKind.VISIT, report.visit_date.isoformat())
        notes = [noted(Reason.LATER_VISIT_UNDOES, subject, later=one.visit_date.isoformat()) for one in later]
        told.append(report if report.nothing_seen else replace(report, notes=(*notes, *report.notes)))
    return tuple(told)


def with_exchange_named(reports: Sequence[ProgressReport]) -> tuple[ProgressReport, ...]:
    """Say of two visits, all of whose photos say the other's day, that they are exchanged."""
    said = {report.visit_date: _day_said(report) for report in reports}
    told: list[ProgressReport] = []
    for report in reports:
        day = report.visit_date
        other = next(
            (one for one in said if one != day and _is_near(said[day], one) and _is_near(said[one], day)), None
        )
        if other is None:
            told.append(report)
            continue
        exchanged = {"exchanged_with": other.isoformat()}
        rejections = [
            replace(one, values={**one.values, **exchanged}) if one.code is Reason.PHOTOS_OF_OTHER_DAY else one
            for one in report.rejections
        ]
        told.append(replace(report, rejections=tuple(rejections)))
    return tuple(told)


def _day_said(report: ProgressReport) -> date | None:
    """Return the other day that every station's photos say, None where they don't, or not all the same."""
    for one in report.rejections:
        days = one.values.get("days") if one.code is Reason.PHOTOS_OF_OTHER_DAY else None
        if isinstance(days, tuple) and len(days) == one.values["count"] and len(set(days)) == 1:
            return date.fromisoformat(str(days[0]))
    return None


def _is_near(said: date | None, day: date) -> bool:
    return said is not None and abs(said - day) <= NEAR


def left_out_before(past: Sequence[ProgressReport]) -> list[Note]:
    """Return the notes on stations that visits carried over could not use, their own and those they had from before."""
    notes: list[Note] = []
    for report in past:
        notes += [note for note in report.notes if note.code == Reason.STATIONS_NOT_USED]
        notes += left_out([row.name for row in lost_stations(report)], report.visit_date)
    return list(each_once(notes))


def left_out(names: Sequence[str], day: date) -> list[Note]:
    """Return a note for the reports of later visits, where stations of a day count for nothing."""
    subject = about(SubjectKind.VISIT, day.isoformat())
    return [noted(Reason.STATIONS_NOT_USED, subject, stations=tuple(names))] if names else []


def named(report: ProgressReport, project: Project, visit: Visit) -> ProgressReport:
    """Return a report with the project's name and the stations' photo paths, which pure code doesn't know."""
    photos = {station.name: station for station in visit.stations}
    stations = tuple(
        replace(
            record,
            left_photo=project.relative(photos[record.name].left),
            right_photo=project.relative(photos[record.name].right),
            picture=picture_name(visit.date, record.name),
        )
        for record in report.stations
    )
    return replace(report, project_name=project.name, stations=stations)


def scale_first(
    of_survey: Sequence[Rejection], others: Sequence[Rejection], scale_share: float
) -> tuple[Rejection, ...]:
    """Return what is wrong, the survey first; where known lengths contradict the scale, that before a shifted survey.

    A wrong scale moves all faces, too: while it isn't clear, nobody is told how to accept a shift.
    """
    if not (scale_share and any(one.code in SHIFTS for one in of_survey)):
        return (*of_survey, *others)
    scale = [one for one in others if one.code in OF_SCALE]
    after = {"scale_share": scale_share}
    shifted = [replace(one, values={**one.values, **after}) if one.code in SHIFTS else one for one in of_survey]
    return (*scale, *shifted, *(one for one in others if one.code not in OF_SCALE))
