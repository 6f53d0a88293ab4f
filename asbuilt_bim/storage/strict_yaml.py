"""YAML read with no surprises: no code, no doubled keys, no aliases, no bombs; and the line of every key.

`StrictLoader` is what every YAML file goes through: projects, cards of networks, rigs.
"""

import codecs
import re
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.storage.regular_file import as_text, read_bytes

MAX_BYTES = 1_000_000
"""A project file of a thousand stations is about 150 kB; more than this is no project file."""
MAX_NODES = 100_000
"""Keys, values and lists, each counted. A thousand stations are 7,000; a million letters of `a, a, a` take minutes."""

_NO_BLANK = re.compile(r"[\s-]*\w+:[^\s/\\]")
_BEHIND_HASH = re.compile(r"^#(\w+):", re.MULTILINE)
_OTHERWISE = re.compile(r"[-+]?(0[\d_]+|\d[\d_]*(:[\d.]+)+)")
"""Numbers that YAML counts in eights, `010`, and in sixties, `12:30`."""
_TAG = "tag:yaml.org,2002:"


@dataclass(frozen=True, slots=True, kw_only=True)
class YamlDocument:
    """What a YAML file holds, and the line (from 1) of each key path such as `visits[0].date`.

    `behind_hash` has the lines of keys of the file itself that stand behind a #, as in `#rig:`.
    """

    value: object
    lines: dict[str, int]
    behind_hash: dict[str, int] = field(default_factory=dict)


class StrictLoader(yaml.SafeLoader):
    """SafeLoader that refuses aliases, doubled keys, foreign tags and halves of characters, each with its line."""

    nodes = 0
    typed_by_hand = True

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Refuse an alias before it is followed, and more values than any file of this program's has."""
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise _refusal(f"more than {MAX_NODES:,} values, which no such file has", self.peek_event())  # type: ignore[no-untyped-call]
        if self.check_event(yaml.events.AliasEvent):
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise _refusal("aliases (*name) aren't read here: write the value out", event)
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Refuse keys that stand twice, that merge, or that are no plain values."""
        seen: dict[object, int] = {}
        for key_node, _ in node.value:
            if key_node.tag == f"{_TAG}merge":
                raise _refusal("merging (<<) isn't read here: write the keys out", key_node)
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _refusal("a key must be plain text", key_node)
            line = key_node.start_mark.line + 1
            if key in seen:
                raise _refusal(f"the key '{key}' stands twice (first in line {seen[key]})", key_node)
            seen[key] = line
        return super().construct_mapping(node, deep=deep)

    def construct_scalar(self, node: Any) -> Any:
        """Refuse halves of characters, which no file name and no text can hold."""
        value = super().construct_scalar(node)
        if isinstance(value, str) and (half := next((c for c in value if "\ud800" <= c <= "\udfff"), "")):
            raise _refusal(f"holds half a character (\\u{ord(half):04x}), which no text has; write it whole", node)
        return value


def _refusal(words: str, where: Any) -> yaml.constructor.ConstructorError:
    return yaml.constructor.ConstructorError(None, None, words, where.start_mark)


def _unknown_tag(loader: StrictLoader, node: yaml.Node) -> object:
    tag = str(node.tag).replace(_TAG, "!!")
    raise _refusal(f"the tag {tag} isn't allowed: plain values only, nothing that runs code", node)


def _plain_or_refused(construct: Callable[..., object], what: str) -> Callable[..., object]:
    """Return a constructor that says with its line what YAML's own stumbles over: `!!bool maybe`, `!!int ''`."""

    def constructor(loader: StrictLoader, node: yaml.Node) -> object:
        if loader.typed_by_hand and what.endswith("number") and _OTHERWISE.fullmatch(str(node.value)):
            raise _refusal(f"{node.value} is another number to YAML; write it plainly, or in quotes as text", node)
        try:
            return construct(loader, node)
        except (ValueError, KeyError, IndexError, AttributeError, OverflowError) as problem:
            shown = str(node.value)[:40]
            reason = f" ({problem})" if what == "day of the calendar" and isinstance(problem, ValueError) else ""
            raise _refusal(f"{shown or 'an empty value'} is no {what}{reason}", node) from problem

    return constructor


