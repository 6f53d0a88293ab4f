"""`ProgressReport` to plain values and back, by cattrs: no field is named twice."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from datetime import date, datetime
from functools import cache
from typing import Any, Literal, TypeVar, get_args, get_origin

from cattrs import Converter, transform_error
from cattrs.errors import BaseValidationError
from cattrs.gen import make_dict_structure_fn, make_dict_unstructure_fn, override
from cattrs.v import format_exception

from asbuilt_bim.codes import Note
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import SHARE_DECIMALS, FaceRecord, ProgressReport, TaskProgress
from asbuilt_bim.report.result.arrays_json import ARRAY_FORMS, reader_of, writer_of
from asbuilt_bim.report.result.notes_json import note_fields, note_from_plain, with_codes, with_words
from asbuilt_bim.report.result.rejections import rejection_from_plain, rejection_to_plain
from asbuilt_bim.report.result.unseen_json import Nothing, nothing_known, with_unseen_among, with_unseen_apart
from asbuilt_bim.report.wording.of_faces import source_of

T = TypeVar("T")
FORMER_NAMES = {
    "behind_days": "days_late", "behind_least_days": "days_late_least", "behind_most_days": "days_late_most",
}  # fmt: skip
"""Keys of tasks that had another name before version 1.6, and stand under both: "late" meant two things then."""
SHARES = frozenset({"best", "lower", "upper", "coverage", "surface_coverage", "planned"})
"""Keys that hold a share in 0..1."""


def report_to_plain(report: ProgressReport) -> dict[str, Any]:
    """Return the report as dictionaries, lists, strings and numbers, arrays rounded as `ARRAY_FORMS` says."""
    plain: dict[str, Any] = _converter().unstructure(report)
    return plain


def report_to_document(report: ProgressReport) -> dict[str, Any]:
    """Return the report as `result.json` holds it: as `report_to_plain`, what nobody has seen short."""
    return with_unseen_apart(report_to_plain(report), _nothing_known())


def report_from_document(values: dict[str, Any]) -> ProgressReport:
    """Build a report from what `result.json` holds; otherwise as `report_from_plain`.

    Raises:
        ValueError: as `report_from_plain`.
    """
    return report_from_plain(with_unseen_among(values, _nothing_known()))


@cache
def _nothing_known() -> Nothing:
    return nothing_known(_converter().unstructure)


def report_from_plain(values: dict[str, Any]) -> ProgressReport:
    """Build a report from plain values; keys that it doesn't know are passed over.

    Raises:
        ValueError: values are missing or of the wrong kind; the message names each place.
    """
    return part_from_plain(values, ProgressReport)


def part_from_plain(values: dict[str, Any], kind: type[T]) -> T:
    """Build a part of a report, of another dataclass with some of its fields; otherwise as `report_from_plain`.

    Raises:
        ValueError: as `report_from_plain`.
    """
    try:
        return _converter().structure(values, kind)
    except BaseValidationError as error:
        raise ValueError("; ".join(transform_error(error, "result", _in_words)[:5])) from error


@cache
def _converter() -> Converter:
    """Make the converter once: dates as ISO text, arrays as nested lists."""
    converter = Converter()
    converter.register_unstructure_hook(date, lambda day: day.isoformat())
    converter.register_unstructure_hook(datetime, lambda moment: moment.isoformat())
    converter.register_structure_hook(date, lambda text, _: date.fromisoformat(text))
    converter.register_structure_hook(datetime, lambda text, _: datetime.fromisoformat(text))
    converter.register_structure_hook(Note, lambda plain, _: note_from_plain(plain))
    converter.register_unstructure_hook_factory(is_dataclass, lambda cls: _unstructure(cls, converter))
    converter.register_structure_hook_factory(is_dataclass, lambda cls: _structure(cls, converter))
    converter.register_unstructure_hook(Rejection, rejection_to_plain)
    converter.register_structure_hook(Rejection, lambda plain, _: rejection_from_plain(plain))
    converter.register_structure_hook(FaceRecord, _face_reader(converter))
    converter.register_unstructure_hook(TaskProgress, _task_writer(converter))
    converter.register_structure_hook(TaskProgress, _task_reader(converter))
    return converter


def _face_reader(converter: Converter) -> Callable[[dict[str, Any], Any], FaceRecord]:
    """Return the reader of measured faces: results before version 1.4 call who found them in words."""
    read = _structure(FaceRecord, converter)

    def face(plain: dict[str, Any], kind: Any) -> FaceRecord:
        if "segmenter" not in plain:
            source, segmenter = source_of(str(plain.get("source", "geometric")))
            plain = plain | {"source": str(source), "segmenter": segmenter}
        found: FaceRecord = read(plain, kind)
        return found

    return face


def _task_writer(converter: Converter) -> Callable[[TaskProgress], dict[str, Any]]:
    plain_of = _unstructure(TaskProgress, converter)

    def task(value: TaskProgress) -> dict[str, Any]:
        plain = plain_of(value)
        return plain | {former: plain[name] for name, former in FORMER_NAMES.items()}

    return task


def _task_reader(converter: Converter) -> Callable[[dict[str, Any], Any], TaskProgress]:
    read = _structure(TaskProgress, converter)

    def task(plain: dict[str, Any], kind: Any) -> TaskProgress:
        known = {name: plain[former] for name, former in FORMER_NAMES.items() if former in plain}
        found: TaskProgress = read({**known, **plain}, kind)
        return found

    return task


def _unstructure(cls: type[Any], converter: Converter) -> Callable[[Any], dict[str, Any]]:
    """Return the writer of one dataclass, with the array fields' own writers."""
    overrides: dict[str, Any] = {
        name: override(unstruct_hook=writer_of(ARRAY_FORMS[name])) for name in _array_fields(cls)
    }
    shares = [field.name for field in fields(cls) if field.name in SHARES]
    overrides |= {name: override(unstruct_hook=_rounded_share) for name in shares}
    plain_of: Callable[[Any], dict[str, Any]] = make_dict_unstructure_fn(cls, converter, **overrides)
    noted = note_fields(cls)
    return (lambda value: with_words(plain_of(value), value, noted)) if noted else plain_of


def _structure(cls: type[Any], converter: Converter) -> Callable[[Any, Any], Any]:
    """Return the reader of one dataclass, with the array fields' own readers."""
    overrides: dict[str, Any] = {
        name: override(struct_hook=reader_of(ARRAY_FORMS[name])) for name in _array_fields(cls)
    }
    build: Callable[[Any, Any], Any] = make_dict_structure_fn(cls, converter, **overrides)
    noted = note_fields(cls)
    return (lambda plain, kind: build(with_codes(plain, noted), kind)) if noted else build


def _in_words(error: BaseException, kind: type[Any] | None) -> str:
    """Say what a value should have been; our own array checks say it themselves."""
    if get_origin(kind) is Literal:
        return f"{str(error).partition(' not in literal')[0]} is none of {', '.join(map(str, get_args(kind)))}"
    return str(error) if type(error) is ValueError else str(format_exception(error, kind))


def _rounded_share(value: float | None) -> float | None:
    """Round a share in 0..1."""
    return None if value is None else round(float(value), SHARE_DECIMALS)


def _array_fields(cls: type[Any]) -> list[str]:
    """Return the fields of a dataclass that hold arrays; their annotations read differently from numpy to numpy."""
    return [field.name for field in fields(cls) if field.name in ARRAY_FORMS]
