"""What was chosen by hand in each scene: elements that stand or don't, tags, and roles.

Roles were written down before the program first ran on the scene. `playground`, `surveyed_wall`, `electro` and
`delivery_area` are developed on; a box or a tag of theirs that lay wrongly was moved after a first run. `motorcycle`,
`herz_jesus` and `zed_corridor` were reported. Their photos were looked at for the tags' places alone, and the program
ran on them once, when it was done. Since then `herz_jesus` and `zed_corridor` showed what went wrong, and it was mended
on them: they are developed on, too.

All boxes are pixels of the left photo: left, top, right, bottom. A box is the design's face as it is seen from there.
Where an element stands, its plane comes from the known points in `plane_px`; where none stands, the face is put into
free space at `depth_m`, square to the line of sight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Box = tuple[float, float, float, float]
Shape = Literal["wall", "column", "round"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A wall or column of the design: its face in the left photo, and what truly stands of it."""

    name: str
    box_px: Box
    shape: Shape = "wall"
    plane_px: Box | None = None  # where the known points lie on its face; the round column's front
    depth_m: float = 0.0  # of a face in free space
    thickness_m: float = 0.3
    real_top_px: float | None = None  # where it truly ends, of an element that is built in part
    beside: str = ""  # not built, and in the plane of this element

    @property
    def stands(self) -> bool:
        """Say whether anything of it is built."""
        return self.plane_px is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Print:
    """The middle of a tag or of the disc: on an element's face, or on a stand at a depth, square to the view."""

    at_px: tuple[float, float]
    depth_m: float = 0.0
    on: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """What is put into one scene."""

    role: Literal["develop", "report"]
    elements: tuple[Element, ...]
    tags: tuple[Print, ...]
    tag_m: float
    disc: Print | None = None  # drawn where the photos have colour
    disc_m: float = 0.3
    upright_px: tuple[Box, ...] = ()  # two planes known to be plumb, where the scene doesn't know what is up
    floor_px: Box | None = None  # or a level floor


def _stand(x: float, y: float, depth_m: float) -> Print:
    return Print(at_px=(x, y), depth_m=depth_m)


