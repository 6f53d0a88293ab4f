"""Rejections in English: `words_of` says what was left out and why. To translate, replace the tables beside it."""

from collections.abc import Sequence
from dataclasses import replace

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import RejectedError, Rejection
from asbuilt_bim.report.wording.of_calibration import CALIBRATION
from asbuilt_bim.report.wording.of_design import DESIGN
from asbuilt_bim.report.wording.of_faces import FACES, together
from asbuilt_bim.report.wording.of_photos import PHOTOS
from asbuilt_bim.report.wording.of_places import PLACES
from asbuilt_bim.report.wording.of_rig import RIG
from asbuilt_bim.report.wording.of_target import TARGET
from asbuilt_bim.report.wording.unstated import UNSTATED
from asbuilt_bim.report.wording.words import Table, Words, filled

REJECTIONS: Table = {**UNSTATED, **PHOTOS, **TARGET, **RIG, **FACES, **PLACES, **DESIGN, **CALIBRATION}
"""What each code of a rejection says."""
UNMEASURED = frozenset({Reason.FACE_UNCERTAIN, Reason.FACE_WITHOUT_END, Reason.FACE_NARROW})
"""Of faces that were seen and could not be measured: dozens at a station that looks far."""


def words_of(rejection: Rejection) -> Words:
    """Return what a rejection says; `name` in its sentence is the subject's."""
    subject = rejection.subject
    words = filled(REJECTIONS[rejection.code], {**rejection.values, "name": subject.name})
    if words.what:
        return words
    part = words.part or part_words(subject)
    station = "" if subject.kind is SubjectKind.FACE else subject.at_station  # a face's name holds its station's
    what = ", ".join(text for text in (f"station {station}" if station else "", part) if text)
    return replace(words, what=what, part=part)


def words_of_faces(station: str, rejections: Sequence[Rejection]) -> tuple[Words, ...]:
    """Return what was left out of one station's faces: faces that were seen and not measured are told together."""
    alike: dict[Reason, list[Rejection]] = {}
    for one in rejections:
        alike.setdefault(one.code, []).append(one)
    told: list[Words] = []
    for code, faces in alike.items():
        if code in UNMEASURED and len(faces) > 1:
            told.append(together(station, code, [(one.subject.name, one.values) for one in faces]))
        else:
            told += map(words_of, faces)
    return tuple(told)


def part_words(subject: Subject) -> str:
    """Return a subject as people name it, without its station: `marker 17`; "" for the station itself."""
    if subject.kind is SubjectKind.STATION:
        return ""
    if subject.kind is SubjectKind.DISC:
        return f"red disc at {subject.name}"
    if subject.kind in (SubjectKind.INSTANCE, SubjectKind.FILE, SubjectKind.UNSTATED):
        return subject.name
    return f"{subject.kind} {subject.name}".strip()


def reason_lines(problem: RejectedError) -> str:
    """Return why nothing could be used, a line a reason; the error's own text where it has none."""
    return "\n".join(str(words_of(rejection)) for rejection in problem.rejections) or str(problem)


def reason_list(problem: RejectedError) -> str:
    """Return what was left out before, to stand below an error's own text."""
    return "".join(f"\n  {words_of(rejection)}" for rejection in problem.rejections)
