"""Says what certificates rest on, and where that is other than now: photos, files, shares of their run."""

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from hashlib import sha256
from pathlib import Path

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.flow.output.folder import RESULT, run_stamp
from asbuilt_bim.progress.report import ProgressReport, Provenance
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, ValuationInputs
from asbuilt_bim.report.workbook.read import LastWorkbook
from asbuilt_bim.storage.regular_file import file_digest

MOST_NAMED = 5
FILES = ("ifc", "rig", "survey", "options")
"""What a run is made from beside its photos."""


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


def with_what_they_rest_on(
    inputs: ValuationInputs, before: ProgressReport | None, digests: Mapping[str, str]
) -> ValuationInputs:
    """Return what a valuation begins with, with the photos, the run and the files that certificates were signed on.

    A workbook that somebody signed is of the run `before`: its photos and files are the newest certificate's from then
    on, and so are the `digests` of itself and of the run's result. Of older ones that nobody read then, nobody knows.
    """
    known = (before.valuation if before is not None else None) or NO_INPUTS
    made_from = before.provenance if before is not None else None
    files = _digests_of(made_from) if made_from is not None else {}
    own = (known.photos, made_from.created if made_from is not None else "", {**files, **digests})
    had = {one.number: own for one in inputs.certificates[-1:]}
    had |= {one.number: (one.photos, one.run, one.digests) for one in known.certificates}
    signed = ((one, *had.get(one.number, ({}, "", {}))) for one in inputs.certificates)
    certificates = tuple(replace(one, photos=photos, run=run, digests=of) for one, photos, run, of in signed)
    return replace(inputs, certificates=certificates, photos=known.photos)


def _digests_of(made_from: Provenance) -> dict[str, str]:
    return {
        "ifc": made_from.ifc_digest,
        "rig": made_from.rig_digest,
        "survey": made_from.survey_digest,
        "options": made_from.options_digest,
    }


def certified_runs(report: ProgressReport) -> Callable[[Path], bool]:
    """Return what says of a run's folder whether a certificate rests on it: by its result, or by when it was made."""
    digests, stamps = set[str](), set[str]()
    for one in (report.valuation or NO_INPUTS).certificates:
        digests |= {digest} if (digest := one.digests.get("result", "")) else set()
        with contextlib.suppress(ValueError):
            stamps.add(run_stamp(datetime.fromisoformat(one.run)))

    def certified(run: Path) -> bool:
        result = run / RESULT
        return run.name.split("-")[0] in stamps or (result.is_file() and file_digest(result) in digests)

    return certified


def photos_of(reports: Sequence[ProgressReport]) -> dict[str, str]:
    """Return by visit and station a digest of the two photos that a run measured; those left out aren't there."""
    return {
        f"{report.visit_date.isoformat()} {station.name}": sha256(
            f"{station.left_digest}{station.right_digest}".encode()
        ).hexdigest()
        for report in reports
        for station in report.stations
    }


def file_changes(inputs: ValuationInputs, digests: Mapping[str, str]) -> list[Note]:
    """Return the note on files that the last certificate rests on, and that are others now; `digests`: by `FILES`."""
    last = inputs.certificates[-1] if inputs.certificates else None
    if last is None:
        return []
    known = last.digests.keys() & digests.keys()
    others = tuple(name for name in FILES if name in known and last.digests[name] != digests[name])
    subject = about(SubjectKind.VISIT, last.visit.isoformat())
    return [noted(Reason.CERTIFIED_FILES_CHANGED, subject, number=last.number, files=others)] if others else []


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
