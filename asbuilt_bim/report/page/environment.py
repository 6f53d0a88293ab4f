"""The pages' templates: everything escaped, nothing undefined."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from asbuilt_bim.report.tables import measured_words, program_words
from asbuilt_bim.report.wording import completion
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page import tolerance_words
from asbuilt_bim.report.wording.of_page.class_words import class_word
from asbuilt_bim.report.wording.of_page.fault_words import NOT_CLEAR, WRONG_BEFORE
from asbuilt_bim.report.wording.of_page.gantt_words import earned_words, trend_words
from asbuilt_bim.report.wording.of_page.next_words import COMES_UP, ONE_FOR_EACH
from asbuilt_bim.report.wording.of_page.picture_words import BLURRED_WORDS, picture_words

TEMPLATES = Path(__file__).parent / "templates"


@cache
def environment() -> Environment:
    """Make the template environment with the report's words as filters: once, since its templates are compiled."""
    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=wording.shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters: dict[str, Callable[..., str]] = {
        "percent": wording.percent,
        "percent_certain": wording.percent_certain,
        "number": wording.number,
        "rate": wording.rate,
        "quantity": wording.quantity,
        "area": wording.area,
        "metres": wording.length,
        "millimetres": wording.millimetres,
        "plumb": wording.millimetres_per_metre,
        "day": wording.day,
        "unit": wording.unit_sign,
        "plain": wording.plain,
        "words": note_words,
        "at_least": completion.at_least,
        "possibly": completion.possibly,
        "at_most": completion.at_most,
        "best": completion.best_words,
        "seen": completion.seen_words,
        "in_words": completion.in_words,
        "class_word": class_word,
        "counts": completion.count_words,
        "area_of": wording.area_of,
        "tolerance_name": tolerance_words.name_of,
        "tolerance_limits": tolerance_words.limits_words,
    }
    made.filters.update(filters)
    made.globals.update(check_words=tolerance_words.check_words)
    made.globals.update(trend_words=trend_words, earned_words=earned_words)
    made.globals.update(picture_words=picture_words, blurred_words=BLURRED_WORDS, one_for_each=ONE_FOR_EACH)
    made.globals.update(comes_up_words=COMES_UP)
    made.globals.update(not_clear=NOT_CLEAR, wrong_before=WRONG_BEFORE)
    made.globals.update(measured_words=measured_words, program_words=program_words)
    return made
