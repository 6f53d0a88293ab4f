"""Sentences on costs tables, on what persons saw, and on the valuation."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.template import Template, filled
from asbuilt_bim.report.wording.values import number, percent, percent_to_a_tenth, rate, share_of_money

_ITEM = "cost item {item}: "


def _covers_nothing(note: Note) -> str:
    nothing = f"{_ITEM}it covers nothing: "
    until = ". Nothing of it is certified until a person says how much"
    if not note.values["said"]:
        return filled(f"{nothing}the table says no element for it{until}", note)
    if "column" not in note.values:
        return filled(f"{nothing}no element is all that it says{until}", note)
    meant = ". Did you mean '{meant}'?" if note.values["meant"] else "."
    there = " There is: {known:list}{more}" if note.values["known"] else " The IFC file names none"
    text = f"{nothing}no wall or column has the {{column}} '{{written}}'{meant}{there}"
    return filled(text + until, note)


def _unit_unknown(note: Note) -> str:
    text = f"{_ITEM}its unit '{{unit}}' is no volume, area, length or number: it is shared out by the elements' volume"
    return filled(text + (". Did you mean {meant}?" if note.values.get("meant") else ""), note)


def _falls(note: Note) -> str:
    return filled(f"{{item}}: the certified amount falls {_was_now(note)}. Look why before you sign", note)


def _gone(note: Note) -> str:
    falls = f"Its amount falls {_was_now(note)}"
    if note.values.get("replaced_by"):  # a result of before has no such value
        text = "{item} ({unit}) was certified before. Its number stands for other work now: {replaced_by}. "
        return filled(text, note) + falls
    return filled("{item} was certified before, and is no longer in the costs. ", note) + falls


def _quantity(note: Note, key: str) -> str:
    """Write a quantity with as many decimals as its size asks for."""
    value = float(str(note.values[key]))
    decimals = 0 if value == round(value) or abs(value) >= 100.0 else 2 if abs(value) >= 1.0 else 6
    return number(value, decimals)


def _off(note: Note) -> str:
    contract, design = _quantity(note, "contract"), _quantity(note, "design")
    return filled(
        f"{{item}}: contract {contract} {{unit}}, design about {design} {{unit}}. What photos show is paid as its part "
        "of the contract quantity, so check quantity and unit, and what the line covers",
        note,
    )


def lost_words(count: int, uncovered: int) -> str:
    """Say why elements don't stand in their line any more: `uncovered` of the `count` are still in the design."""
    if count and not uncovered:
        return "no longer in the design"
    covered = "covered by this cost line"
    return f"no longer {covered}" if count and count == uncovered else f"no longer in the design, or not {covered}"


def _lost(note: Note) -> str:
    why = lost_words(*(int(str(note.values.get(key, 0))) for key in ("count", "uncovered")))
    named = f" ({filled('{elements:list}{more}', note)})" if note.values["elements"] else ""
    amount, lost = number(float(str(note.values["amount"]))), _quantity(note, "quantity")
    return filled(
        f"{{item}}: {lost} {{unit}} of its contract, {amount} {{currency}}, stood for what is {why}"
        f"{named}. It stays unpaid, in a row of its own. Override that row for what stands, or correct the costs",
        note,
    )


def _added(note: Note) -> str:
    amount = number(float(str(note.values["amount"])))
    return filled(
        f"{{item}}: the design has {_quantity(note, 'quantity')} {{unit}}, {amount} {{currency}}, that its contract "
        "quantity has no room for ({elements:list}{more}: new or larger since it was signed). Nothing of that is "
        "certified: order it as a variation, or raise the contract quantity",
        note,
    )


def _changed(note: Note) -> str:
    values = note.values
    told = ["text was '{text_was}'"] if "text_was" in values else []
    if "rate_was" in values:
        told.append(f"rate {rate(float(str(values['rate_was'])))}, now {rate(float(str(values['rate'])))}")
    if "contract_was" in values:
        told.append(f"contract quantity {_quantity(note, 'contract_was')}, now {_quantity(note, 'contract')} {{unit}}")
    return filled(
        f"{{item}} is otherwise than when it was signed: {', '.join(told)}. All that is certified of it follows what "
        "it says now",
        note,
    )


def _was_now(note: Note) -> str:
    was, now = (number(float(str(note.values[key]))) for key in ("was", "now"))
    return f"from {was} to {now} {note.values['currency']}".rstrip()


def kept_words(note: Note) -> str:
    """Say how much more or less is kept back of what was certified before, by another retention."""
    amount, currency = float(str(note.values["amount"])), note.values["currency"]
    more = "more is kept back" if amount > 0.0 else "less is kept back, so it is paid out now,"
    return f"{number(abs(amount))} {currency}".strip() + f" {more} of what was earned before"


def _retention(note: Note) -> str:
    was, now = (share_of_money(float(str(note.values[key]))) for key in ("was", "now"))
    return f"retention {was} -> {now}: {kept_words(note)}"


def _tax(note: Note) -> str:
    was, now = (share_of_money(float(str(note.values[key]))) for key in ("was", "now"))
    return (
        f"tax {was} -> {now}: it is on what this valuation adds. The tax on what was certified before stays as it was"
    )


