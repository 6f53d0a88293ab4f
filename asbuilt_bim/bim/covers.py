"""What a cost line is said to pay for, and what that comes to in the design."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover:
    """Elements by GlobalIds, by an ifcopenshell selector, or by class, storey and type (all that is given fits)."""

    global_ids: tuple[str, ...] = ()
    selector: str = ""
    ifc_class: str = ""
    storey: str = ""  # its name
    type_name: str = ""

    @property
    def by_rule(self) -> bool:
        """Say whether a class, a storey or a type is given."""
        return bool(self.ifc_class or self.storey or self.type_name)

    @property
    def empty(self) -> bool:
        """Say whether nothing is given."""
        return not (self.global_ids or self.selector or self.by_rule)


@dataclass(frozen=True, slots=True, kw_only=True)
class Covered:
    """What a cover comes to: GlobalIds of measured walls and columns, how many other elements, and what is unknown."""

    elements: tuple[str, ...]
    others: int
    unknown: tuple[str, ...] = ()  # GlobalIds that no file of the design has
    fault: str = ""  # why its selector can't be read


@dataclass(frozen=True, slots=True, kw_only=True)
class CoveredRows:
    """The covers of a table in its order, and the currency that the design's files say."""

    rows: tuple[Covered, ...]
    currency: str
