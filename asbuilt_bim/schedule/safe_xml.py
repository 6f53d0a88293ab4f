"""XML from elsewhere: bounded in size and depth, without document types, so that no entity can grow or reach a file."""

import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

from asbuilt_bim.errors import ScheduleError

MAX_DEPTH = 60
"""P6 and MS Project nest their XML some ten levels deep."""


class _RefusedError(Exception):
    """What the file holds that no schedule does."""


def parse_xml(data: bytes, path: Path) -> ET.Element:
    """Return the root of an XML document; `path` is for messages only.

    Raises:
        ScheduleError: no XML, cut short, with a document type, or nested too deep.
    """
    try:
        _inspect(data)
        return ET.fromstring(data)
    except _RefusedError as problem:
        raise ScheduleError(f"{path}: {problem}; export it again from MS Project or P6") from problem
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as problem:
        raise ScheduleError(f"{path}: damaged XML ({problem}); export it again from MS Project or P6") from problem


def local(tag: str) -> str:
    """Return an element's name without its namespace: P6 changes that with every version."""
    return tag.rpartition("}")[2]


def text(element: ET.Element | None, tag: str) -> str:
    """Return the text of a child by its local name, "" where there is none."""
    found = child(element, tag)
    return (found.text or "").strip() if found is not None else ""


def child(element: ET.Element | None, tag: str) -> ET.Element | None:
    """Return the first child of a local name."""
    return next(iter(children(element, tag)), None)


def children(element: ET.Element | None, tag: str) -> list[ET.Element]:
    """Return the children of a local name."""
    return [one for one in element if local(one.tag) == tag] if element is not None else []


def _inspect(data: bytes) -> None:
    """Run through the document before anything is built from it."""
    depth = 0
    parser = expat.ParserCreate()

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise _RefusedError(f"is nested deeper than {MAX_DEPTH} levels, which no schedule is")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def doctype(*_: object) -> None:
        raise _RefusedError("holds a document type (<!DOCTYPE), which no schedule needs and which isn't read here")

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = doctype
    parser.Parse(data, True)
