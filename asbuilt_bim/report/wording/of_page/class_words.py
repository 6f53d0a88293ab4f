"""What elements of an IFC class are called on site: "Columns", not IfcColumn."""

import re

_OWN = {"BuildingElementProxy": "Other element", "Member": "Member or strut"}
_PLURALS = {"Other element": "Other elements", "Member or strut": "Members and struts"}
_CASES = re.compile(r"(StandardCase|ElementedCase)$")
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z0-9]*|[a-z0-9]+")


def class_word(ifc_class: str) -> str:
    """Return what one element of a class is called: `Column` of IfcColumn, `Curtain wall` of IfcCurtainWall."""
    name = _CASES.sub("", ifc_class.removeprefix("Ifc"))
    return _OWN.get(name) or " ".join(_WORDS.findall(name)).capitalize() or ifc_class


def class_words(ifc_class: str) -> str:
    """Return what several are called: `Columns`."""
    one = class_word(ifc_class)
    return _PLURALS.get(one) or (one if one.endswith("s") else f"{one}s")
