"""Says where a visit that was certified rests on other photos now than when somebody signed."""

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, ValuationInputs

MOST_NAMED = 5


def with_photos(inputs: ValuationInputs, before: ProgressReport | None) -> ValuationInputs:
    """Return what a valuation begins with, with the photos that certificates were signed on.

    A workbook that somebody signed is of the run `before`: its photos are the certificate's from then on.
    """
    known = (before.valuation if before is not None else None) or NO_INPUTS
    had = {one.number: one.photos for one in known.certificates}
    signed = (replace(one, photos=had.get(one.number, known.photos)) for one in inputs.certificates)
    return replace(inputs, certificates=tuple(signed), photos=known.photos)


def photos_of(reports: Sequence[ProgressReport]) -> dict[str, str]:
    """Return by visit and station a digest of the two photos that a run measured; those left out aren't there."""
    return {
        f"{report.visit_date.isoformat()} {station.name}": sha256(
            f"{station.left_digest}{station.right_digest}".encode()
        ).hexdigest()
        for report in reports
        for station in report.stations
    }


def photo_changes(inputs: ValuationInputs) -> list[Note]:
    """Return the note on stations that the last certificate rests on, and that are gone, new or have other photos."""
    last = inputs.certificates[-1] if inputs.certificates else None
    if last is None or not last.photos:
        return []
    day = last.visit.isoformat()
    were, are = ({k: v for k, v in one.items() if k.split(" ")[0] <= day} for one in (last.photos, inputs.photos))
    changed = {
        "gone": sorted(were.keys() - are.keys()),
        "added": sorted(are.keys() - were.keys()),
        "replaced": sorted(key for key in were.keys() & are.keys() if were[key] != are[key]),
    }
    if not any(changed.values()):
        return []
    named = {key: tuple(names[:MOST_NAMED]) for key, names in changed.items()}
    more = sum(len(names) for names in changed.values()) - sum(len(names) for names in named.values())
    subject = about(SubjectKind.VISIT, day)
    return [noted(Reason.CERTIFIED_PHOTOS_CHANGED, subject, number=last.number, **named, others=more)]
