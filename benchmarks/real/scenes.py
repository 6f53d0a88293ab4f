"""The real scenes that measuring is judged on: which were developed on, and which are reported, said beforehand.

A reporting scene is run once, at the end, and its photos aren't opened before. Of a rig at rest the frames are split:
a scene's later frames show other noise, and much the same things. So they show a sigma's size, not a new place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from asbuilt_bim.camera.rig_formats.reader import read_rig
from benchmarks.real.shots import (
    Shot,
    by_refined_rig,
    middlebury_shot,
    oak_rig,
    photos_of,
    rectified_rig,
    size_of,
    video_photos,
    zed_rig,
)
from benchmarks.sites import DATA

STEREO = DATA / "stereo"
Role = Literal["develop", "report"]
Truth = Literal["laser", "structured light", ""]

WIDE_F_PX, WIDE_BASELINE_M, WIDE_CENTRE_PX = 542.0, 0.0596, (541.8, 255.2)
"""Of ETH3D's wide rig, as its playground has them; the pairs without calib.txt are by the same rig."""
NARROW_F_PX, NARROW_BASELINE_M = 711.5, 0.0599


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A place that one rig saw, once or at rest many times: `shots` reads its pairs."""

    name: str
    role: Role
    folder: Path
    shots: Callable[[], list[Shot]]
    truth: Truth = ""
    at_rest: bool = False  # the rig stood still: what is measured may scatter by its sigma only
    faces: bool = True  # something in it stands upright, so that the program has faces to measure

    @property
    def here(self) -> bool:
        """Say whether its photos are in the data folder."""
        return self.folder.is_dir()


def _truth(folder: str, file: str) -> Callable[[], list[Shot]]:
    return lambda: [middlebury_shot(STEREO / folder, file)]


def wide_shot(name: str) -> Shot:
    """Read a pair of ETH3D's wide rig, which came without calib.txt."""
    folder = STEREO / "eth3d_pairs" / name
    photos = photos_of(name, folder / "im0.png", folder / "im1.png")
    rig = rectified_rig(WIDE_F_PX, WIDE_CENTRE_PX, WIDE_BASELINE_M, size_of(photos.left))
    return Shot(photos=photos, rig=rig)


def _wide(name: str) -> Callable[[], list[Shot]]:
    return lambda: [wide_shot(name)]


def _euroc(chosen: slice) -> Callable[[], list[Shot]]:
    def shots() -> list[Shot]:
        folder = STEREO / "euroc"
        rig = read_rig(folder / "LeftCameraParams.yaml", folder / "RightCameraParams.yaml")
        lefts = sorted((folder / "pairs/cam0").glob("*.png"))[chosen]
        pairs = [photos_of(f"pair {k}", left, folder / "pairs/cam1" / left.name) for k, left in enumerate(lefts)]
        return [Shot(photos=one, rig=rig) for one in pairs]

    return shots


def _hall() -> list[Shot]:
    folder = STEREO / "euroc/machine_hall"
    rig = read_rig(folder / "sensorLeft.yaml", folder / "sensorRight.yaml")
    return [
        Shot(photos=photos_of(f"hall {k}", folder / f"left_img_{k}.png", folder / f"right_img_{k}.png"), rig=rig)
        for k in (0, 1)
    ]


def _zed(distances: tuple[int, ...]) -> Callable[[], list[Shot]]:
    """Read the corridor's raw pairs: the factory's numbers leave the rows 1.4 px apart, so the rig is refined."""

    def shots() -> list[Shot]:
        folder, start = STEREO / "zed_corridor/indoor_720", "INDOOR-ZED-720"
        pairs = [
            photos_of(f"{m} m", folder / f"{start}-L1-UNREC-{m:02d}.png", folder / f"{start}-R1-UNREC-{m:02d}.png")
            for m in distances
        ]
        return by_refined_rig(pairs, zed_rig(STEREO / "zed_corridor/SN21531_from_m.conf"))

    return shots


def _oak(frames: range) -> Callable[[], list[Shot]]:
    def shots() -> list[Shot]:
        folder = STEREO / "oak_terrace"
        rig = oak_rig(folder / "calib.json")
        return [Shot(photos=one, rig=rig) for one in video_photos(folder / "left.mp4", folder / "right.mp4", frames)]

    return shots


def _scene(name: str, role: Role, folder: str, shots: Callable[[], list[Shot]], **more: object) -> Scene:
    return Scene(name=name, role=role, folder=STEREO / folder, shots=shots, **more)  # type: ignore[arg-type]


SCENES = (
    _scene("playground", "develop", "eth3d_playground", _truth("eth3d_playground", "disp0.pfm"), truth="laser"),
    _scene("delivery area 1", "develop", "eth3d_pairs/delivery_area_1l", _wide("delivery_area_1l")),
    _scene("delivery area 2", "develop", "eth3d_pairs/delivery_area_2l", _wide("delivery_area_2l")),
    _scene("corridor, 5 to 15 m", "develop", "zed_corridor/indoor_720", _zed((5, 10, 15)), at_rest=True),
    _scene("room, first half", "develop", "euroc/pairs", _euroc(slice(0, 12)), at_rest=True),
    # the first 50 frames are still finding their exposure
    _scene("terrace, to 299", "develop", "oak_terrace", _oak(range(50, 300, 5)), at_rest=True, faces=False),
    _scene("motorcycle", "report", "middlebury_motorcycle", _truth("middlebury_motorcycle", "disp0GT.pfm"),
           truth="structured light"),
    _scene("electro", "report", "eth3d_pairs/electro_1l", _wide("electro_1l")),
    _scene("terrains", "report", "eth3d_pairs/terrains_1l", _wide("terrains_1l")),
    _scene("corridor, 20 to 30 m", "report", "zed_corridor/indoor_720", _zed((20, 25, 30))),
    _scene("corridor, all six", "report", "zed_corridor/indoor_720", _zed((5, 10, 15, 20, 25, 30)), at_rest=True,
           faces=False),  # three of them were developed on: six are asked for, and there are no more
    # from its 14th pair on the rig drifts, by 1.4 px in all
    _scene("room, second half", "report", "euroc/pairs", _euroc(slice(12, 24)), at_rest=True),
    _scene("machine hall", "report", "euroc/machine_hall", _hall),
    _scene("terrace, from 300", "report", "oak_terrace", _oak(range(300, 600, 6)), at_rest=True, faces=False),
)  # fmt: skip
"""terrace_1s, forest_1s, playground_1s and _2l are left: no camera of the other kind beside them, or no wall."""

TWO_CAMERAS: tuple[tuple[str, Role], ...] = (
    ("delivery_area_1", "develop"),
    ("electro_1", "report"),
    ("terrains_1", "report"),
)
"""Scenes of ETH3D that the wide and the narrow rig saw at once: `NAME`l and `NAME`s."""


def chosen(roles: str) -> list[Scene]:
    """Return the scenes of a role, `develop` or `report`, or `all`."""
    return [scene for scene in SCENES if roles in ("all", scene.role)]
