"""Opening an IFC file, or saying plainly why it can't be opened.

Its header is looked at first: a schema name that ifcopenshell can't hold ends the process.
"""

import re
from itertools import takewhile
from pathlib import Path
from typing import Any

import ifcopenshell

from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.native_path import native_path
from asbuilt_bim.ifc.read.archive import MAX_BYTES, unpacked
from asbuilt_bim.ifc.read.circles import refuse_circles
from asbuilt_bim.storage.regular_file import open_regular

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")
_TAIL_BYTES = 65536
_ZIP = (b"PK\x03\x04", b"PK\x05\x06")  # the second is an archive of nothing
HEADER_BYTES = 1_000_000
"""Headers are of some hundred bytes, with long lists of authors of some thousand."""
MAX_NAME = 64
"""Schema names are of 4 to 20 characters; ifcopenshell's parser overflows at some 250."""
_TOKEN = re.compile(
    rb"'(?>\\S\\.|''|[^'])*+(?:'|\Z)"  # \S\ takes the next sign as it is, a quote too
    rb"|/\*.*?(?:\*/|\Z)|[A-Za-z_][A-Za-z0-9_]*|[^\s']",
    re.DOTALL,
)


def open_ifc(path: Path) -> Any:
    """Open an IFC file (STEP text, or an .ifczip with one in it) of one of `SCHEMAS` as an ifcopenshell file.

    Raises:
        DesignError: it is missing, empty, of another format, too large, cut short, damaged, knotted, or of another
            schema.
    """
    head, tail = _ends(path)
    if not head.startswith(_ZIP):
        return _open_text(path, path, head, tail)
    with unpacked(path) as inside:
        return _open_text(inside, path, *_ends(inside))


def _open_text(where: Path, path: Path, head: bytes, tail: bytes) -> Any:
    """Open the STEP text at `where`; messages name `path`, the file that the user gave."""
    _check_kind(path, head)
    if b"END-ISO-10303-21" not in tail:
        raise DesignError(
            f"{path}: the file ends before END-ISO-10303-21, so it was cut short; copy or export it again"
        )
    name, wrong = declared_schema(head)
    if wrong:
        raise DesignError(f"{path}: the file is damaged ({wrong}); export it as {', '.join(SCHEMAS)}")
    try:
        with native_path(where) as native:
            file = ifcopenshell.open(str(native), format=".ifc")
    except (RuntimeError, ValueError, OSError, ifcopenshell.Error) as error:
        reason = f"schema {name} or damaged ({_plain(error)})"
        raise DesignError(f"{path}: can't be opened: {reason}; export it as {', '.join(SCHEMAS)}") from error
    if file is None or file.schema not in SCHEMAS:
        raise DesignError(f"{path}: schema {name} is not supported; export it as one of {', '.join(SCHEMAS)}")
    refuse_circles(file, str(path))
    return file


def _ends(path: Path) -> tuple[bytes, bytes]:
    """Return the first and the last bytes of a file."""
    try:
        with open_regular(path) as stream:
            head = stream.read(HEADER_BYTES)
            if (size := path.stat().st_size) > MAX_BYTES:
                raise DesignError(f"{path}: {size / 1e6:.0f} MB exceeds {MAX_BYTES / 1e6:.0f} MB; split the model")
            stream.seek(max(0, size - _TAIL_BYTES))
            return head, stream.read()
    except FileNotFoundError:
        raise DesignError(f"{path}: there is no such file; check the path") from None
    except IsADirectoryError as error:
        raise DesignError(f"{path}: {error.strerror} (FILE.ifc)") from error
    except OSError as error:
        raise DesignError(f"{path}: can't be read ({error.strerror}); check that it is a file you may read") from error


def _check_kind(path: Path, head: bytes) -> None:
    """Refuse what isn't STEP text, naming what it is instead where that shows."""
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"ISO-10303-21"):
        return
    if not text:
        found = "the file is empty; export it again"
    elif text.startswith(_ZIP):
        found = "this is a zip archive within another; unpack it and give the .ifc inside"
    elif text.startswith(b"<"):
        found = "this is XML (.ifcXML?); export it as IFC-SPF (.ifc)"
    elif b"\x00" in head:
        found = "this is a binary file, not IFC; export the model as IFC-SPF (.ifc)"
    else:
        found = "this is not an IFC file: it doesn't begin with ISO-10303-21; export the model as IFC-SPF (.ifc)"
    raise DesignError(f"{path}: {found}")


def _plain(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__


def declared_schema(head: bytes) -> tuple[str, str]:
    """Return the schema that the first `HEADER_BYTES` of a file declare, "none" without one, and what is wrong."""
    tokens: list[bytes] = []
    for found in _TOKEN.finditer(head):
        token = found.group()
        if token.upper() == b"ENDSEC":
            break
        if not token.startswith(b"/*"):
            tokens.append(token)
    else:
        if len(head) >= HEADER_BYTES:
            return "none", f"its header doesn't end within {HEADER_BYTES / 1e6:.0f} MB"
    name = "none"
    for at in reversed([at for at, token in enumerate(tokens) if token.upper() == b"FILE_SCHEMA"]):
        names = list(takewhile(lambda token: token != b")", tokens[at + 3 :]))
        if tokens[at + 1 : at + 3] != [b"(", b"("] or not names or not names[0].startswith(b"'"):
            return "none", "its FILE_SCHEMA is no list of names"
        longest = max(map(len, names)) - 2
        if longest > MAX_NAME:
            return "none", f"its FILE_SCHEMA is a name of {longest} characters, limit {MAX_NAME}"
        name = names[0][1:-1].decode("ascii", "replace")
    return name, ""
