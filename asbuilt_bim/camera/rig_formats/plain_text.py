"""Calibrations in texts that are neither YAML nor XML: Stereolabs' .conf, MATLAB's assignments, RealSense's listing."""

import re

from asbuilt_bim.errors import RigError

Plain = object
"""Mappings with text as keys, lists, texts, numbers, booleans, None."""

_SECTION = re.compile(r"^\s*\[(LEFT|RIGHT)_CAM_\w{1,16}\]", re.MULTILINE | re.IGNORECASE)
_CONF_LINE = re.compile(r"^\s*(\w{1,40})\s*=\s*([^\s;#]{1,40})\s*(?:[;#].*)?$")
_ASSIGNMENT = re.compile(r"^\s*([A-Za-z]\w{0,60}(?:\.[A-Za-z]\w{0,60}){0,5})\s*=\s*(\[[^\]]{0,4000}\]|[^;\n\[]{1,200})")
_LISTING = re.compile(r'^\s*Intrinsic of\s+"?', re.MULTILINE)
_MOST = 5000  # values of one file: a page of numbers has a hundred


def plain_text(text: str, where: str) -> Plain | None:
    """Read a text of one of these kinds as mappings of numbers' texts; None where it is of none of them.

    Raises: RigError where a value stands twice, or there are too many of them.
    """
    if _SECTION.search(text):
        return _sections(text, where)
    if _LISTING.search(text):
        return {"listing": text}
    if _is_matlab(text):
        return _assignments(text, where)
    return None


def _sections(text: str, where: str) -> dict[str, Plain]:
    """Read `[SECTION]` and `key=value`, keys in lower case: BaseLine and Baseline are one."""
    found: dict[str, dict[str, Plain]] = {}
    section: dict[str, Plain] | None = None
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("[") and stripped.endswith("]"):
            name = stripped[1:-1].strip().upper()[:40]
            if name in found:
                raise RigError(f"{where}: the section [{name}] stands twice; keep the one that counts")
            section = found[name] = {}
        elif section is not None and (pair := _CONF_LINE.match(line)):
            key = pair[1].lower()
            if key in section:
                raise RigError(f"{where}: {pair[1]} stands twice in one section; keep the one that counts")
            section[key] = pair[2]
    if sum(map(len, found.values())) > _MOST:
        raise RigError(f"{where}: holds more than {_MOST} values; this is no camera's calibration")
    return dict(found)


def _is_matlab(text: str) -> bool:
    """Say whether the first line that is no comment assigns numbers to a name."""
    for line in _without_comments(text).splitlines():
        if line.strip():
            return bool(re.match(r"^\s*[A-Za-z][\w.]{0,100}\s*=\s*[-+\[\d.]", line))
    return False


def _without_comments(text: str) -> str:
    """Take out `%{ ... %}`, and `%` or `#` to the end of a line."""
    text = re.sub(r"^\s*%\{.*?^\s*%\}", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"[%#][^\n]*", "", text).replace("...\n", " ")


def _assignments(text: str, where: str) -> dict[str, Plain]:
    """Read `A.b.c = 1.5;` and `A = [1 0; 0 1];` as nested mappings; a matrix becomes the text of its numbers."""
    found: dict[str, Plain] = {}
    plain = re.sub(r"\[[^\]]{0,4000}\]", lambda matrix: matrix[0].replace("\n", " "), _without_comments(text))
    for count, line in enumerate(re.split(r"[;\n](?![^\[\n]*\])", plain)):
        if count > _MOST:
            raise RigError(f"{where}: holds more than {_MOST} values; this is no camera's calibration")
        if pair := _ASSIGNMENT.match(line):
            _put(found, pair[1].split("."), re.sub(r"[\[\];,']", " ", pair[2]).strip(), where)
    return found


def _put(found: dict[str, Plain], path: list[str], value: str, where: str) -> None:
    """Put a value in its place; another value in the same place would hide the first.

    Raises: RigError where one stands there already.
    """
    place: dict[str, Plain] = found
    for name in path[:-1]:
        inner = place.setdefault(name, {})
        if not isinstance(inner, dict):
            raise RigError(f"{where}: {'.'.join(path)[:80]} is a value and a structure at once; correct it")
        place = inner
    if place.get(path[-1], value) != value:
        raise RigError(f"{where}: {'.'.join(path)[:80]} stands twice, with two values; keep the one that counts")
    place[path[-1]] = value
