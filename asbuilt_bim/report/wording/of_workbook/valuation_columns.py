"""The columns of the workbook's valuation, and what each one means."""

from collections.abc import Sequence

from asbuilt_bim.report.wording.of_page.alike import MOST_NAMED, Alike
from asbuilt_bim.report.wording.of_workbook.columns import Column

ROUNDED = (
    "Quantities are rounded to 3 decimals (6 where the whole line is under 1 of its unit), pieces to whole ones. "
    "Amounts are quantity x rate, rounded to the cent. Halves go up. Sums are sums of the rounded amounts."
)


def _column(heading: str, kind: str, width: float, meaning: str) -> Column:
    return Column(heading=heading, meaning=meaning, kind=kind, width=width)


_INPUT = "Blue: you may overwrite it, and the next workbook carries it on."
BILL = (
    _column("No.", "count", 5, "The line's number in this workbook; Cost by element names it."),
    _column("Item", "text", 9, "Identification in the bill of quantities."),
    _column("Text", "wrap", 27, "The line's text."),
    _column("Unit", "text", 6, "The line's own unit."),
    _column("Contract quantity", "quantity", 11, "As the costs say. What goes beyond it is a variation."),
    _column("Rate", "rate", 9, f"Price of one unit. {_INPUT}"),
    _column("Contract amount", "money", 12, "= contract quantity x rate."),
    _column("Previous quantity", "quantity", 11, f"Certified up to the last signed valuation. {_INPUT}"),
    _column("Previous amount", "money", 12, f"Certified up to the last signed valuation. {_INPUT}"),
    _column("This period quantity", "quantity", 11, "= certified - previous."),
    _column("This period amount", "money", 12, "= certified - previous."),
    _column("Certified quantity", "quantity", 11, f"Up to now, from Cost by element: what is certain. {ROUNDED}"),
    _column("Certified amount", "money", 12, "= certified quantity x rate, to the cent."),
    _column("Remaining quantity", "quantity", 11, "= contract - certified."),
    _column("Remaining amount", "money", 12, "= contract - certified."),
    _column(
        "Best amount",
        "money",
        12,
        "= best quantity x rate, beside it: never what is paid. No sum where one is unknown.",
    ),
    _column(
        "Check",
        "text",
        13,
        "falls: less is certified than before. Look why before you sign. best: how many lines have no best estimate; "
        "then there is no sum of them.",
    ),
    _column(
        "Best quantity", "quantity", 11, "The best estimate by photos alone; unknown where less than half was seen."
    ),
    _column("Possible amount", "money", 12, "What may be earned at most, by photos alone, at this rate."),
    _column("Rate: why, by whom", "text", 24, "Why a person changed the rate. It is carried on with the rate."),
    _column("Contract rate", "rate", 10, "The rate as the costs say it."),
    _column("Sum of elements", "quantity", 12, "What Cost by element brings, not rounded."),
    _column("Coverage", "percent", 10, "Share of the line's elements that photos decide."),
    _column("Elements", "count", 9, "Walls and columns that the line pays for."),
    _column("Not measured", "count", 10, "What else the line pays for: not measured here, and counted as unknown."),
    _column("Bill", "count", 6, "Lines of one cost schedule and currency are one bill, with its own sums."),
    _column("Currency", "text", 9, "Currency of rate and amounts."),
    _column("In pieces", "text", 8, "yes: only whole pieces count."),
    _column(
        "Design quantity",
        "quantity",
        11,
        "What the line's walls and columns have in the design, in its unit; their volume in m3 where that says none.",
    ),
    _column(
        "Contract per design",
        "quantity",
        11,
        "How much of the contract stands for one of the design's. The next valuation is held to it: what the design "
        "loses stays unpaid.",
    ),
    _column("Key", "text", 26, "What the program knows the line by. Leave it as it is."),
)

