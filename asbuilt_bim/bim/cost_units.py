"""Units and currencies of cost lines: how people spell them, and what each measures."""

import re
from difflib import get_close_matches

from asbuilt_bim.bim.model import CostMeasure

_FOOT, _YARD = 0.3048, 0.9144
UNITS: dict[str, tuple[CostMeasure, float]] = {
    **dict.fromkeys(("m3", "m³", "cbm", "cum", "m^3"), ("volume", 1.0)),
    **dict.fromkeys(("l", "ltr", "dm3", "dm³"), ("volume", 1e-3)),
    **dict.fromkeys(("cy", "c.y", "cyd", "cuyd", "cu yd", "cu. yd", "yd3", "yd³", "yd^3"), ("volume", _YARD**3)),
    **dict.fromkeys(("cf", "c.f", "cft", "cuft", "cu ft", "cu. ft", "ft3", "ft³", "ft^3"), ("volume", _FOOT**3)),
    **dict.fromkeys(("m2", "m²", "qm", "sqm", "m^2"), ("area", 1.0)),
    **dict.fromkeys(("sy", "s.y", "syd", "sqyd", "sq yd", "sq. yd", "yd2", "yd²", "yd^2"), ("area", _YARD**2)),
    **dict.fromkeys(("sf", "s.f", "sft", "sqft", "sq ft", "sq. ft", "ft2", "ft²", "ft^2", "sfca"), ("area", _FOOT**2)),
    "csf": ("area", 100.0 * _FOOT**2),
    **dict.fromkeys(("m", "lm", "lfm", "rm"), ("length", 1.0)),
    **dict.fromkeys(("lf", "l.f", "lft", "lin ft", "lin. ft", "vlf", "ft"), ("length", _FOOT)),
    "km": ("length", 1000.0),
    "cm": ("length", 0.01),
    "mm": ("length", 0.001),
    **dict.fromkeys(("pcs", "pc", "piece", "pieces", "ea", "each", "no", "nr", "nos"), ("count", 1.0)),
    **dict.fromkeys(("st", "stk", "stck", "stück", "stueck", "u"), ("count", 1.0)),
}
"""What a unit measures, and how many SI units or pieces it is; every other unit is `other`: t, h, lump sum."""
_SIGNS = {UNITS[sign]: sign for sign in ("m3", "cy", "cf", "m2", "sy", "sf", "m", "lf", "pcs")}
_OTHERS = frozenset(("t", "to", "kg", "h", "hr", "hrs", "std", "d", "psch", "ls", "lsum", "lump sum", "sum", "lot"))
"""Units that are meant as they stand, and measure nothing of a wall."""
_CURRENCIES = {
    **dict.fromkeys(("€", "eur", "euro", "euros"), "EUR"),
    **dict.fromkeys(("$", "us$", "usd"), "USD"),
    **dict.fromkeys(("£", "gbp"), "GBP"),
    **dict.fromkeys(("chf", "fr", "sfr"), "CHF"),
}
_DOLLARS = frozenset(("AUD", "CAD", "HKD", "NZD", "SGD", "USD"))
_CODES = _DOLLARS | {
    "AED", "BGN", "BRL", "CNY", "CZK", "DKK", "HUF", "ILS", "INR", "ISK", "JPY", "KRW", "MXN", "NOK", "PLN", "RON",
    "RSD", "SAR", "SEK", "THB", "TRY", "UAH", "ZAR",
}  # fmt: skip
"""ISO 4217: those that stand beside a rate. No unit of a bill is written like one of them, as `STD` and `PCS` are."""
_LONGEST = 40
"""Letters of an amount: what is longer is none, and would be looked at for minutes."""
_WORD = r"US\$|[€$£]|[A-Za-z]{2,5}\.?"
_NUMBER = r"[-+]?\d[^A-Za-z€$£]*"
_BEFORE = re.compile(rf"(?P<sign>[-+]?)\s*(?P<word>{_WORD})\s*(?P<number>{_NUMBER})")
_BEHIND = re.compile(rf"(?P<sign>)(?P<number>{_NUMBER}?)\s*(?P<word>{_WORD})")
_WHOLE = re.compile(r"([-+]?\d+)[.,][-–—]{1,2}")
_DASH = re.compile(r"(?<=\d[.,])[-–—]{1,2}$")
_ALIKE = 0.75
"""How much alike two spellings are, as difflib counts: one letter too many or too few in two or three."""


def measure_of(unit: str) -> tuple[CostMeasure, float]:
    """Return what a unit measures, and how many SI units or pieces it is."""
    return UNITS.get(_bare(unit), ("other", 1.0))


def sign_of(unit: str) -> str:
    """Return the one spelling of a unit that bills are written in, `cy` of `cu. yd.`; any other as it is."""
    return _SIGNS.get(measure_of(unit), unit)


def currency_of(text: str) -> str:
    """Return the one spelling of a currency, `EUR` of `€`, `eur` and `Euro`; one that isn't known as it stands."""
    text = text.strip()
    code = text.upper() if len(text) == 3 and text.isalpha() else text
    return _CURRENCIES.get(_bare(text), code)


def currency_there(text: str, design: str) -> str:
    """Return the one spelling of a currency, the design's own where nothing is said; `$` is the design's own dollar."""
    text = text.strip()
    return design if not text or (text == "$" and design in _DOLLARS) else currency_of(text)


def parted_money(text: str) -> tuple[str, str]:
    """Return the number in `€ 1.234,50`, `$45.00`, `45,00 EUR` or `CHF 45.-`, and the currency as it stands there.

    The number is as it was written, a dash for no cents as zeros. What isn't money comes back as it is, without one.
    """
    text, word = text.strip(), ""
    if len(text) > _LONGEST:
        return text, word
    found = _BEFORE.fullmatch(text) or _BEHIND.fullmatch(text)
    if found and (_bare(found["word"]) in _CURRENCIES or found["word"].upper() in _CODES):
        text, word = found["sign"] + found["number"], found["word"]
    if whole := _WHOLE.fullmatch(text):
        return whole[1], word
    return _DASH.sub("00", text), word


def meant_unit(unit: str) -> str:
    """Return the unit that another was perhaps meant to be, "" where none is like it."""
    bare = _bare(unit)
    alike = [] if bare in UNITS or bare in _OTHERS else get_close_matches(bare, UNITS, n=1, cutoff=_ALIKE)
    return sign_of(alike[0]) if alike else ""


def _bare(unit: str) -> str:
    return unit.strip().casefold().rstrip(".")
