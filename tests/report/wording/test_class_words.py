from __future__ import annotations

import pytest

from asbuilt_bim.report.wording.of_page.class_words import class_word, class_words


@pytest.mark.parametrize(
    ("ifc_class", "one", "several"),
    [
        ("IfcColumn", "Column", "Columns"),
        ("IfcWallStandardCase", "Wall", "Walls"),
        ("IfcCurtainWall", "Curtain wall", "Curtain walls"),
        ("IfcBuildingElementProxy", "Other element", "Other elements"),
        ("IfcStairs", "Stairs", "Stairs"),
    ],
)
def test_a_class_is_called_as_on_site(ifc_class: str, one: str, several: str) -> None:
    assert (class_word(ifc_class), class_words(ifc_class)) == (one, several)
