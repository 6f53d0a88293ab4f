"""The day that a camera wrote into its photos against the day of the visit: last visit's photos prove nothing today."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, timedelta

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.project.read import Visit

NEAR = timedelta(days=1)
"""Camera clocks run on another zone's time, and a visit may last past midnight."""


def other_days(visit: Visit, taken: Mapping[str, date]) -> tuple[Rejection, ...]:
    """Return one warning where photos say that they were `taken` (by station) on another day than the visit's.

    They count all the same: a camera's clock may be wrong, and only the user knows.
    """
    off = {name: day for name, day in taken.items() if abs(day - visit.date) > NEAR}
    if not off:
        return ()
    return (
        rejected(
            Reason.PHOTOS_OF_OTHER_DAY,
            about(SubjectKind.VISIT, visit.date.isoformat()),
            stations=tuple(off),
            days=tuple(day.isoformat() for day in off.values()),
            count=len(visit.stations),
        ),
    )
