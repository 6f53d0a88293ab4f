"""Where the elements of an XML document stand, byte by byte, so that some can be exchanged and the rest stays as it is.

No XML library writes a document back as it was: ElementTree loses prefixes that Excel needs (mc:Ignorable), lxml
changes quotes, line ends and the declaration. So nothing is written from a tree: expat says where elements are, and
their bytes are exchanged. Expat grows no entity here, because a document type is refused, as in every XML that is read.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

MAX_DEPTH = 100
MAX_ELEMENTS = 4_000_000
"""Some 20,000 rows of 60 cells with values and formulas; a gigabyte of memory."""
_TAG = re.compile(rb"<(?:[^>\"']|\"[^\"]*\"|'[^']*')*>")
_NOT_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


@dataclass(slots=True, kw_only=True)
class Place:
    """An element: its bytes are `start` to `end`; its start tag ends at `inside`, its end tag begins at `close`."""

    name: str  # without its prefix
    prefix: str  # with its colon, "" where there is none
    path: str  # local names from the root to it, as in "worksheet/sheetData/row/c"
    attributes: dict[str, str]
    start: int
    inside: int
    close: int = 0
    end: int = 0
    text: str = ""  # its own, without its children's
    parent: "Place | None" = field(default=None, repr=False)

    @property
    def empty(self) -> bool:
        """Say whether it is written as one tag: <v/>."""
        return self.inside == self.end


@dataclass(frozen=True, slots=True)
class Edit:
    """Bytes `start` to `end` are to be `new`; they are inserted where both are the same."""

    start: int
    end: int
    new: bytes


class _RefusedError(ValueError):
    """What a document holds that isn't read."""


def places(data: bytes) -> list[Place]:
    """Return the elements of a document in the order in which they begin.

    Raises:
        ValueError: it is damaged, has a document type, isn't UTF-8, or is nested too deep.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in data[:200]:
        raise ValueError("isn't UTF-8")
    reader = _Reader(data)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as problem:
        raise ValueError(f"damaged XML ({problem})") from problem
    return reader.found


def edited(data: bytes, edits: Iterable[Edit]) -> bytes:
    """Return a document with some of its bytes exchanged."""
    pieces, last = [], 0
    for edit in sorted(edits, key=lambda one: (one.start, one.end)):
        if edit.start < last:
            raise AssertionError("two edits of the same bytes")
        pieces += [data[last : edit.start], edit.new]
        last = edit.end
    return b"".join([*pieces, data[last:]])


def readable(text: str) -> str:
    """Return text without the characters that XML can't hold."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)


def xml_text(text: str) -> str:
    """Return text as it stands between two tags."""
    return escape(readable(text))


def attributes_text(attributes: Mapping[str, str]) -> str:
    """Return attributes as they stand in a tag, with a space before each."""
    return "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())


class _Reader:
    """Gathers the elements while expat runs through the document."""

    def __init__(self, data: bytes) -> None:
        self.found: list[Place] = []
        self._data = data
        self._open: list[Place] = []
        self._paths: dict[tuple[str, str], str] = {}  # the same text once, not for each of a million cells
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.XmlDeclHandler = self._declared

    def _begin(self, name: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= MAX_DEPTH:
            raise _RefusedError(f"is nested deeper than {MAX_DEPTH} levels")
        if len(self.found) >= MAX_ELEMENTS:
            raise _RefusedError(f"has more than {MAX_ELEMENTS:,} elements, which is too large to be filled")
        start = self.parser.CurrentByteIndex
        tag = _TAG.match(self._data, start)
        if tag is None:
            raise _RefusedError("damaged XML (a tag without an end)")
        prefix, colon, local = name.rpartition(":")
        above = self._open[-1] if self._open else None
        step = (above.path if above else "", local)
        path = self._paths.setdefault(step, "/".join(filter(None, step)))
        place = Place(
            name=local,
            prefix=prefix + colon,
            path=path,
            attributes=attributes,
            start=start,
            inside=tag.end(),
            parent=above,
        )
        self.found.append(place)
        self._open.append(place)

    def _end(self, name: str) -> None:
        place = self._open.pop()
        if self._data[place.inside - 2 : place.inside] == b"/>":
            place.close = place.end = place.inside
            return
        place.close = self.parser.CurrentByteIndex
        place.end = self._data.index(b">", place.close) + 1

    def _text(self, text: str) -> None:
        if self._open:
            self._open[-1].text += text

    def _doctype(self, *_: object) -> None:
        raise _RefusedError("holds a document type (<!DOCTYPE), which no workbook needs")

    def _declared(self, version: str, encoding: str | None, standalone: int) -> None:
        if (encoding or "utf-8").lower() not in ("utf-8", "utf8", "us-ascii", "ascii"):
            raise _RefusedError(f"isn't UTF-8 ({encoding})")
