"""Says where what was certified rests on other photos than now, or on other shares than its run's."""

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from hashlib import sha256

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, ValuationInputs
from asbuilt_bim.report.workbook.read import LastWorkbook

MOST_NAMED = 5


def signed_otherwise(last: LastWorkbook | None, before: ProgressReport | None) -> list[Note]:
    """Return the note on shares that a workbook calls certain, as it was just signed, and the run `before` doesn't.

    It is of another run, or numbers in it were typed over. The note stays until the next valuation is signed.
    """
    if before is None or before.valuation is None:
        return []
    known = before.valuation.certificates
    if last is None or len(last.inputs.certificates) <= len(known):
        return [note for note in before.notes if note.code is Reason.CERTIFIED_OTHERWISE]
    rows = {
        (line.line.global_id, row.global_id): row for bill in bills(before) for line in bill.lines for row in line.rows
    }
    other = [
        (key, share, rows[key].measured)
        for key, share in last.certain.items()
        if key in rows and not math.isclose(share, rows[key].measured, rel_tol=1e-9, abs_tol=1e-9)
    ]
    if not other:
        return []
    names = {one.global_id: one.name or one.global_id for one in before.elements}
    subject = about(SubjectKind.VISIT, before.visit_date.isoformat())
    first = other[:MOST_NAMED]
    return [
        noted(
            Reason.CERTIFIED_OTHERWISE,
            subject,
            number=last.inputs.certificates[-1].number,
            elements=tuple(names.get(key, key) for (_, key), _, _ in first),
            signed=tuple(share for _, share, _ in first),
            of_run=tuple(share for _, _, share in first),
            others=len(other) - len(first),
        )
    ]


def with_photos(inputs: ValuationInputs, before: ProgressReport | None) -> ValuationInputs:
    """Return what a valuation begins with, with the photos and the run that certificates were signed on.

    A workbook that somebody signed is of the run `before`: its photos are the certificate's from then on.
    """
    known = (before.valuation if before is not None else None) or NO_INPUTS
    run = before.provenance.created if before is not None and before.provenance is not None else ""
    had = {one.number: (one.photos, one.run) for one in known.certificates}
    signed = ((one, *had.get(one.number, (known.photos, run))) for one in inputs.certificates)
    certificates = tuple(replace(one, photos=photos, run=made) for one, photos, made in signed)
    return replace(inputs, certificates=certificates, photos=known.photos)


def certified_runs(report: ProgressReport) -> set[datetime]:
    """Return when the runs were made that certificates rest on, where that is known."""
    found = set()
    for one in (report.valuation or NO_INPUTS).certificates:
        with contextlib.suppress(ValueError):
            found.add(datetime.fromisoformat(one.run))
    return found


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
