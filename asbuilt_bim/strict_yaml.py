"""YAML read with no surprises: no code, no doubled keys, no aliases, no bombs; and the line of every key."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.yaml_words import character_words, yaml_words

MAX_BYTES = 1_000_000
"""A project file of a thousand stations is about 150 kB; more than this is no project file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class YamlDocument:
    """What a YAML file holds, and the line (from 1) of each key path such as `visits[0].date`."""

    value: object
    lines: dict[str, int]


class _StrictLoader(yaml.SafeLoader):
    """SafeLoader that refuses aliases and doubled keys."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.events.AliasEvent):
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.constructor.ConstructorError(
                None, None, "aliases (*name) aren't read here: write the value out", event.start_mark
            )
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: dict[object, int] = {}
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise yaml.constructor.ConstructorError(None, None, "a key must be plain text", key_node.start_mark)
            line = key_node.start_mark.line + 1
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{key}' stands twice (first in line {seen[key]})", key_node.start_mark
                )
            seen[key] = line
        return super().construct_mapping(node, deep=deep)


def _unknown_tag(loader: _StrictLoader, node: yaml.Node) -> object:
    tag = str(node.tag).replace("tag:yaml.org,2002:", "!!")
    raise yaml.constructor.ConstructorError(
        None, None, f"the tag {tag} isn't allowed: plain values only, nothing that runs code", node.start_mark
    )


def _date(loader: _StrictLoader, node: yaml.ScalarNode) -> object:
    try:
        return loader.construct_yaml_timestamp(node)
    except ValueError as problem:
        raise yaml.constructor.ConstructorError(
            None, None, f"{node.value} is no day of the calendar ({problem})", node.start_mark
        ) from problem


_StrictLoader.add_constructor(None, _unknown_tag)
_StrictLoader.add_constructor("tag:yaml.org,2002:timestamp", _date)


def read_yaml(path: Path) -> YamlDocument:
    """Read one YAML document strictly.

    Raises:
        ProjectError: the file is missing, too large, no UTF-8 text, or no plain YAML; the message names file and line.
    """
    return parse_yaml(_text(path), path)


def parse_yaml(text: str, path: Path) -> YamlDocument:
    """Read YAML from text; `path` is for messages only.

    Raises:
        ProjectError: the text is no plain YAML.
    """
    try:
        loader = _StrictLoader(text)
        node = loader.get_single_node()
        if node is None:
            raise ProjectError(f"{path}: the file is empty; start from the example in the README")
        value = loader.construct_document(node)
        lines: dict[str, int] = {}
        _note_lines(node, "", lines)
    except yaml.MarkedYAMLError as problem:
        raise ProjectError(f"{path}{yaml_words(problem, text)}") from problem
    except yaml.reader.ReaderError as problem:
        raise ProjectError(f"{path}{character_words(problem, text)}") from problem
    except (yaml.YAMLError, ValueError) as problem:
        raise ProjectError(f"{path}: not YAML: {str(problem).splitlines()[0]}") from problem
    except RecursionError as problem:
        raise ProjectError(f"{path}: nested too deep for a project file") from problem
    return YamlDocument(value=value, lines=lines)


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise ProjectError(f"{path}: is a folder; name the project file in it (usually project.yaml)")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError as problem:
        raise ProjectError(f"{path}: no such file; check the path") from problem
    except (OSError, ValueError) as problem:
        raise ProjectError(f"{path}: can't be read: {getattr(problem, 'strerror', None) or problem}") from problem
    if len(data) > MAX_BYTES:
        raise ProjectError(f"{path}: larger than {MAX_BYTES:,} bytes, so it is no project file")
    if data.startswith(b"PK\x03\x04"):
        raise ProjectError(f"{path}: is a zip archive, no project file; unpack it and name the project.yaml in it")
    try:
        return data.decode("utf-16") if data[:2] in (b"\xff\xfe", b"\xfe\xff") else data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise ProjectError(f"{path}: not UTF-8 text (byte {problem.start}); save it as UTF-8") from problem


def _note_lines(node: yaml.Node, path: str, lines: dict[str, int]) -> None:
    lines[path] = node.start_mark.line + 1
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            below = f"{path}.{key.value}" if path else str(key.value)
            _note_lines(value, below, lines)
            lines[below] = key.start_mark.line + 1
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            _note_lines(value, f"{path}[{index}]", lines)