StrictLoader.add_constructor(None, _unknown_tag)
for _kind, _what in (
    ("bool", "true or false"),
    ("int", "whole number"),
    ("float", "number"),
    ("timestamp", "day of the calendar"),
):
    _construct = yaml.SafeLoader.yaml_constructors[f"{_TAG}{_kind}"]
    StrictLoader.add_constructor(f"{_TAG}{_kind}", _plain_or_refused(_construct, _what))


def yaml_text(plain: object) -> str:
    """Return plain values as YAML text, keys in their order."""
    return str(yaml.safe_dump(plain, sort_keys=False, allow_unicode=True, width=120))


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
        loader = StrictLoader(text)
        node = loader.get_single_node()
        if node is None:
            raise ProjectError(f"{path}: the file is empty; start from the example in the README")
        value = loader.construct_document(node)
        lines: dict[str, int] = {}
        _note_lines(node, "", lines)
    except (yaml.YAMLError, ValueError) as problem:
        raise ProjectError(f"{path}{yaml_words(problem, text)}") from problem
    except RecursionError as problem:
        raise ProjectError(f"{path}: nested too deep for a project file") from problem
    hidden = {key.group(1): text.count("\n", 0, key.start()) + 1 for key in _BEHIND_HASH.finditer(text)}
    return YamlDocument(value=value, lines=lines, behind_hash=hidden)


def yaml_words(problem: Exception, text: str) -> str:
    """Return `, line N (its text): what is wrong there` of a YAML text that couldn't be read."""
    if isinstance(problem, yaml.reader.ReaderError):
        line = text.count("\n", 0, problem.position) + 1
        return f", line {line}: holds a character that no text has (U+{problem.character:04X}); take it out"
    mark = getattr(problem, "problem_mark", None)
    if not isinstance(problem, yaml.MarkedYAMLError) or mark is None:
        return f": not YAML: {str(problem).splitlines()[0]:.200}"
    if isinstance(problem, yaml.constructor.ConstructorError):  # our own refusals
        return f", line {mark.line + 1}: {problem.problem}"
    shown = "".join(c for c in "".join(text.splitlines()[mark.line : mark.line + 1]).strip() if c.isprintable())
    begun = f", in what begins in line {problem.context_mark.line + 1}" if problem.context_mark else ""
    first = problem.context_mark.line if problem.context_mark else mark.line
    hint = _slip(text.splitlines()[first : mark.line + 1], first + 1)
    return f", line {mark.line + 1}{f' ({shown:.60})' if shown else ''}: {problem.problem}{begun}; {hint}"


def _slip(lines: Sequence[str], first: int) -> str:
    """Return what to do about lines that are no YAML: what is wrong with one of them, else where to look."""
    for number, line in enumerate(lines, first):
        if "\t" in line[: len(line) - len(line.lstrip())]:
            return f"a tab stands at the beginning of line {number}: put blanks there"
        if "\u00a0" in line:
            return f"a no-break space stands in line {number}: type a blank in its place"
        if '"' in line and "\\" in line:
            return f"in quotation marks, as in line {number}, write / for \\"
        if _NO_BLANK.match(line):
            return f"put a blank behind the colon in line {number}"
    return "check how it is indented, and its colons, quotes and brackets"


def _text(path: Path) -> str:
    data = read_bytes(path, MAX_BYTES, ProjectError)
    if data.startswith(b"ISO-10303-21"):
        raise ProjectError(f"{path}: is an IFC file; a YAML file is expected here")
    if data.startswith(b"PK\x03\x04"):
        raise ProjectError(f"{path}: is a workbook or a zip archive, no YAML file; name the .yaml file, unpacked")
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return as_text(data, ProjectError, str(path), "utf-16" if wide else "utf-8-sig")


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
