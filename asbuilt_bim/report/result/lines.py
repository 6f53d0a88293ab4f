"""`result.json` as lines, so that it can be read in parts: still one JSON document, of the same keys and values.

Each key begins a line. So does each entry of a list of objects. A line break inside of a text is escaped in JSON, so no
other line breaks are there. What only some readers want stands last.
"""

import json
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any

from asbuilt_bim.report.result.unseen_json import FORMER_KEY, KEY
from asbuilt_bim.storage.strict_json import parse_json

LAST = ("elements", "stations", "faces", FORMER_KEY, KEY)
"""Keys whose lists grow with the site and its visits, the longest last."""
Wanted = Callable[[str], bool]
"""Says of the text of an entry whether it is to be parsed."""


def all_of(_: str) -> bool:
    """Say that an entry is wanted, whatever it is."""
    return True


def to_lines(document: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of a document, each with its end."""
    keys = sorted(document, key=lambda key: LAST.index(key) if key in LAST else -1)
    for number, key in enumerate(keys):
        start, value = "{" if number == 0 else ",", document[key]
        if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
            yield f"{start}\n{_text(key)}:[\n"
            yield ",\n".join(map(_text, value))
            yield "\n]"
        else:
            yield f"{start}\n{_text(key)}:{_text(value)}"
    yield "\n}\n"


def from_lines(lines: Iterable[str], wanted: dict[str, Wanted], until: Collection[str] = ()) -> dict[str, Any] | None:
    """Parse the keys that are wanted; None where a document isn't written in lines.

    Of lists of objects those entries are parsed whose text is wanted. At a key of `until` reading ends.

    Raises:
        ValueError: it is damaged; the text says where.
    """
    found: dict[str, Any] = {}
    entries: list[Any] | None = None  # of the list that is open
    asked: Wanted | None = None
    for number, line in enumerate(lines):
        text = line.rstrip("\n").removesuffix(",")
        if number == 0 and text != "{":
            return None
        if text == "]":
            entries = None
        elif entries is not None and text.startswith("{"):
            if asked is not None and asked(text):
                entries.append(_parsed(text, number))
        elif text.startswith('"'):
            key, _, value = text.partition(":")
            name = _parsed(key, number)
            if name in until:
                return found
            asked = wanted.get(name)
            entries = [] if value == "[" else None
            if asked is not None:
                found[name] = _parsed(value, number) if entries is None else entries
        elif text not in ("{", "}"):
            raise ValueError(f"line {number + 1} is neither a key nor an entry")
    return found


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def _parsed(text: str, number: int) -> Any:
    try:
        return parse_json(text)
    except ValueError as problem:
        raise ValueError(f"line {number + 1}: {problem}") from problem
