"""A STEP file's header, looked at before ifcopenshell opens the file: a schema name it can't hold ends the process."""

from __future__ import annotations

import re
from itertools import takewhile

HEADER_BYTES = 1_000_000
"""Headers are of some hundred bytes, with long lists of authors of some thousand."""
MAX_NAME = 64
"""Schema names are of 4 to 20 characters; ifcopenshell's parser overflows at some 250."""
_TOKEN = re.compile(
    rb"'(?>\\S\\.|''|[^'])*+(?:'|\Z)"  # \S\ takes the next sign as it is, a quote too
    rb"|/\*.*?(?:\*/|\Z)|[A-Za-z_][A-Za-z0-9_]*|[^\s']",
    re.DOTALL,
)


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
