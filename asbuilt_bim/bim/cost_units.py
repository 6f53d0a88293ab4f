"""Units and currencies of cost lines: how people spell them, and what each measures."""

from difflib import get_close_matches

from asbuilt_bim.bim.model import CostMeasure

UNITS: dict[str, tuple[CostMeasure, float]] = {
    **dict.fromkeys(("m3", "m³", "cbm", "cum", "m^3"), ("volume", 1.0)),
    **dict.fromkeys(("l", "ltr", "dm3", "dm³"), ("volume", 1e-3)),
    **dict.fromkeys(("m2", "m²", "qm", "sqm", "m^2"), ("area", 1.0)),
    **dict.fromkeys(("m", "lm", "lfm", "rm"), ("length", 1.0)),
    "km": ("length", 1000.0),
    "cm": ("length", 0.01),
    "mm": ("length", 0.001),
    **dict.fromkeys(("pcs", "pc", "piece", "pieces", "ea", "each", "no", "nr", "nos"), ("count", 1.0)),
    **dict.fromkeys(("st", "stk", "stck", "stück", "stueck", "u"), ("count", 1.0)),
}
"""What a unit measures, and how many SI units or pieces it is; every other unit is `other`: t, h, lump sum."""
_SIGNS = {"volume": "m3", "area": "m2", "length": "m", "count": "pcs"}
_OTHERS = frozenset(("t", "to", "kg", "h", "hr", "hrs", "std", "d", "psch", "ls", "lsum", "lump sum", "sum", "lot"))
"""Units that are meant as they stand, and measure nothing of a wall."""
_CURRENCIES = {
    **dict.fromkeys(("€", "eur", "euro", "euros"), "EUR"),
    **dict.fromkeys(("$", "us$", "usd"), "USD"),
    **dict.fromkeys(("£", "gbp"), "GBP"),
    **dict.fromkeys(("chf", "fr", "sfr"), "CHF"),
}
_ALIKE = 0.75
"""How much alike two spellings are, as difflib counts: one letter too many or too few in two or three."""


def measure_of(unit: str) -> tuple[CostMeasure, float]:
    """Return what a unit measures, and how many SI units or pieces it is."""
    return UNITS.get(_bare(unit), ("other", 1.0))


def sign_of(unit: str) -> str:
    """Return the one spelling of a unit that measures volume, area, length or number; any other as it is."""
    measure, scale = measure_of(unit)
    return _SIGNS[measure] if measure in _SIGNS and scale == 1.0 else unit


def currency_of(text: str) -> str:
    """Return the one spelling of a currency, `EUR` of `€`, `eur` and `Euro`; one that isn't known as it stands."""
    text = text.strip()
    code = text.upper() if len(text) == 3 and text.isalpha() else text
    return _CURRENCIES.get(_bare(text), code)


def meant_unit(unit: str) -> str:
    """Return the unit that another was perhaps meant to be, "" where none is like it."""
    bare = _bare(unit)
    alike = [] if bare in UNITS or bare in _OTHERS else get_close_matches(bare, UNITS, n=1, cutoff=_ALIKE)
    return sign_of(alike[0]) if alike else ""


def _bare(unit: str) -> str:
    return unit.strip().casefold().rstrip(".")
