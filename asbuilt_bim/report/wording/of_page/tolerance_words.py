"""In tolerance or not, in words: the limits, and what was found of an element."""

from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.tolerance import PlumbLimit, Tolerance, ToleranceCheck
from asbuilt_bim.report.wording.values import millimetres, plain

UNNAMED = "the project's tolerance"


def name_of(tolerance: Tolerance) -> str:
    """Return a tolerance's name."""
    return plain(tolerance.name).strip() or UNNAMED


def limits_words(tolerance: Tolerance) -> str:
    """Say a tolerance's limits: `25 mm off its design; 15 mm or 1/400 of its height from plumb`."""
    parts = [] if tolerance.offset_m is None else [f"{_mm(tolerance.offset_m)} off its design"]
    plumb = ", ".join(_plumb(row) for row in tolerance.plumb)
    return "; ".join([*parts, *([f"{plumb} from plumb"] if plumb else [])])


def check_words(element: ElementProgress, check: ToleranceCheck) -> str:
    """Say what was found of an element: each deviation with its sigma, beside its limit."""
    parts = []
    if check.offset is not None and check.offset_limit_m is not None:
        off = "offset not measured"
        if element.offset_m is not None:
            off = f"offset {millimetres(element.offset_m, element.offset_sigma_m)}"
        if element.move_m is not None:
            off = "it stands beside its design"
        parts.append(f"{off}, limit {_mm(check.offset_limit_m)}: {check.offset}")
    if check.plumb is not None:
        lean = "plumb not measured"
        if check.lean_m is not None:
            lean = f"top off its foot by {millimetres(check.lean_m, check.lean_sigma_m)}"
        limit = "no limit at its height" if check.plumb_limit_m is None else f"limit {_mm(check.plumb_limit_m)}"
        parts.append(f"{lean}, {limit}: {check.plumb}")
    return "; ".join(parts)


def _plumb(row: PlumbLimit) -> str:
    share = f" or 1/{1.0 / row.height_share:.0f} of its height" if row.height_share > 0.0 else ""
    up_to = "" if row.up_to_m is None else f" (up to {row.up_to_m:g} m)"
    return f"{_mm(row.least_m)}{share}{up_to}"


def _mm(length_m: float) -> str:
    """Write a limit: as many decimals as it has, no sign."""
    return f"{round(length_m * 1000.0, 1):g} mm"
