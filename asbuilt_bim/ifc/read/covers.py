"""What the rows of a costs table pay for, found in the IFC files: selectors are evaluated here alone."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import ifcopenshell.util.element
import ifcopenshell.util.selector

from asbuilt_bim.bim.covers import Cover, Covered, CoveredRows
from asbuilt_bim.ifc.read.assignments import assigned_elements
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.read.structure import storey_of, storeys_in
from asbuilt_bim.ifc.units import read_units


class _File:
    """An IFC file with its elements by GlobalId, class, storey and type, each index made once."""

    def __init__(self, path: Path) -> None:
        self.file = open_ifc(path)
        self.products = [one for one in self.file.by_type("IfcElement") if not one.is_a("IfcFeatureElement")]
        self.by_id = {one.GlobalId: one for one in self.products}
        storeys = {one.GlobalId: one.Name or one.LongName or "" for one in storeys_in(self.file)}
        self.storey = {one.id(): _bare(storeys.get(storey_of(one), "")) for one in self.products}
        self.type = {one.id(): _bare(_type_name(one)) for one in self.products}

    def chosen(self, cover: Cover) -> Iterator[Any]:
        """Yield what a cover picks; what it names by GlobalId may be a type or an assembly, too."""
        for key in cover.global_ids:
            if key in self.by_id:
                yield self.by_id[key]
            elif (found := _by_guid(self.file, key)) is not None:
                yield found
        if cover.selector:
            yield from sorted(ifcopenshell.util.selector.filter_elements(self.file, cover.selector), key=_number)
        if cover.by_rule:
            yield from (one for one in self._of_class(cover.ifc_class) if self._fits(one, cover))

    def _of_class(self, ifc_class: str) -> list[Any]:
        if not ifc_class:
            return self.products
        try:
            return [one for one in self.file.by_type(ifc_class) if one.id() in self.type]
        except RuntimeError:  # the schema knows no such class
            return []

    def _fits(self, product: Any, cover: Cover) -> bool:
        number = product.id()
        storey = not cover.storey or self.storey[number] == _bare(cover.storey)
        return storey and (not cover.type_name or self.type[number] == _bare(cover.type_name))


def read_covers(paths: Sequence[Path], covers: Sequence[Cover], measured: frozenset[str]) -> CoveredRows:
    """Return what each cover comes to in the files of a design, of which `measured` are its walls and columns.

    Raises:
        DesignError: a file can't be opened.
    """
    files = [_File(path) for path in paths]
    currency = next((found for one in files if (found := read_units(one.file).currency)), "")
    return CoveredRows(rows=tuple(_covered(files, cover, measured) for cover in covers), currency=currency)


def _covered(files: Sequence[_File], cover: Cover, measured: frozenset[str]) -> Covered:
    picked: list[list[Any]] = []
    for one in files:
        try:
            picked.append(list(one.chosen(cover)))
        except Exception as error:  # the selector's parser raises its own kinds
            return Covered(elements=(), others=0, fault=" ".join(str(error).split())[:160] or type(error).__name__)
    met: set[str] = set()
    elements: list[str] = []
    others = 0
    for products in picked:
        found = assigned_elements(products, measured)
        elements += [key for key in found.elements if key not in met]
        met.update(found.elements)
        others += found.others
    there = {one.GlobalId for products in picked for one in products}
    unknown = tuple(key for key in cover.global_ids if key not in there)
    return Covered(elements=tuple(elements), others=others, unknown=unknown)


def _by_guid(file: Any, key: str) -> Any:
    try:
        return file.by_guid(key)
    except RuntimeError:
        return None


def _type_name(product: Any) -> str:
    kind = ifcopenshell.util.element.get_type(product)
    return str((kind.Name if kind is not None else getattr(product, "ObjectType", None)) or "")


def _bare(text: str) -> str:
    return " ".join(text.split()).casefold()


def _number(product: Any) -> int:
    return int(product.id())