PARTS_TITLE = (
    "Cost by element. It feeds the bill. Quantity is the element's share of the contract quantity, so it may differ "
    "from its own in the design."
)
COST_PARTS = (
    _column("No.", "count", 5, "The line's number in Bill."),
    _column("Item", "text", 9, "Identification of the line."),
    _column("Element", "text", 26, "A wall or column that the line pays for."),
    _column("Storey", "text", 14, "The element's storey."),
    _column("State", "text", 12, "The element's state, by photos."),
    _column("Unit", "text", 6, "The line's own unit."),
    _column("Quantity", "quantity", 11, "The element's share of the contract quantity, shared out by what the line "
            "measures of each (volume, area, length, number). Where the contract "
            "holds more than the design, so does each share."),
    _column(
        "Certain",
        "percent",
        9,
        "What photos make certain of the element; what was seen from no side counts as not built (of a line that takes "
        "money off as built). One side that is seen built is enough for all sides. Of what is counted in pieces: 100 % "
        "if it was seen complete (not only as far as seen), else 0 %.",
    ),
    _column("Best", "percent", 9, "The best estimate of the element; unknown where less than half was seen."),
    _column("Seen by a person", "percent", 10, "From the observations table, as the person said it. Never mixed in."),
    _column(
        "Override",
        "percent",
        10,
        "Write a percentage here to let it count instead. A piece counts whole or not at all: under 100 % it counts as "
        f"0 % (where the line takes money off, above 0 % as 100 %). {_INPUT}",
    ),
    _column("Reason", "text", 24, "Why you overrode it."),
    _column("By", "text", 12, "Who overrode it."),
    _column("Date", "date", 11, "When."),
    _column("Counts", "percent", 9, "The override; else, where the project says so, what a person saw; else certain."),
    _column("Quantity certified", "quantity", 12, "= quantity x counts, not rounded. Bill adds it up by line."),
    _column("Amount", "money", 12, "= that x rate, to the cent. It adds up to Bill: the row that brings the most of a "
            "line takes what rounding the whole line adds."),
    _column("GlobalId", "text", 26, "The element's GlobalId; empty for what isn't measured here."),
    _column("Cost line", "text", 34, "The line's text."),
    _column("Currency", "text", 9, "Currency of the amount."),
    _column("Before the line", "money", 12, "= quantity certified x rate, to the cent, before the line is rounded."),
    _column("Beside photos", "percent", 10, "What counts of what a person saw, where observations count: the larger of "
            "it and certain; certain where photos of that day or later show less."),
)  # fmt: skip

VARIATIONS = (
    _column("Bill", "count", 5, "Which bill it belongs to (Bill, column Bill)."),
    _column("No.", "text", 8, f"The variation's number, its own. {_INPUT}"),
    _column("Text", "wrap", 34, f"What is done. {_INPUT}"),
    _column("Order", "text", 22, f"Who ordered it, and when. {_INPUT}"),
    _column("Unit", "text", 6, _INPUT),
    _column("Quantity", "quantity", 11, f"Less than 0 for an omission. {_INPUT}"),
    _column("Rate", "rate", 10, _INPUT),
    _column("Amount", "money or blank", 13, "= quantity x rate, to the cent."),
    _column("Done", "percent", 8, f"How much of it is done: a person's word. {_INPUT}"),
    _column("Previous amount", "money or blank", 13, f"Certified up to the last signed valuation. {_INPUT}"),
    _column("This period amount", "money or blank", 13, "= certified - previous."),
    _column("Certified amount", "money or blank", 13, "= amount x done, to the cent."),
    _column("By", "text", 14, f"Who says so. {_INPUT}"),
)

