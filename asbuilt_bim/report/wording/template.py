"""Templates of sentences: `{area_m2:m²}` writes a value with its unit, `{count:# task|# tasks}` counts."""

import math
import string
from collections.abc import Callable, Mapping
from typing import Any

from asbuilt_bim.codes import Note
from asbuilt_bim.report.wording.values import percent, percent_down, percent_seen, percent_up

Template = str | Callable[[Note], str]
"""A sentence with places for values, or a function that makes it where it has branches."""

_AS: Mapping[str, Callable[[Any], str]] = {
    "m²": lambda area_m2: f"{area_m2:.2f} m²",
    "tenth m²": lambda area_m2: f"{area_m2:.1f} m²",
    "mm": lambda length_m: f"{length_m * 1000:.0f} mm",
    "°": lambda angle_rad: f"{math.degrees(angle_rad):.2f}°",
    "px": lambda length_px: f"{length_px:.2f} px",
    "%": percent,
    "% seen": percent_seen,
    "tenth %": lambda share: f"{share * 100:.1f} %",
    "hundredth %": lambda share: f"{share * 100:.2f} %",
    "% at least": lambda share: f"{percent_down(share)} %",
    "% at most": lambda share: f"{percent_up(share)} %",
    "list": lambda names: ", ".join(map(str, names)),
    "quoted": lambda names: ", ".join(f"'{name}'" for name in names),
    "name": lambda name: name or "(no name)",
}
"""How a place in a template writes its value."""


class _Writer(string.Formatter):
    """Writes values as a template's places ask; names from files are never read as templates."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        one, bar, more = format_spec.partition("|")
        if bar:
            return (one if value == 1 else more).replace("#", str(value))
        return _AS[format_spec](value) if format_spec in _AS else super().format_field(value, format_spec)


_WRITER = _Writer()


def filled(template: str, note: Note) -> str:
    """Return a template filled with a note's values; `{subject.name}` is what it is about.

    `{more}` is how many of a list weren't named, where that is any: ` and 3 more`.
    """
    return _WRITER.vformat(template, (), {**note.values, "subject": note.subject, "more": _more(note)})


def _more(note: Note) -> str:
    count, lists = note.values.get("count"), [v for v in note.values.values() if isinstance(v, tuple)]
    left = count - len(lists[0]) if isinstance(count, int) and lists else 0
    return f" and {left} more" if left > 0 else ""
