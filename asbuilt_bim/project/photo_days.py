"""The day that a camera wrote into its photos against the day of the visit: last visit's photos prove nothing today."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, timedelta

from asbuilt_bim.errors import Rejection
from asbuilt_bim.project.read import Visit

NEAR = timedelta(days=1)
"""Camera clocks run on another zone's time, and a visit may last past midnight."""
_MOST_NAMED = 5


def other_days(visit: Visit, taken: Mapping[str, date]) -> tuple[Rejection, ...]:
    """Return one warning where photos say that they were `taken` (by station) on another day than the visit's.

    They count all the same: a camera's clock may be wrong, and only the user knows.
    """
    off = {name: day for name, day in taken.items() if abs(day - visit.date) > NEAR}
    if not off:
        return ()
    named = ", ".join(f"station {name} {day.isoformat()}" for name, day in list(off.items())[:_MOST_NAMED])
    more = f" and {len(off) - _MOST_NAMED} more" if len(off) > _MOST_NAMED else ""
    return (
        Rejection(
            what="photos' days",
            reason=f"the photos of {len(off)} of {len(visit.stations)} stations say that they were taken on another "
            f"day than the visit's, {visit.date.isoformat()}: {named}{more}",
            remedy="if they are another visit's, copy this one's; if the camera's clock is wrong, set it: nothing is "
            "left out for it",
        ),
    )
