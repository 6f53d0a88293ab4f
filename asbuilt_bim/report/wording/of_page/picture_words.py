"""What the page says of its pictures: what they show, and whether people can be known by them."""

from typing import Literal

_SHOWN = {
    "elements": "Pictures are sharp where elements were seen, standing or missing, and where something was measured; "
    "all else is blurred.",
    "whole": "Pictures show whole photos, as the project file asks.",
}
_PEOPLE = {
    True: "A network looks for people and blurs those that it finds. Look for those that it missed.",
    False: "No network looks for people: who stands before an element can be recognised.",
    None: "Whether people were looked for isn't recorded.",
}


def picture_words(pictures: Literal["elements", "whole"], people_sought: bool | None) -> str:
    """Say what pictures show, and what was done about people."""
    return f"{_SHOWN[pictures]} {_PEOPLE[people_sought]}"
