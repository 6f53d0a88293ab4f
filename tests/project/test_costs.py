"""Costs tables: lines with what they cover; what covers nothing, and what is covered twice, is named."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import openpyxl
import pytest

from asbuilt_bim.bim.cost_units import currency_of, currency_there, meant_unit, measure_of, parted_money, sign_of
from asbuilt_bim.bim.covers import Cover
from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CostError
from asbuilt_bim.ifc.read.covers import read_covers
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.valuation.notes import of_money
from asbuilt_bim.project.tables.costs import CostsTable, read_costs, with_costs
from tests.ifc.models import ModelBuilder
from tests.notes import codes

HEAD = "item,text,unit,quantity,rate,globalids,selector,class,storey,type\n"


def costs(path: Path, *rows: str, head: str = HEAD) -> CostsTable:
    (path / "boq.csv").write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
    return read_costs(path / "boq.csv")


def building(path: Path) -> Path:
    builder = ModelBuilder(schema="IFC4")
    builder.box("IfcWall", "W1", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    builder.box("IfcWall", "W2", (0.0, 5.0, 0.0), (4.0, 0.2, 3.0))
    builder.box("IfcColumn", "C", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.box("IfcSlab", "S", (0.0, 0.2, 3.0), (4.0, 3.0, 0.2))
    wall = builder.file.by_type("IfcWall")[0]
    kind = builder.rooted("IfcWallType", Name="Basic 20", PredefinedType="STANDARD")
    builder.rooted("IfcRelDefinesByType", RelatedObjects=[wall], RelatingType=kind)
    builder.cost("of the IFC", [wall], "IfcQuantityVolume", 2.4, 100.0)
    return builder.write(path / "design.ifc")


def priced(path: Path, *rows: str) -> tuple[BimModel, dict[str, str]]:
    """Return the design with the table's lines, and its GlobalIds by name."""
    ifc = building(path)
    design = read_design(ifc)
    ids = {element.name: element.global_id for element in design.elements}
    table = costs(path, *(row.format(**ids) for row in rows))
    covered = read_covers([ifc], table.covers, frozenset(ids.values()))
    return with_costs(design, table, covered), ids


def test_a_line_covers_by_global_ids_by_selector_and_by_class_storey_and_type(tmp_path: Path) -> None:
    design, ids = _by_every_means(tmp_path)
    covers = {line.identification: sorted(line.elements) for line in design.cost_lines}
    assert covers["1"] == covers["3"] == sorted([ids["W1"], ids["W2"]])
    assert covers["2"] == [ids["C"]] and covers["4"] == [ids["W1"]]
    everything = next(line for line in design.cost_lines if line.identification == "5")
    assert sorted(everything.elements) == sorted(ids.values()) and everything.others == 1  # the slab


def _by_every_means(path: Path) -> tuple[BimModel, dict[str, str]]:
    storey = read_design(building(path)).storeys[0].name
    return priced(
        path,
        "1,by ids,m3,4.8,100,{W1} {W2},,,,",
        "2,by selector,m3,1,100,,IfcColumn,,,",
        "3,by class,m2,1,100,,,IfcWall,,",
        "4,by type,m2,1,100,,,,,basic  20",
        f"5,all of a storey,t,1,100,,,,{storey.upper()},",
    )


def test_the_tables_lines_count_in_the_place_of_the_ifcs_and_a_note_says_so(tmp_path: Path) -> None:
    design, _ = priced(tmp_path, "1,walls,cbm,4.8,100,{W1},,,,")
    (line,) = design.cost_lines
    assert (line.unit, line.measure, line.schedule, line.currency) == ("m3", "volume", "boq.csv", "EUR")
    found = codes(design.notes)
    assert Reason.COSTS_INSTEAD in found and Reason.NOT_IN_COST_LINES in found
    assert found.count(Reason.NOT_IN_COST_LINES) == 1