def _rate(note: Note) -> str:
    was, now = (rate(float(str(note.values[key]))) for key in ("was", "now"))
    why = note.values["why"]
    return filled(
        f"{_ITEM}a person set its rate to {now}; the costs say {was} ({why or 'nobody wrote why, and by whom'})", note
    )


def _rate_unused(note: Note) -> str:
    set_to, why = rate(float(str(note.values["now"]))), note.values["why"]
    text = f"the workbook's rate {set_to} of {{subject.name}} has nothing to stand for any more"
    return filled(text + (" ({why})" if why else "") + ". The costs' own rate counts", note)


def _contradicts(note: Note) -> str:
    values = note.values
    lower, upper = (percent(float(str(values[key]))) for key in ("lower", "upper"))
    seen, counted = (percent_to_a_tenth(float(str(values[key]))) for key in ("share", "counted"))
    return filled(
        f"{{element:name}} ({{subject.name}}): {{by}} saw {seen} on {{day}}, photos say {lower} to {upper}. Where "
        f"observations count, {counted} does",
        note,
    )


def _unreadable(note: Note) -> str:
    text = (
        "last workbook, {subject.name}: the override is the text '{written}' and no number, and was left out. Give the "
        "cell the number format of a percentage, and type it as 50 %"
    )
    try:
        share = float(str(note.values["written"]))
    except ValueError:
        return filled(text, note)
    reads = f"last workbook, {{subject.name}}: the override reads {100.0 * share:g} %, and was left out. "
    return filled(f"{reads}Write one from 0 % to 100 %", note)


def _unsigned(note: Note) -> str:
    where = "{element}" if note.values["element"] else "what isn't measured"
    return filled(f"{_ITEM}the override of {where} lacks its reason, person or date. It counts all the same", note)


def _not_whole(note: Note) -> str:
    share, counted = (percent_to_a_tenth(float(str(note.values[key]))) for key in ("share", "counted"))
    of = "{element}" if note.values["element"] else "what isn't measured"
    return filled(
        f"{_ITEM}the override of {of} is {share}, and counts as {counted}: a piece counts whole or not at all. Write "
        "0 % or 100 %",
        note,
    )


VALUATION_NOTES: Mapping[Reason, Template] = {
    Reason.COSTS_INSTEAD: "the table {subject.name} counts; the IFC file's own "
    "{count:# cost line doesn't|# cost lines don't}",
    Reason.COSTS_FORMULAS: "{subject.name} holds formulas: what they gave when it was last saved counts",
    Reason.COST_COVERS_NOTHING: _covers_nothing,
    Reason.COST_COVER_UNKNOWN: f"{_ITEM}not in the IFC file: {{elements:list}}{{more}}",
    Reason.COST_UNIT_UNKNOWN: _unit_unknown,
    Reason.ACCEPT_MOVED_UNKNOWN: "accept_moved in the project file: no wall or column has the GlobalId "
    "{elements:quoted}{more}",
    Reason.OBSERVATION_UNKNOWN: "{subject.name} names {elements:quoted}{more}: no wall or column has that "
    "GlobalId, or alone that name. Write the GlobalId that the IFC file has",
    Reason.OBSERVATION_CONTRADICTS: _contradicts,
    Reason.OBSERVATION_SHOWN: "{count:# observation of a person stands|# observations of persons stand} beside the "
    "photos and doesn't count. To let them count, set valuation.observations to count",
    Reason.OBSERVATION_LATER: "persons saw this after the visit of {subject.name}, so it doesn't count yet: "
    "{elements:list}{more}. It counts from the first visit of that day or later on. To let it count now, write an "
    "override",
    Reason.CERTIFIED_FALLS: _falls,
    Reason.CERTIFIED_LINE_GONE: _gone,
    Reason.CERTIFIED_LINE_CHANGED: _changed,
    Reason.CONTRACT_NOT_DESIGN: _off,
    Reason.DESIGN_LOST_WORK: _lost,
    Reason.DESIGN_ADDED_WORK: _added,
    Reason.OVERRIDE_UNUSED: "the workbook's override of {element:name} for {subject.name} ({share:%}, {by:name}) has "
    "nothing to stand for any more",
    Reason.TERMS_KEPT: "retention and tax are the last workbook's, {retention:%} and {tax:%}. The project file says "
    "{project_retention:%} and {project_tax:%}: change them on the sheet Valuation",
    Reason.RETENTION_CHANGED: _retention,
    Reason.TAX_CHANGED: _tax,
    Reason.OVERRIDE_UNSIGNED: _unsigned,
    Reason.OVERRIDE_NOT_WHOLE: _not_whole,
    Reason.OVERRIDE_UNREADABLE: _unreadable,
    Reason.RATE_CHANGED: _rate,
    Reason.RATE_UNUSED: _rate_unused,
    Reason.RATE_UNREADABLE: "last workbook, {subject.name}: the rate '{written}' is no number; the costs' own counts",
    Reason.VARIATION_UNREADABLE: "last workbook, {subject.name}: bill, quantity, rate and share done must be numbers "
    "and no text, the share one from 0 to 100 %. It is worth nothing until then",
    Reason.CERTIFICATE_LATER: "valuation {number} was signed on the visit of {visit}, after this one",
}
