"""XML as files: elements in the order given, text that can't break out of them."""

import xml.etree.ElementTree as ET
from pathlib import Path

from asbuilt_bim.storage.atomic_write import writing

XSI = {"xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance"}
Value = str | int | float | None


def add(parent: ET.Element, name: str, value: Value = "") -> ET.Element:
    """Add a child with a text; the text is escaped when it is written."""
    child = ET.SubElement(parent, name)
    child.text = str(value)
    return child


def add_all(parent: ET.Element, **values: Value) -> None:
    """Add children in this order, without those that are None: an element that isn't there says nothing."""
    for name, value in values.items():
        if value is not None:
            add(parent, name, value)


def add_nil(parent: ET.Element, name: str) -> None:
    """Add a child that says of itself that it has no value; the document's root must know the name space `xsi`."""
    ET.SubElement(parent, name, {"xsi:nil": "true"})


def write_xml(root: ET.Element, path: Path) -> None:
    """Write a document as UTF-8, indented.

    Raises:
        OutputError: it can't be written.
    """
    ET.indent(root, " ")
    with writing(path):
        path.write_bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n")