def test_what_covers_nothing_and_what_is_covered_twice_is_named(tmp_path: Path) -> None:
    design, _ = priced(
        tmp_path,
        "1,walls,m3,4.8,100,{W1},,,,",
        "2,walls again,m3,4.8,100,,,IfcWall,,",
        "3,nowhere,m3,1,1,,,IfcWall,Level 99,",
        "4,nothing said,h,1,1,,,,,",
        "5,strangers,m3,1,1,0000000000000000000000 {C},,,,",
        "6,steel,t,1,1,{C},,,,",
    )
    found = codes(design.notes)
    assert found.count(Reason.COST_COVERS_NOTHING) == 2
    assert found.count(Reason.COST_PAID_TWICE) == 1
    assert found.count(Reason.COST_COVER_UNKNOWN) == 1
    assert found.count(Reason.COST_UNIT_UNKNOWN) == 1
    wrong = next(note for note in design.notes if note.values.get("written") == "Level 99")
    assert (wrong.values["column"], wrong.values["known"]) == ("storey", tuple(one.name for one in design.storeys))
    assert len(design.cost_lines) == 6
    asked = {str(note.values.get("item")) for note in design.notes if of_money(note)}
    assert asked >= {"3 nowhere", "5 strangers"} and "4 nothing said" not in asked


def test_a_selector_that_cannot_be_read_is_refused_with_its_item(tmp_path: Path) -> None:
    with pytest.raises(CostError, match=r"item 7: its selector can't be read"):
        priced(tmp_path, '7,walls,m3,4.8,100,,"IfcWall, , =",,,')


def test_a_row_without_a_price_adds_its_elements_to_its_item_and_empty_rows_are_headings(tmp_path: Path) -> None:
    table = costs(tmp_path, "01,Concrete,,,,,,,,", "1,walls,m3,4.8,100,A,,,,", "1,,,,,B C,,,,", ",,,,,D,,,,")
    assert [line.identification for line in table.lines] == ["1"]
    assert table.covers == (Cover(global_ids=("A", "B", "C")),)


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (["1,a,m3,1,1,,,,,", "1,b,m3,1,1,,,,,"], "row 3: the item '1' stands in row 2"),
        ([",a,m3,1,1,,,,,"], "row 2: has no item"),
        (["1,a,m3,,1,,,,,"], "row 2, quantity: is empty"),
        (["1,a,m3,one,1,,,,,"], "row 2, quantity: 'one' is no number"),
        (["1,a,m3,1e13,1,,,,,"], "beyond"),
        (["1,a,m3,1,1,,,,,", "2,,,,,A,,,,"], "'2' has no unit, quantity and rate"),
        (["1,a,m3,1,1,,,,,", "1,,,,,,,IfcWall,,"], "adds GlobalIds"),
        (["01,Heading,,,,,,,,"], "no line"),
    ],
)
def test_rows_that_cannot_be_meant_are_refused_by_their_number(tmp_path: Path, rows: list[str], reason: str) -> None:
    with pytest.raises(CostError, match=reason):
        costs(tmp_path, *rows)


@pytest.mark.parametrize("item", ["01. Jan", "1-Jan", "Jan 26", "10. Mär"])
def test_an_item_that_a_spreadsheet_made_a_day_of_is_refused(tmp_path: Path, item: str) -> None:
    with pytest.raises(CostError, match=f"row 2: the item '{item}' is a day; a spreadsheet makes one of 1.1"):
        costs(tmp_path, f"{item},a,m3,1,2,,,,,")
    book = openpyxl.Workbook()
    for row in (["item", "unit", "quantity", "rate"], [date(2026, 1, 1), "m3", 1, 2]):
        book.active.append(row)  # type: ignore[union-attr]
    book.save(tmp_path / "boq.xlsx")
    with pytest.raises(CostError, match="row 2: the item '2026-01-01' is a day"):
        read_costs(tmp_path / "boq.xlsx")


@pytest.mark.parametrize("item", ["01.01.0010", "1.1", "Mayor 1", "1 Deck", "DEC-01", "MAR 12"])
def test_an_item_that_is_no_day_of_a_spreadsheet_stays(tmp_path: Path, item: str) -> None:
    assert costs(tmp_path, f"{item},a,m3,1,2,,,,,").lines[0].identification == item


def test_a_row_that_ends_before_its_item_is_named_as_one_without_an_item(tmp_path: Path) -> None:
    with pytest.raises(CostError, match="row 2: has no item; give each line its own"):
        costs(tmp_path, "m3,1,2", head="unit,quantity,rate,item\n")


def test_every_bad_row_is_named_up_to_eight(tmp_path: Path) -> None:
    with pytest.raises(CostError) as caught:
        costs(tmp_path, *(f"{n},a,m3,x,1,,,,," for n in range(12)))
    assert str(caught.value).count("no number") == 8 and "and 4 more" in str(caught.value)


