"""A real room by its tags alone: 39 photos once round it, three as anchors, and how far the loop fails to close.

The tags' size is unknown, so the scale is free: lengths are in sides of a tag. To test the loop it is cut open: tags
that the first photos show, and the last ones again, get other numbers there, and must come out in the same places.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.register.block_adjustment import CommonNoise
from asbuilt_bim.register.growth import Viewpoint
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.tags import guesses
from asbuilt_bim.register.visit import Sources, place_visit
from asbuilt_bim.vision.markers.find import MarkerSighting, find_markers
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, told

ROOM = DATA / "photos" / "tags_room"
FIRST, LAST, FROM = 1368, 1406, 1403
"""The walk round, and the photo from which on tags of its beginning are seen again."""
AGAIN = 100
"""Added to the number of a tag that is seen again."""
CLOSES = 0.01
LENS = CommonNoise(direction_px=1.0, between_px=0.06, edge_px=0.1)
CORNER_PX, BENDS = 0.5, (0.0, 0.02, 0.03, 0.04, 0.05, 0.06)
"""The lens's distortion isn't given: near the border it shifts tags by pixels, and stretches them by a hundredth.

Freeing the focal length from 750 to 780 px beside the first term (0.02, 0.04) doesn't settle it: what is left over
stays within 11 %, least where the loop gapes by 2.2 to 5.0 %. So the tags alone don't tell the lens: it must be given.
"""
CAMERA = RectifiedCamera(
    f_px=764.6, cx_px=393.72, cy_px=304.66, baseline_m=0.1, width_px=816, height_px=612,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip


def sightings(photo: Path) -> dict[int, MarkerSighting]:
    """Find the tags of one photo, whose single camera stands for the left one; the right one sees nothing."""
    left = np.asarray(cv2.imread(str(photo)), dtype=np.uint8)
    every = np.ones(left.shape[:2], dtype=bool)
    pair = RectifiedPair(
        name=photo.stem, left=left, right=np.zeros_like(left), valid_left=every, valid_right=every, camera=CAMERA
    )
    return {one.marker_id: replace(one, sigma_px=CORNER_PX) for one in find_markers(pair)}


def viewpoints() -> list[Viewpoint]:
    """Return the photos of the walk round, cut open at its end."""
    found = []
    for number in range(FIRST, LAST + 1):
        seen = sightings(ROOM / f"IMG_{number}.JPG")
        if number >= FROM:
            seen = {tag + AGAIN if tag in (11, 13, 19) else tag: one for tag, one in seen.items()}
        found.append(Viewpoint(name=f"{number}", camera=CAMERA, seen=seen))
    return found


def placed(bend: float) -> tuple[dict[int, FloatArray], dict[str, FloatArray], float]:
    """Return tags' centres by number, photos' places by name, and what is left over, by the lens's first term."""
    views = [_straight(view, bend) for view in viewpoints()]
    sizes = {tag: 1.0 for view in views for tag in view.seen}
    first = views[0]
    left_from_tag, _ = guesses(CAMERA, first.seen[min(first.seen)], 1.0)[0]
    sources = Sources(
        poses={}, survey={}, remembered={}, sizes_m=sizes, points={}, noise=LENS,
        starts={first.name: np.linalg.inv(left_from_tag)},
    )  # fmt: skip
    start = place_visit(views[:3], sources, RegisterOptions())
    anchors = {name: (pose, np.eye(6) * 1e-6) for name, (pose, _) in start.poses.items()}
    starts = {name: pose for name, (pose, _) in anchors.items()}
    made = place_visit(views, replace(sources, poses=anchors, starts=starts), RegisterOptions())
    return (
        {number: place.centre_m for number, place in made.tags.items()},
        {name: pose[:3, 3] for name, (pose, _) in made.poses.items()},
        float(np.mean(np.square(list(made.residual_px.values())))),
    )


def _straight(view: Viewpoint, bend: float) -> Viewpoint:
    """Return a photo's sightings with the lens's first radial term taken off."""
    return replace(view, seen={tag: replace(one, left_px=_bent(one.left_px, bend)) for tag, one in view.seen.items()})


def _bent(pixels: FloatArray, bend: float) -> FloatArray:
    middle = np.array([CAMERA.cx_px, CAMERA.cy_px])
    seen = (pixels - middle) / CAMERA.f_px
    true = seen.copy()
    for _ in range(10):
        true = seen / (1.0 + bend * np.sum(true**2, axis=1, keepdims=True))
    return frozen(true * CAMERA.f_px + middle)


def room_lines() -> list[Line]:
    """Judge how far the loop fails to close, of its length; the lens is the one that leaves least over, loop unseen."""
    if absent(ROOM):
        return []
    tags, photos, _ = min((placed(bend) for bend in BENDS), key=lambda found: found[2])
    names = sorted(photos)
    walk = float(sum(np.linalg.norm(photos[b] - photos[a]) for a, b in pairwise(names)))
    ring = float(_ring([tags[n] for n in (13, 11, *range(11), 12, *range(14, 20)) if n in tags]))
    gaps = [float(np.linalg.norm(tags[n] - tags[n + AGAIN])) for n in (11, 13, 19) if n in tags and n + AGAIN in tags]
    worst = max(gaps, default=np.inf)
    count = LAST - FIRST + 1
    return [
        told("a real room: photos placed", f"{len(photos)} of {count}", count),
        told("  walk, and ring of tags, in sides of a tag", f"{walk:.0f}, {ring:.0f}", len(photos)),
        line(
            "  loop of its tags closes to", f"{worst / ring:.2%}", "1 %", len(gaps), worst <= CLOSES * ring, least_n=2
        ),
    ]


def _ring(places: list[FloatArray]) -> float:
    if not places:
        return 1.0
    return float(sum(np.linalg.norm(b - a) for a, b in zip(places, [*places[1:], places[0]], strict=True)))
