"""Tags in the place of a board: each sighting of one is a small board of four corners, with a pose of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from asbuilt_bim.camera.calibration.boards import FLATNESS_M, PRINT_SHARE
from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen

TAG_SIZES_M = 0.02, 3.0
"""A marker of a site: smaller ones aren't seen, and larger ones aren't printed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tag:
    """Tags of one printed size: `size_m` is the side of the black square, the length that the rig's scale hangs on.

    `flatness_m` and `print_share` are as a board's, and common to all tags: they come from one printer.
    """

    kind: ClassVar[str] = "tag"
    size_m: float
    flatness_m: float = FLATNESS_M
    print_share: float = PRINT_SHARE

    def __post_init__(self) -> None:
        low, high = TAG_SIZES_M
        if not low <= self.size_m <= high:
            raise CalibrationError(
                f"tags: a black square of {self.size_m:g} m is no tag's (limit {low:g} to {high:g} m); "
                "give it in metres"
            )

    @property
    def points_m(self) -> FloatArray:
        """Return the corners (4, 3) on the tag: top left, top right, bottom right, bottom left; z = 0, in metres."""
        half = 0.5 * self.size_m
        return frozen([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagSighting:
    """One tag in both photos of a pair: corners (4, 2), (4, 2) in pixels of the ORIGINAL photos, in `Tag`'s order."""

    pair: str
    tag_id: int
    left_px: FloatArray
    right_px: FloatArray

    @property
    def name(self) -> str:
        """Return how a sighting is called: its photos and its tag."""
        return f"{self.pair}: tag {self.tag_id}"


def tag_views(sightings: Sequence[TagSighting], tag: Tag) -> list[BoardView]:
    """Return sightings as an adjustment takes them, one view each."""
    points = tag.points_m
    return [
        BoardView(
            name=one.name, left_points_m=points, left_px=one.left_px, right_points_m=points, right_px=one.right_px
        )
        for one in sightings
    ]
