"""How a sentence is filled: a template of named values, units written as the report writes them."""

import math
import string
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from asbuilt_bim.codes import Reason, Value
from asbuilt_bim.report.wording.values import area

Values = Mapping[str, Value]


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """What a rejection says: what was left out and why, the value against its limit, and what to do about it."""

    what: str = ""  # "station A3, marker 17"
    part: str = ""  # the same without its station: "marker 17", "" for the station itself
    reason: str
    value: str = ""  # with its unit, "" where there is none
    limit: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        """Read as one line: `station A3: reason (value, limit limit); remedy`."""
        return self._line(self.what)

    @property
    def at_station(self) -> str:
        """Return the line where the station is named already: `marker 17: reason; remedy`."""
        return self._line(self.part)

    def _line(self, what: str) -> str:
        numbers = ", ".join(t for t in (self.value, f"limit {self.limit}" if self.limit else "") if t)
        text = (f"{what}: " if what else "") + self.reason + (f" ({numbers})" if numbers else "")
        return f"{text}; {self.remedy}" if self.remedy else text


Sentence = Words | Callable[[Values], Words]
"""Words whose fields are filled with values by name, or a function where the words branch; that fills them itself."""
Table = Mapping[Reason, Sentence]


class _Filler(string.Formatter):
    """Format strings with units beside the usual ones: `%` of shares, `mm` of metres, `deg`, `m2`, `px`, `all`."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Write one value."""
        if format_spec.endswith("%"):
            return f"{format(value, format_spec)[:-1]} %"
        if format_spec.endswith("mm"):
            return f"{1000.0 * value:{format_spec[:-2] or '.0f'}} mm"
        if format_spec.endswith("deg"):
            return f"{math.degrees(value):{format_spec[:-3]}}°"
        if format_spec == "m2":
            return area(value)
        if format_spec == "px":
            return f"{value[0]} x {value[1]} px"
        if format_spec == "all":
            return ", ".join(map(str, value))
        return str(format(value, format_spec))


_FILLER = _Filler()


def fill(text: str, values: Values) -> str:
    """Fill `{name}` and `{name:format}` in a text with values; names in the values are never taken as templates.

    Raises:
        KeyError: a value is missing.
    """
    return _FILLER.vformat(text, (), values)


def filled(sentence: Sentence, values: Values) -> Words:
    """Return a sentence's words with its values in them.

    Raises:
        KeyError: a value is missing.
    """
    if not isinstance(sentence, Words):
        return sentence(values)
    return replace(
        sentence,
        part=fill(sentence.part, values),
        reason=fill(sentence.reason, values),
        value=fill(sentence.value, values),
        limit=fill(sentence.limit, values),
        remedy=fill(sentence.remedy, values),
    )