def test_a_cover_of_two_files_counts_each_element_once(tmp_path: Path) -> None:
    ifc = building(tmp_path)
    design = read_design(ifc)
    ids = frozenset(element.global_id for element in design.elements)
    (tmp_path / "more").mkdir()
    found = read_covers([ifc, ifc], [Cover(ifc_class="IfcWall")], ids)
    assert len(found.rows[0].elements) == 2 and replace(found.rows[0]).others == 0


def test_the_table_in_the_docs_prices_the_samples_walls_and_columns_without_a_fault(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    block = (root / "docs/valuation.md").read_text(encoding="utf-8").partition("```csv\n")[2].partition("```")[0]
    (tmp_path / "costs.csv").write_text(block, encoding="utf-8")
    table = read_costs(tmp_path / "costs.csv")
    ifc = root / "sample_models/site/design.ifc"
    plain = read_design(ifc)
    ids = frozenset(element.global_id for element in plain.elements)
    design = with_costs(plain, table, read_covers([ifc], table.covers, ids))
    covered = {line.identification: len(line.elements) for line in design.cost_lines}
    assert covered == {"1.1": 8, "1.2": 6, "1.3": 8, "1.4": 6, "2.1": 12, "3.1": 8}
    volume = sum(e.volume_m3 for e in plain.elements if e.global_id in design.cost_lines[1].elements)
    assert design.cost_lines[1].planned_quantity == pytest.approx(volume, abs=0.01)
    assert Reason.COST_COVERS_NOTHING not in codes(design.notes)


@pytest.mark.parametrize(
    ("unit", "meant"),
    [("m33", "m3"), ("m22", "m2"), ("t", ""), ("h", ""), ("Std", ""), ("psch", ""), ("LF", ""), ("Stkk", "pcs")],
)
def test_a_mistyped_unit_is_told_with_the_one_it_may_mean_and_a_real_one_is_not(unit: str, meant: str) -> None:
    assert meant_unit(unit) == meant


def test_one_unit_has_one_sign_however_it_is_spelt() -> None:
    assert {sign_of(unit) for unit in ("Stk", "St.", "pcs", "nr")} == {"pcs"}
    assert (sign_of("cbm"), sign_of("t"), sign_of("km")) == ("m3", "t", "km")
    assert {sign_of(unit) for unit in ("CY", "Cu. Yd.", "yd³")} == {"cy"}
    assert [sign_of(unit) for unit in ("SFCA", "ft2", "LF", "CSF")] == ["sf", "sf", "lf", "CSF"]


@pytest.mark.parametrize(
    ("unit", "measure", "in_si"),
    [
        ("CY", "volume", 0.764555),
        ("CF", "volume", 0.0283168),
        ("SY", "area", 0.836127),
        ("SF", "area", 0.0929030),
        ("CSF", "area", 9.29030),
        ("LF", "length", 0.3048),
    ],
)
def test_units_of_a_bill_in_feet_and_yards_measure_what_they_say(unit: str, measure: str, in_si: float) -> None:
    assert measure_of(unit) == (measure, pytest.approx(in_si, rel=1e-5))


def test_every_spelling_of_a_currency_is_one_and_an_unknown_one_stays(tmp_path: Path) -> None:
    spelt = {
        "EUR": "€ eur Euro EUR",
        "USD": "$ usd US$",
        "GBP": "£ gbp",
        "CHF": "CHF chf Fr. SFr.",
        "PLN": "pln",
        "kr": "kr",
    }
    for code, texts in spelt.items():
        assert {currency_of(text) for text in texts.split()} == {code}
    table = costs(tmp_path, "1,Walls,m3,1,2,€", head="item,text,unit,quantity,rate,currency\n")
    assert currency_there(table.lines[0].currency, "CHF") == "EUR"


@pytest.mark.parametrize(
    ("written", "number", "currency"),
    [("€ 1.234,50", "1.234,50", "€"), ("$45.00", "45.00", "$"), ("45,00 EUR", "45,00", "EUR"),
     ("CHF 45.-", "45", "CHF"), ("Fr. 45.50", "45.50", "Fr."), ("1\u00a0234,50\u202f€", "1\u00a0234,50", "€"),
     ("-$45.00", "-45.00", "$"),
     ("€-45", "-45", "€"), ("1'234.–", "1'234.00", ""), ("1.234,-- €", "1.234,00", "€"), ("45 sek", "45", "sek"),
     ("US$ 1,234.50", "1,234.50", "US$"), ("45", "45", "")],
)  # fmt: skip
def test_money_is_parted_into_its_number_and_its_currency(written: str, number: str, currency: str) -> None:
    assert parted_money(written) == (number, currency)


@pytest.mark.parametrize(
    "text", ["45 Std", "45 PCS", "45,00 €/m3", "(45.00)", "EUR", "12 kr", "€ 45 EUR", "1" + " " * 200_000 + "€!", ""]
)
def test_what_is_no_money_is_not_parted(text: str) -> None:
    assert parted_money(text) == (text, "")


MONEY = "item;unit;quantity;rate;currency\n"


def test_rates_written_as_money_are_read_and_give_the_tables_currency(tmp_path: Path) -> None:
    table = costs(tmp_path, "1;m3;3,5;€ 1.234,50;", "2;m2;2;45,00 EUR;", "3;m;1;310;", "4;m;1;45,- €;eur", head=MONEY)
    assert [line.rate for line in table.lines] == [1234.5, 45.0, 310.0, 45.0]
    assert {currency_there(line.currency, "CHF") for line in table.lines} == {"EUR"}


def test_rates_written_as_money_in_a_workbook_are_read(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for row in (["item", "unit", "quantity", "rate"], [1, "m3", 1, "CHF 1'234.50"], [2, "m3", 1, "CHF 45.-"]):
        book.active.append(row)  # type: ignore[union-attr]
    book.save(tmp_path / "boq.xlsx")
    assert [(line.rate, line.currency) for line in read_costs(tmp_path / "boq.xlsx").lines] == [
        (1234.5, "CHF"), (45.0, "CHF"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (["1;m3;1;€ 45,00;", "2;m3;1;45,00 $;"], r"row 3: its rate is in \$, that of row 2 in €; write rates without"),
        (["1;m3;1;€ 45,00;USD"], "row 2: its rate is in €, its currency is USD; correct one of them"),
        (["1;m3;1;€ 1.234;"], "row 2, rate: '1.234' could be meant two ways"),
        (["1;m3;1;€ 1.234.-;"], "row 2, rate: '1.234.00' is no number"),
        (["1;m3;€ 45,00;1;"], "row 2, quantity: '€ 45,00' is no number"),
    ],
)
def test_money_that_could_be_misread_is_refused_by_its_row(tmp_path: Path, rows: list[str], reason: str) -> None:
    with pytest.raises(CostError, match=reason):
        costs(tmp_path, *rows, head=MONEY)


def test_a_dollar_is_the_designs_own_and_no_currency_at_all_is_the_designs(tmp_path: Path) -> None:
    table = costs(tmp_path, "1,m3,1,$45.00", "2,m3,1,45.00", head="item,unit,quantity,rate\n")
    for design, told in (("AUD", "AUD"), ("EUR", "USD"), ("", "USD")):
        assert {currency_there(line.currency, design) for line in table.lines} == {told}
    assert currency_there("", "EUR") == "EUR"


def test_a_point_within_money_is_no_decimal_one_for_commas_between_cells_alone(tmp_path: Path) -> None:
    """A Google sheet set to German writes commas between cells, and 1234 euros as `1.234 €`."""
    head = "item,unit,quantity,rate\n"
    for written in ("1.234 €", "CHF 1.234"):
        with pytest.raises(CostError, match=r"row 2, rate: '1\.234' could be meant two ways"):
            costs(tmp_path, f"1,m3,1,{written}", "2,m3,1.5,950 €", head=head)
    assert [line.rate for line in costs(tmp_path, "1,m3,1,1.234 €", "2,m3,1,12.50 €", head=head).lines] == [1.234, 12.5]
    assert costs(tmp_path, "1,m3,1.234,310.505", head=head).lines[0].rate == 310.505


def test_a_dollar_sign_beside_a_rate_is_the_dollar_that_its_row_names(tmp_path: Path) -> None:
    table = costs(tmp_path, "1;m3;1;$45.00;CAD", "2;m3;1;CAD 9;", "3;m3;1;7;", head=MONEY)
    assert [line.currency for line in table.lines] == ["CAD"] * 3
    with pytest.raises(CostError, match=r"row 3: its rate is in \$, that of row 2 in CAD"):
        costs(tmp_path, "1;m3;1;$45.00;CAD", "2;m3;1;$9;", head=MONEY)
