"""What a task or a cost item is assigned to: building elements, through types and assemblies, measured here or not."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Assigned:
    """What an assignment means: GlobalIds of measured walls and columns, and how many other building elements."""

    elements: tuple[str, ...]
    others: int


def assigned_elements(products: Iterable[Any], measured: frozenset[str]) -> Assigned:
    """Sort the products of a task or a cost item into those that are measured here and the rest.

    A type stands for its occurrences, an assembly for its parts. Spaces, groups, resources and openings are no work
    that is built, and count for nothing.
    """
    open_ones = [product for product in products if product is not None]
    open_ones.reverse()
    met: set[int] = set()
    found: dict[str | int, None] = {}  # GlobalIds of what is measured; a file may give the rest none, or one twice
    while open_ones:
        product = open_ones.pop()
        if product.id() in met:
            continue
        met.add(product.id())
        instead = [] if getattr(product, "GlobalId", None) in measured else list(_stands_for(product))
        if instead:
            open_ones += reversed(instead)
        elif product.is_a("IfcElement") and not product.is_a("IfcFeatureElement"):
            found[product.GlobalId if product.GlobalId in measured else product.id()] = None
    elements = tuple(name for name in found if isinstance(name, str))
    return Assigned(elements=elements, others=len(found) - len(elements))


def _stands_for(product: Any) -> Iterator[Any]:
    """Yield the occurrences of a type, or the parts of an element."""
    if product.is_a("IfcTypeObject"):
        for relation in getattr(product, "Types", None) or getattr(product, "ObjectTypeOf", None) or ():
            yield from relation.RelatedObjects
    elif product.is_a("IfcElement"):
        for relation in product.IsDecomposedBy or ():
            yield from relation.RelatedObjects
