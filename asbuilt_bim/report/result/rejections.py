"""A rejection in a file: its code, subject and values for programs, the English beside them for people."""

from collections.abc import Mapping
from typing import Any

from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value
from asbuilt_bim.errors import Rejection
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.unstated import unstated_rejection


def rejection_to_plain(rejection: Rejection) -> dict[str, Any]:
    """Return a rejection as plain JSON values."""
    words, subject = words_of(rejection), rejection.subject
    return {
        "code": str(rejection.code),
        "subject": {"kind": str(subject.kind), "name": subject.name, "station": subject.station},
        "values": {key: _plain(value) for key, value in rejection.values.items()},
        "what": words.what,
        "reason": words.reason,
        "value": words.value,
        "limit": words.limit,
        "remedy": words.remedy,
    }


def rejection_from_plain(plain: Mapping[str, Any]) -> Rejection:
    """Build a rejection; one without a code, or one that this version can't put into words, keeps its texts."""
    code, about = plain.get("code", str(Reason.UNSTATED)), plain.get("subject", {})
    if code not in set(Reason) or about.get("kind") not in set(SubjectKind) or code == Reason.UNSTATED:
        return unstated_rejection(plain)
    subject = Subject(
        kind=SubjectKind(about["kind"]), name=str(about.get("name", "")), station=str(about.get("station", ""))
    )
    values = {str(key): _value(value) for key, value in plain.get("values", {}).items()}
    rejection = Rejection(code=Reason(code), subject=subject, values=values)
    return rejection if _can_be_said(rejection) else unstated_rejection(plain)


def _can_be_said(rejection: Rejection) -> bool:
    """Say whether the values are those that the code's sentence needs: another program may have changed the file."""
    try:
        words_of(rejection)
    except (KeyError, ValueError, TypeError, AssertionError):
        return False
    return True


def _plain(value: Value) -> object:
    return list(value) if isinstance(value, tuple) else value


def _value(plain: Any) -> Value:
    value: Value = tuple(plain) if isinstance(plain, list) else plain
    return value
