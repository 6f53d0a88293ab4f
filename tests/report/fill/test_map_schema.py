from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from asbuilt_bim.report.fill.mapping import FillMap, read_map
from asbuilt_bim.report.fill.quantities import OF_BILL_LINES, OF_COST_LINES, OF_ELEMENTS, OF_GROUPS
from asbuilt_bim.storage.schemas import first_fault, schema

PAGE = Path(__file__).parents[3] / "docs" / "fill.md"


def example() -> str:
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return str(text)


def test_the_schema_and_the_page_name_every_quantity_that_can_be_filled() -> None:
    lists = schema("map-1")["$defs"]
    page = PAGE.read_text(encoding="utf-8")
    for name, known in (
        ("of_elements", OF_ELEMENTS),
        ("of_cost_lines", {**OF_COST_LINES, **OF_BILL_LINES}),
        ("of_groups", OF_GROUPS),
    ):
        assert sorted(lists[name]["enum"]) == sorted(known)
    for quantity in {*OF_ELEMENTS, *OF_COST_LINES, *OF_BILL_LINES}:
        assert f"`{quantity}`" in page


def test_the_pages_map_is_one(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(example(), encoding="utf-8")
    found = read_map(tmp_path / "map.yaml")
    assert isinstance(found, FillMap) and len(found.tables) == 2
    assert first_fault("map-1", yaml.safe_load(example())) == ""


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(version=2),
        lambda d: d.update(unknown="zero"),
        lambda d: d["tables"][0].update(unit=3),
        lambda d: d["tables"][1].update(unit="C"),
        lambda d: d["tables"][0]["key"].update(storey="B"),
        lambda d: d["tables"][0]["columns"].update(F="state"),
        lambda d: d["tables"][0].update(rows=5),
    ],
)
def test_schema_and_reader_refuse_the_same_maps(tmp_path: Path, damage: Any) -> None:
    document = yaml.safe_load(example())
    damage(document)
    assert first_fault("map-1", document)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    with pytest.raises(Exception, match=r"map\.yaml"):
        read_map(tmp_path / "map.yaml")
