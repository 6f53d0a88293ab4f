"""JSON read with no surprises: no doubled keys, no NaN."""

import json
from collections import Counter
from typing import Any, NoReturn


def parse_json(text: str | bytes) -> Any:
    """Return what a JSON text holds.

    Raises:
        ValueError: it is no JSON, holds NaN or Infinity, or a key twice in one mapping; the text says which.
        RecursionError: it is nested too deep.
    """
    return json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number of JSON")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        key = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f'the key "{key:.60}" stands twice in the mapping of {", ".join(list(found)[:5]):.120}')
    return found
