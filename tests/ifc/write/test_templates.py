"""The templates in schemas/ are those that the program makes, and name all that the writer writes."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import ifcopenshell.validate

from asbuilt_bim.ifc.names import MARKS, QUANTITIES
from asbuilt_bim.ifc.write.templates import write_templates

COMMITTED = Path(__file__).parents[3] / "schemas" / "asbuilt-bim-psets.ifc"


def test_the_committed_templates_are_the_ones_the_program_makes(tmp_path: Path) -> None:
    made = tmp_path / "asbuilt-bim-psets.ifc"
    write_templates(made)

    def data(path: Path) -> str:
        return path.read_text().split("DATA;", 1)[1]

    assert data(made) == data(COMMITTED)


def test_the_templates_are_valid_and_complete() -> None:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(COMMITTED), logger)
    assert not [one for one in logger.statements if one.get("level") == "error"]
    file = ifcopenshell.open(str(COMMITTED))
    names = {template.Name for template in file.by_type("IfcSimplePropertyTemplate")}
    assert names == {mark.name for mark in MARKS} | set(QUANTITIES)
    # the names Pset_ and Qto_ are buildingSMART's
    assert not any(one.Name.startswith(("Pset_", "Qto_")) for one in file.by_type("IfcPropertySetTemplate"))


def test_nothing_that_readers_are_told_takes_the_best_estimate_or_what_was_seen_for_a_count_of_certain_cells() -> None:
    root = COMMITTED.parents[1]
    told = [COMMITTED, root / "schemas/result-1.json", root / "docs/conventions.md", root / "docs/ifc-mapping.md"]
    for path in told:
        text = path.read_text(encoding="utf-8").lower()
        for wrong in ("built / (built + open)", "decided cells / all", "cells decided", "cells that are built or open"):
            assert wrong not in text, f"{path.name}: {wrong}"
