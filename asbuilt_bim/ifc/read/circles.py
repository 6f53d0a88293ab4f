"""Circles in a file: a placement that refers to itself, a solid cut by itself. They crash or hold up every reader.

Looked for before any geometry, by a walk that needs no recursion.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from asbuilt_bim.errors import DesignError

MAX_DEPTH = 500
"""Files of others nest some twenty deep; every library follows such a chain by calling itself."""
MAX_STEPS = 100_000
"""Cuts and copies that one solid may stand for: a tree of them that shares its branches doubles at every level."""

_PLACEMENTS = {
    "IfcLocalPlacement": ("PlacementRelTo",),
    "IfcGridPlacement": ("PlacementRelTo",),
    "IfcLinearPlacement": ("PlacementRelTo",),
    "IfcGeometricRepresentationSubContext": ("ParentContext",),
}
_UNITS = {
    "IfcConversionBasedUnit": ("ConversionFactor",),
    "IfcConversionBasedUnitWithOffset": ("ConversionFactor",),
    "IfcMeasureWithUnit": ("UnitComponent",),
    "IfcDerivedUnit": ("Elements",),
    "IfcDerivedUnitElement": ("Unit",),
}
_STEPS = {
    "IfcBooleanResult": ("FirstOperand", "SecondOperand"),
    "IfcBooleanClippingResult": ("FirstOperand", "SecondOperand"),
    "IfcMappedItem": ("MappingSource",),
}
_SOLIDS = {
    **_STEPS,
    "IfcCsgSolid": ("TreeRootExpression",),
    "IfcRepresentationMap": ("MappedRepresentation",),
    "IfcShapeRepresentation": ("Items",),
    "IfcCompositeProfileDef": ("Profiles",),
    "IfcDerivedProfileDef": ("ParentProfile",),
    "IfcMirroredProfileDef": ("ParentProfile",),
    "IfcCompositeCurve": ("Segments",),
    "IfcCompositeCurveSegment": ("ParentCurve",),
    "IfcTrimmedCurve": ("BasisCurve",),
    "IfcOffsetCurve2D": ("BasisCurve",),
    "IfcOffsetCurve3D": ("BasisCurve",),
}
_KNOTTED = ("IfcBooleanResult", "IfcMappedItem", "IfcCompositeProfileDef", "IfcDerivedProfileDef", "IfcCompositeCurve",
            "IfcTrimmedCurve", "IfcOffsetCurve2D", "IfcOffsetCurve3D")  # fmt: skip
"""Where a circle of solids must pass; the many solids without any of these aren't walked."""
_WHOLES = (
    ("IfcRelAggregates", "RelatingObject", "RelatedObjects"),
    ("IfcRelNests", "RelatingObject", "RelatedObjects"),
    ("IfcRelContainedInSpatialStructure", "RelatingStructure", "RelatedElements"),
    ("IfcRelVoidsElement", "RelatingBuildingElement", "RelatedOpeningElement"),
    ("IfcRelFillsElement", "RelatingOpeningElement", "RelatedBuildingElement"),
)
_NAMED = 4

Next = Callable[[Any], Iterable[Any]]


@dataclass(slots=True)
class _Walked:
    """What is known of the entities that were walked: how deep each is, and how many steps it stands for."""

    depth: dict[int, int] = field(default_factory=dict)
    steps: dict[int, int] = field(default_factory=dict)


def refuse_circles(file: Any, where: str) -> None:
    """Refuse an open file whose placements, units, solids or wholes lead back to themselves, or nest without end.

    Raises:
        DesignError: it has such a circle, a chain deeper than `MAX_DEPTH`, a solid of over `MAX_STEPS` cuts and copies,
            or cuts an element by what is no opening.
    """
    _walk(_of(file, _PLACEMENTS), _along(_PLACEMENTS), "placements", where)
    _walk(_of(file, _UNITS), _along(_UNITS), "units", where)
    _walk(_of(file, _KNOTTED), _along(_SOLIDS), "solids", where)
    wholes = _parts(file, where)
    _walk([thing for thing, _ in wholes.values()], lambda thing: wholes.get(thing.id(), (None, []))[1], "parts", where)


