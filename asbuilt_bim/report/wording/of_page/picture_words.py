"""What the page says of its pictures: what they show, and whether people can be known by them."""

from typing import Literal

_SHOWN = {
    "elements": "Pictures are sharp where something was measured. Where an element is missing, or was judged without "
    "being measured, they are coarse. All else is blurred, and so is what stands before what was measured.",
    "whole": "Pictures show whole photos, as somebody asked.",
}
_PEOPLE = {
    True: "A network looks for people and blurs those that it finds. Look for those that it missed.",
    False: "No network looks for people. Who leans on an element can be recognised.",
    None: "Whether people were looked for isn't recorded.",
}
_WHOLE_UNSOUGHT = "No network looks for people: who is in a photo can be recognised."
BLURRED_WORDS = (
    "Dashed: nothing was measured there, so the picture is coarse or blurred. The photo itself is sharp. So is the "
    "page that asbuilt-bim report FOLDER --whole-photos makes."
)
"""Beside a picture of a place where something should stand."""


def picture_words(pictures: Literal["elements", "whole"], people_sought: bool | None, outlined: int = 0) -> str:
    """Say what pictures show, and what was done about people, of whom so many were `outlined` by hand."""
    people = _WHOLE_UNSOUGHT if pictures == "whole" and people_sought is False else _PEOPLE[people_sought]
    given = f" What {'an outline' if outlined == 1 else f'{outlined} outlines'} given by hand held is blurred."
    return f"{_SHOWN[pictures]} {people}{given if outlined else ''}"