CERTIFICATES = (
    _column("No.", "count", 6, "Number of the valuation."),
    _column("Visit", "date", 11, "The visit that it rests on."),
    _column("Signed on", "date", 11, "When a person signed it in the workbook."),
    _column("Signed by", "text", 20, "Who did."),
    _column("Bill", "count", 6, "Which bill."),
    _column("Currency", "text", 9, "Currency of the amounts."),
    _column("Work", "money", 14, "Certified work of the bill, in all."),
    _column("Variations", "money", 14, "Certified variations, in all."),
    _column("Retention", "money", 14, "Kept back, in all."),
    _column("Tax", "money", 14, "Tax, in all."),
    _column("Net", "money", 14, "= work + variations - retention."),
    _column("Payable", "money", 14, "= net + tax, in all."),
    _column("Paid by this one", "money", 14, "What this valuation added."),
    _column("Run", "text", 25, "When the run was made that it was signed on (UTC)."),
    _column("Signed file", "text", 66, "SHA-256 of the workbook as it was signed."),
)

OBSERVATIONS = (
    _column("Element", "text", 26, "Wall or column."),
    _column("Storey", "text", 14, "Its storey."),
    _column("Date", "date", 11, "When a person looked."),
    _column("Seen", "percent", 9, "What the person saw of it."),
    _column("By", "text", 16, "Who looked."),
    _column("Why", "wrap", 40, "Why the person says so."),
    _column("Certain", "percent", 9, "What photos make certain."),
    _column("Best", "percent", 9, "The best estimate by photos; unknown where less than half was seen."),
    _column("Possible", "percent", 9, "What may be built, by photos."),
    _column("Last seen", "date", 11, "Last visit whose photos decided something on it."),
    _column("Counts", "text", 22, "What the valuation takes of it."),
    _column("GlobalId", "text", 26, "The element's GlobalId."),
)

NOTHING_TO_PRICE = (
    "There are no cost lines, so nothing can be valued.",
    "Why: {why}",
    "What to do:",
    "1. Run `asbuilt-bim template PROJECT.yaml --out FOLDER`. It writes costs.csv with every wall and column.",
    "2. Fill in item, text, unit, quantity and rate, and what each line covers. An .xlsx will do as well.",
    "3. Write `costs: costs.csv` into the project file, and run the project again.",
)
"""What stands in the place of a bill."""
WHY_NOTHING = {
    "ifc2x3": "an IFC2X3 file holds neither quantities nor rates of cost items, and the project file names no costs.",
    "none": "the IFC file has no cost items for walls or columns, and the project file names no costs.",
}
SIGNING_RULES = (
    "Certified is what photos make certain, or what a person put in its place.",
    "One side is enough: where a photo shows it built, the part behind it counts with all its sides, formwork too.",
    "What no photo shows from any side counts for nothing, unless concrete that was seen stands on it.",
    "Best is the best estimate by photos alone, of lines seen to at least half. Nothing is paid by it.",
    ROUNDED,
    "Retention is worked out on what is certified in all, tax on what this valuation adds.",
    "Sign by writing name and date beside Certified by. The next workbook then begins after this valuation.",
)


CHANGED_SINCE = (
    "Bill {number}: somebody changed this workbook since it was made. The sums above hold that; what stands below of "
    "photos and persons doesn't. The next workbook says it anew."
)
"""Stands where one signs as soon as a sum is another than it was."""


def in_doubt_words(one: Alike) -> str:
    """Say what is in doubt of elements that are paid."""
    rest = ". The column Notes on Elements names them all" if len(one.concerns) > MOST_NAMED else ""
    return f"Look before you pay: {one.line}{rest}."


def persons_words(rests: Sequence[str], overrides: int, rates: int, variations: int) -> list[str]:
    """Say how much of a valuation persons set: `rests` says it of each bill where they did."""
    counts = (("percentage", overrides), ("rate", rates), ("variation", variations))
    told = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for name, count in counts if count)
    said = [f"When this workbook was made: of what is certified, {one}." for one in rests]
    if told:
        said.append(f"Set by persons before that, in yellow on their sheets: {told}.")
    return said or ["When this workbook was made no person had changed anything: amounts follow from photos and costs."]