def _of(file: Any, names: Iterable[str]) -> Iterator[Any]:
    for name in names:
        try:
            yield from file.by_type(name)
        except RuntimeError:  # a class that the file's schema doesn't have
            continue


def _along(links: Mapping[str, tuple[str, ...]]) -> Next:
    """Return what gives the entities that one refers to by the attributes of its class."""

    def following(thing: Any) -> Iterator[Any]:
        for name in links.get(thing.is_a(), ()):
            yield from _entities(thing, name)

    return following


def _entities(thing: Any, name: str) -> Iterator[Any]:
    try:
        value = getattr(thing, name, None)
    except (RuntimeError, TypeError, ValueError):  # of another kind than the schema says: refused where it is read
        return
    for one in value if isinstance(value, tuple) else (value,):
        if hasattr(one, "is_a") and one.id():
            yield one


def _parts(file: Any, where: str) -> dict[int, tuple[Any, list[Any]]]:
    """Return each whole, by its number, with its parts, what lies in it and what cuts it."""
    found: dict[int, tuple[Any, list[Any]]] = {}
    for name, whole, part in _WHOLES:
        for relation in _of(file, (name,)):
            parts = list(_entities(relation, part))
            for thing in _entities(relation, whole):
                found.setdefault(thing.id(), (thing, []))[1].extend(parts)
            if name == "IfcRelVoidsElement" and not all(one.is_a("IfcFeatureElementSubtraction") for one in parts):
                raise DesignError(
                    f"{where}: #{relation.id()} {name} cuts an element by {_label(parts[0])}, which is no opening. The "
                    "file is damaged; export it again"
                )
    return found


def _walk(starts: Iterable[Any], following: Next, what: str, where: str) -> None:
    """Walk everything that can be reached, each entity once, and refuse what leads back to where the walk stands."""
    walked = _Walked()
    for start in starts:
        if start.id() in walked.depth:
            continue
        way: list[tuple[Any, Iterator[Any]]] = [(start, iter(following(start)))]
        on_way = {start.id()}
        while way:
            thing, ahead = way[-1]
            after = next(ahead, None)
            if after is None:
                _leave(thing, following, walked, what, where)
                on_way.discard(thing.id())
                way.pop()
            elif after.id() in on_way:
                circle = [one for one, _ in way]
                circle = circle[next(i for i, one in enumerate(circle) if one.id() == after.id()) :]
                raise DesignError(
                    f"{where}: its {what} lead back to themselves ({_names([*circle, after])}). The file is "
                    "damaged; repair it in the program that wrote it, and export it again"
                )
            elif after.id() not in walked.depth:
                way.append((after, iter(following(after))))
                on_way.add(after.id())


def _leave(thing: Any, following: Next, walked: _Walked, what: str, where: str) -> None:
    """Note how deep an entity is and how many steps it stands for, once all that it refers to is known."""
    below = [one.id() for one in following(thing)]
    walked.depth[thing.id()] = depth = 1 + max((walked.depth[one] for one in below), default=0)
    walked.steps[thing.id()] = steps = (thing.is_a() in _STEPS) + sum(walked.steps[one] for one in below)
    if depth > MAX_DEPTH:
        raise DesignError(
            f"{where}: its {what} are nested over {MAX_DEPTH} deep ({_label(thing)}); export it with simpler geometry"
        )
    if steps > MAX_STEPS:
        raise DesignError(
            f"{where}: {_label(thing)} stands for over {MAX_STEPS:,} cuts and copies; export it with simpler geometry"
        )


def _names(circle: list[Any]) -> str:
    shown = [*circle[:_NAMED], circle[-1]] if len(circle) > _NAMED + 1 else circle
    return " -> ".join(map(_label, shown))


def _label(thing: Any) -> str:
    return f"#{thing.id()} {thing.is_a()}"
