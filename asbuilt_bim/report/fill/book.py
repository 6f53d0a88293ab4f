"""A workbook's sheets by name, its shared texts, and which of its cells are locked or belong to a pivot table."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from asbuilt_bim.errors import FillError
from asbuilt_bim.report.fill.package import SAVE_AGAIN, Package, workbook_part
from asbuilt_bim.report.fill.references import Area, area_of
from asbuilt_bim.report.fill.sheet import Cell, Sheet, read_sheet
from asbuilt_bim.report.fill.xml_places import Edit, Place, attributes_text, edited

_BEFORE_CALC = ("sheets", "functionGroups", "externalReferences", "definedNames")
"""What stands before <calcPr> in a workbook, in the order of its schema."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Book:
    """A workbook; `parts` are its worksheets' parts by the sheets' names."""

    package: Package
    part: str
    parts: Mapping[str, str]
    others: frozenset[str]  # sheets without cells: charts, dialogs, old macros
    shared: tuple[str, ...]
    unlocked: frozenset[str]  # styles whose cells may be written on a protected sheet

    def sheet(self, name: str) -> Sheet:
        """Return a sheet with its cells.

        Raises:
            FillError: the workbook has none of that name, or it is damaged.
        """
        if name in self.others:
            raise FillError(f"{self.package.path}: '{name}' is a sheet without cells; name one with cells in the map")
        if name not in self.parts:
            known = ", ".join(f"'{one}'" for one in list(self.parts)[:12])
            raise FillError(f"{self.package.path}: there is no sheet '{name}'; there are {known}")
        part = self.parts[name]
        try:
            return read_sheet(name, part, self.package.parts[part], self.package.xml(part))
        except (ValueError, KeyError) as problem:
            raise FillError(
                f"{self.package.path}: sheet '{name}' is damaged: {problem!s:.120}; {SAVE_AGAIN}"
            ) from problem

    def pivots(self, name: str) -> list[Area]:
        """Return the areas of a sheet that pivot tables fill."""
        found = []
        for kind, part in self.package.related(self.parts[name]).values():
            for one in self.package.xml(part) if kind == "pivotTable" else ():
                if one.name == "location":
                    found.append(area_of(one.attributes.get("ref", "")))
        return found

    def locked(self, sheet: Sheet, cell: Cell | None) -> bool:
        """Say whether a cell is locked: it lies on a protected sheet, and its style doesn't unlock it."""
        return sheet.protected and (cell is None or cell.place.attributes.get("s", "0") not in self.unlocked)

    def calculating(self) -> bytes:
        """Return the workbook's part so that every program calculates all formulas when it opens it."""
        data, found = self.package.parts[self.part], self.package.xml(self.part)
        settings = next((one for one in found if one.path == "workbook/calcPr"), None)
        if settings is None:
            last = [one for one in found if one.path.removeprefix("workbook/") in _BEFORE_CALC][-1]
            return edited(data, [Edit(last.end, last.end, f'<{last.prefix}calcPr fullCalcOnLoad="1"/>'.encode())])
        if settings.attributes.get("fullCalcOnLoad") in ("1", "true"):
            return data
        tag = f"<{settings.prefix}calcPr{attributes_text(settings.attributes | {'fullCalcOnLoad': '1'})}/>"
        return edited(data, [Edit(settings.start, settings.end, tag.encode())])


def open_book(package: Package) -> Book:
    """Return the workbook that an archive holds.

    Raises:
        FillError: it holds none, or a damaged one.
    """
    part = workbook_part(package)
    related = package.related(part)
    sheets, others = {}, set()
    for one in package.xml(part):
        if one.path == "workbook/sheets/sheet":
            key = next((value for name, value in one.attributes.items() if name.endswith(":id")), "")
            kind, target = related.get(key, ("", ""))
            if kind == "worksheet" and target in package.parts:
                sheets[one.attributes.get("name", "")] = target
            else:
                others.add(one.attributes.get("name", ""))
    of_kind = {kind: target for kind, target in related.values() if target in package.parts}
    texts = package.xml(of_kind["sharedStrings"]) if "sharedStrings" in of_kind else []
    styles = package.xml(of_kind["styles"]) if "styles" in of_kind else []
    return Book(
        package=package,
        part=part,
        parts=sheets,
        others=frozenset(others),
        shared=_shared(texts),
        unlocked=_unlocked(styles),
    )


def _shared(found: Iterable[Place]) -> tuple[str, ...]:
    """Return the workbook's texts; how they are pronounced (<rPh>) is no part of them."""
    texts: list[list[str]] = []
    for one in found:
        if one.path == "sst/si":
            texts.append([])
        elif one.path in ("sst/si/t", "sst/si/r/t"):
            texts[-1].append(one.text)
    return tuple("".join(parts) for parts in texts)


def _unlocked(found: Iterable[Place]) -> frozenset[str]:
    """Return the numbers of the cell styles that unlock their cells."""
    number, open_ones = -1, set()
    for one in found:
        if one.path == "styleSheet/cellXfs/xf":
            number += 1
        elif one.path == "styleSheet/cellXfs/xf/protection" and one.attributes.get("locked") in ("0", "false"):
            open_ones.add(str(number))
    return frozenset(open_ones)
