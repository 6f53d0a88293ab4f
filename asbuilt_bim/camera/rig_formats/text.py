"""The text of a rig file of any format as plain values: nothing that runs, refers or expands is read."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import yaml

from asbuilt_bim.camera.rig_formats.plain_text import Plain, plain_text
from asbuilt_bim.errors import RigError
from asbuilt_bim.storage.regular_file import as_text, open_regular, read_bytes
from asbuilt_bim.storage.strict_yaml import StrictLoader, yaml_words

MAX_BYTES = 200_000
"""A rig is a page of numbers, 10 kB; a megabyte of YAML takes half a minute to read."""
MAX_NUMBERS = 10_000
_DEEPEST = 12
_MATRIX_TAG = "tag:yaml.org,2002:opencv-matrix"
_DIRECTIVE = re.compile(r"\A\s*%YAML[: ][^\n]*\n")

_BINARY = {
    b"MATLAB 5.0 MAT-file": "a MATLAB .mat file, which is binary. In MATLAB write "
    'writelines(jsonencode(toStruct(stereoParams)), "rig.json"), and name rig.json',
    b"\x93NUMPY": "a numpy array (.npy), one of several. Write K1, D1, K2, D2, R, T with cv2.FileStorage",
    b"\x89HDF": "an HDF5 file (MATLAB writes .mat so), which is binary. Write the calibration as JSON or YAML",
}
_DOCUMENT_END = re.compile(r"\n---\s*\Z|\n\.\.\.\s*\Z")  # `rostopic echo` ends so


class _Loader(StrictLoader):
    """StrictLoader that knows OpenCV's tag for a matrix: a plain mapping with rows, cols, dt and data."""

    typed_by_hand = False  # programs write serial numbers with zeros before them, and times


def _matrix(loader: StrictLoader, node: yaml.Node) -> object:
    if not isinstance(node, yaml.MappingNode):
        raise yaml.constructor.ConstructorError(None, None, "an opencv-matrix is no mapping", node.start_mark)
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor(_MATRIX_TAG, _matrix)


def read_document(path: Path) -> Plain:
    """Read a YAML, JSON or XML file, or one of `plain_text`'s, of at most `MAX_BYTES` as plain values.

    XML becomes mappings of its elements' names; the attribute type_id is dropped, and texts stay texts. Metashape's
    becomes its elements (`XmlNode`) under "metashape", since they repeat and have attributes.

    Raises: RigError where it can't be read, or holds what no rig file needs: aliases, foreign tags, entities.
    """
    name = f"rig file {path}"
    _refuse_binary(path, name)
    data = read_bytes(path, MAX_BYTES, RigError, name)
    text = as_text(data, RigError, name)
    if text.startswith("ISO-10303-21"):
        raise RigError(f"rig file {path}: this is an IFC file; name the rig that was calibrated")
    if text.lstrip().startswith("<"):
        return _xml(text, path)
    found = plain_text(text, name)
    return found if found is not None else _yaml(text, path)


def _refuse_binary(path: Path, name: str) -> None:
    """Say what a binary file is and what to write in its place, however large it is."""
    try:
        with open_regular(path) as file:
            start = file.read(32)
    except OSError:  # `read_bytes` says why
        return
    for magic, what in _BINARY.items():
        if start.startswith(magic):
            raise RigError(f"{name}: this is {what}")


def _yaml(text: str, path: Path) -> Plain:
    text = _DOCUMENT_END.sub("\n", _DIRECTIVE.sub("\n", text))  # OpenCV writes %YAML:1.0, which no YAML reader knows
    try:
        _look_through(text, path)
        loader = _Loader(text)
        return loader.get_single_data()  # type: ignore[no-any-return, unused-ignore]
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        words = yaml_words(error, text)
        raise RigError(f"rig file {path}: it is not plain YAML{words}; correct it, or calibrate again") from error


def _look_through(text: str, path: Path) -> None:
    """Refuse aliases and deep nesting before anything is built: they cost time and memory out of all proportion."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent):
            raise RigError(f"rig file {path}: YAML aliases (*name) are not read; write the values out")
        if depth > _DEEPEST:
            raise RigError(f"rig file {path}: nested deeper than {_DEEPEST} levels; this is no rig file")


def _xml(text: str, path: Path) -> Plain:
    if "<!" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
        raise RigError(f"rig file {path}: XML with a DOCTYPE or entities is not read; write plain elements")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, RecursionError, ValueError) as error:
        raise RigError(f"rig file {path}: it is not well-formed XML ({error})") from error
    if root.tag in ("document", "calibration"):
        return {"metashape": _node(root, path, 1)}
    return _elements(root, path, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class XmlNode:
    """An element of Metashape's XML: its name, its attributes, its text and the elements in it."""

    name: str
    attributes: Mapping[str, str]
    text: str
    children: tuple["XmlNode", ...]

    def first(self, *names: str) -> "XmlNode | None":
        """Return the first element of these names, one in the other; None where there is none."""
        node: XmlNode | None = self
        for name in names:
            node = next((child for child in node.children if child.name == name), None) if node is not None else None
        return node

    def all(self, *names: str) -> "tuple[XmlNode, ...]":
        """Return all elements of the last name in the first of the names before."""
        node = self.first(*names[:-1])
        return tuple(child for child in node.children if child.name == names[-1]) if node is not None else ()


def _node(element: ElementTree.Element, path: Path, depth: int) -> XmlNode:
    if depth > _DEEPEST:
        raise RigError(f"rig file {path}: nested deeper than {_DEEPEST} levels; this is no rig file")
    children = tuple(_node(child, path, depth + 1) for child in element)
    text = (element.text or "").strip()
    return XmlNode(name=element.tag, attributes=dict(element.attrib), text=text, children=children)


def _elements(node: ElementTree.Element, path: Path, depth: int) -> dict[str, Plain]:
    """Return an element's children by name; one that stands twice would hide the other (OpenCV's lists repeat <_>)."""
    found: dict[str, Plain] = {}
    for child in node:
        if child.tag in found and child.tag != "_":
            raise RigError(
                f"rig file {path}: the XML element <{child.tag[:60]}> stands twice; keep the one that counts"
            )
        plain = not len(child) or depth > _DEEPEST
        found[child.tag] = (child.text or "").strip() if plain else _elements(child, path, depth + 1)
    return found


def numbers(value: Plain) -> list[float] | None:
    """Return the finite numbers of a value in order: a list (nested or not), a matrix's data, words; None otherwise."""
    if isinstance(value, dict):
        value = value.get("data")
    if isinstance(value, str):
        value = value.split()
    if isinstance(value, int | float):
        value = [value]
    if not isinstance(value, list) or len(value) > MAX_NUMBERS:
        return None
    found: list[float] = []
    for item in value:
        inner = numbers(item) if isinstance(item, list) else _number(item)
        if inner is None or len(found) > MAX_NUMBERS:
            return None
        found += inner
    return found


def _number(item: object) -> list[float] | None:
    """Read 1e-05 too, which YAML calls a text."""
    if isinstance(item, bool) or not isinstance(item, int | float | str):
        return None
    try:
        number = float(item)
    except (ValueError, OverflowError):
        return None
    return [number] if abs(number) < 1e12 else None
