"""Sentences on where stations stood."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.template import Template, filled
from asbuilt_bim.report.wording.values import odds

_FEW = 3
"""Faces: by fewer alone no station is placed, but beside others of its visit one is."""


def _by_design(note: Note) -> str:
    """Say how well a place is known that the design alone gave, and which place fits second best."""
    text = (
        "Station {subject.name}: placed by the design. {fits:# measured face lies|# measured faces lie} on it there. "
        "Place ± {sigma_m:mm}, direction ± {direction_sigma_rad:°}. "
    )
    if float(str(note.values["fits"])) < _FEW:
        text = text.replace("on it there. ", "on it there, few by themselves: the visit's other stations bear it out. ")
    if "second_away_m" not in note.values:
        return filled(text + "No second place fits", note)
    chance = odds(float(str(note.values["second_chance"])))
    where = "The second best place is {second_away_m:.2f} m away, turned by {second_turned_rad:°}"
    storey = ", on '{second_storey}'" if note.values["second_storey"] else ""
    return filled(f"{text}{where}{storey}. Its chance is {chance}", note)


PLACE_NOTES: Mapping[Reason, Template] = {Reason.PLACED_BY_DESIGN: _by_design}