PLACES: dict[str, Place] = {
    "playground": Place(  # grey; facades and posts, base 60 mm
        role="develop",
        elements=(
            Element(name="facade", box_px=(6, 8, 118, 150), plane_px=(4, 4, 118, 150)),
            Element(name="post", shape="round", box_px=(119, 80, 166, 470), plane_px=(130, 100, 165, 460)),
            Element(name="trunk", shape="round", box_px=(553, 310, 607, 480), plane_px=(560, 320, 600, 480)),
            Element(name="wall on the gravel", box_px=(660, 300, 830, 485), depth_m=3.2),
            Element(name="column in the yard", shape="column", box_px=(425, 260, 475, 480), depth_m=2.4),
        ),
        tags=(_stand(300, 300, 3.0), _stand(456, 330, 3.5), _stand(720, 380, 3.9), _stand(880, 280, 3.0),
              _stand(510, 430, 2.6), _stand(668, 250, 2.2)),
        tag_m=0.30,
    ),
    "surveyed_wall": Place(  # colour; a stone wall at 9.7 m, base 1.2 m, two surveyed targets on it
        role="develop",
        elements=(
            Element(name="wall B", box_px=(505, 150, 760, 880), plane_px=(505, 160, 760, 870), thickness_m=0.5),
            Element(name="wall C", box_px=(770, 30, 1060, 880), plane_px=(770, 160, 1060, 870), thickness_m=0.5,
                    real_top_px=152.0),
            Element(name="wall D", box_px=(1140, 170, 1485, 880), plane_px=(1140, 170, 1485, 870), thickness_m=0.5),
            Element(name="parapet", box_px=(505, 20, 760, 130), beside="wall B", thickness_m=0.5),
            Element(name="wall in front", box_px=(900, 250, 1250, 960), depth_m=6.0, thickness_m=0.25),
        ),
        tags=(Print(at_px=(640, 300), on="wall B"), Print(at_px=(1430, 400), on="wall D"),
              Print(at_px=(600, 800), on="wall B"), Print(at_px=(1090, 520), on="wall C"), _stand(700, 900, 7.5),
              _stand(1330, 900, 7.5)),
        tag_m=0.30,
        disc=_stand(850, 905, 7.5),
    ),
    "electro": Place(  # grey; cast concrete behind a scaffold, base 60 mm, numbers of the same rig elsewhere
        role="develop",
        elements=(
            Element(name="concrete wall", box_px=(178, 5, 335, 455), plane_px=(165, 5, 335, 455)),
            Element(name="concrete pillar", box_px=(862, 60, 915, 440), plane_px=(862, 60, 920, 440)),
            Element(name="infill of the doorway", box_px=(560, 110, 665, 400), depth_m=3.5, thickness_m=0.2),
            Element(name="column in the yard", shape="column", box_px=(725, 150, 795, 480), depth_m=2.2),
        ),
        tags=(_stand(70, 300, 3.3), _stand(70, 70, 3.0), _stand(610, 430, 2.6), _stand(740, 300, 3.0),
              _stand(430, 400, 2.3), _stand(876, 430, 2.7)),
        tag_m=0.25,
    ),
    "delivery_area": Place(  # grey and dark; wooden crates in a hall, base 60 mm, numbers of the same rig elsewhere
        role="develop",
        elements=(
            Element(name="crates, front", box_px=(505, 265, 712, 480), plane_px=(505, 262, 712, 480), thickness_m=0.1),
            Element(name="crates, side", box_px=(426, 290, 478, 410), plane_px=(424, 275, 480, 420), thickness_m=0.1),
            Element(name="column in the hall", shape="column", box_px=(205, 150, 265, 480), depth_m=2.5),
            Element(name="wall before the shelves", box_px=(760, 120, 900, 470), depth_m=3.0),
        ),
        tags=(_stand(120, 120, 3.5), _stand(296, 425, 2.1), _stand(320, 110, 3.0), _stand(620, 180, 2.3),
              _stand(840, 300, 3.4), _stand(120, 420, 2.6)),
        tag_m=0.25,
        upright_px=((505, 262, 712, 480), (424, 275, 480, 420)),
    ),
    "motorcycle": Place(  # colour; a garage at 2 to 4.6 m, base 193 mm
        role="report",
        elements=(
            Element(name="door", box_px=(182, 4, 288, 100), plane_px=(182, 4, 288, 100), thickness_m=0.1),
            Element(name="timber wall", box_px=(5, 4, 155, 88), plane_px=(5, 4, 155, 88)),
            Element(name="column left", shape="column", box_px=(85, 60, 185, 445), depth_m=1.9),
            Element(name="wall before the bike", box_px=(330, 20, 560, 470), depth_m=1.7),
        ),
        tags=(_stand(98, 115, 3.0), _stand(240, 124, 3.0), _stand(640, 230, 3.1), _stand(660, 420, 1.9),
              _stand(430, 60, 3.0), _stand(150, 435, 2.0)),
        tag_m=0.15,
        disc=_stand(330, 60, 3.0),
        disc_m=0.2,
        floor_px=(0, 380, 500, 490),
    ),
    "herz_jesus": Place(  # colour; a church's stone facade, base 1.6 m at half its size
        role="develop",
        elements=(
            Element(name="left of the portal", box_px=(300, 60, 425, 740), plane_px=(300, 60, 425, 740)),
            Element(name="right of the portal", box_px=(1005, 75, 1098, 740), plane_px=(1005, 75, 1098, 740)),
            Element(name="left of the statue", box_px=(445, 60, 625, 235), plane_px=(445, 60, 625, 235)),
            Element(name="right of the statue", box_px=(830, 75, 995, 260), plane_px=(830, 75, 995, 260)),
            Element(name="column before the steps", shape="column", box_px=(560, 420, 640, 900), depth_m=5.0),
            Element(name="wall before the right portal", box_px=(1120, 250, 1240, 880), depth_m=5.5),
        ),
        tags=(Print(at_px=(340, 600), on="left of the portal"), Print(at_px=(1050, 300), on="right of the portal"),
              Print(at_px=(350, 180), on="left of the portal"), Print(at_px=(915, 150), on="right of the statue"),
              _stand(720, 850, 5.5), _stand(1290, 840, 6.0)),
        tag_m=0.30,
        disc=_stand(470, 860, 6.0),
    ),
    "zed_corridor": Place(  # colour; painted walls of a corridor, base 120 mm
        role="develop",
        elements=(
            Element(name="right wall", box_px=(790, 160, 1060, 500), plane_px=(790, 200, 1060, 560)),
            Element(name="left wall", box_px=(105, 60, 335, 290), plane_px=(100, 50, 340, 300)),
            Element(name="column in the corridor", shape="column", box_px=(540, 150, 600, 555), depth_m=3.0),
            Element(name="wall in the corridor", box_px=(680, 150, 765, 535), depth_m=3.0),
        ),
        tags=(_stand(460, 480, 2.5), _stand(500, 120, 2.5), _stand(720, 610, 2.0), _stand(640, 110, 2.6),
              _stand(860, 640, 1.7), _stand(400, 340, 2.2)),
        tag_m=0.15,
        disc=_stand(560, 600, 2.2),
        disc_m=0.2,
    ),
}  # fmt: skip
