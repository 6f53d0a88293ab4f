"""The names of a design's IFC files: one text in a result, single ones where another format lists files."""

import re

_BETWEEN = re.compile(r"(?<=\.ifc), |(?<=\.ifczip), ", re.IGNORECASE)


def file_names(design: str) -> tuple[str, ...]:
    """Return the names in a design's `file_name`, none of an empty one; a comma within a name stays there."""
    return tuple(_BETWEEN.split(design)) if design else ()
