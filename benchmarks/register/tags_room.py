"""A real room by its tags alone: 39 photos once round it, three as anchors, and how far the loop fails to close.

The tags' size is unknown, so the scale is free: lengths are in sides of a tag. To test the loop it is cut open: tags
that the first photos show, and the last ones again, get other numbers there, and must come out in the same places.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.register.growth import Viewpoint
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.tags import guesses
from asbuilt_bim.register.visit import Sources, place_visit
from asbuilt_bim.vision.markers.corners import refine_corners
from asbuilt_bim.vision.markers.find import MarkerSighting
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, told

ROOM = DATA / "photos" / "tags_room"
FIRST, LAST, FROM = 1368, 1406, 1403
"""The walk round, and the photo from which on tags of its beginning are seen again."""
AGAIN = 100
"""Added to the number of a tag that is seen again."""
CLOSES = 0.01
CAMERA = RectifiedCamera(
    f_px=764.6, cx_px=393.72, cy_px=304.66, baseline_m=0.1, width_px=816, height_px=612,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip


def sightings(photo: Path) -> dict[int, MarkerSighting]:
    """Find the tags of one photo, whose single camera stands for the left one."""
    grey = cv2.imread(str(photo), cv2.IMREAD_GRAYSCALE)
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)
    found, ids, _ = detector.detectMarkers(grey)
    seen = {}
    for corners, number in zip(found, [] if ids is None else ids.ravel(), strict=True):
        refined, sigma = refine_corners(grey, np.asarray(corners, dtype=np.float64).reshape(4, 2), 10)
        seen[int(number)] = MarkerSighting(
            marker_id=int(number), left_px=frozen(refined), right_px=None, sigma_px=float(sigma)
        )
    return seen


def viewpoints() -> list[Viewpoint]:
    """Return the photos of the walk round, cut open at its end."""
    found = []
    for number in range(FIRST, LAST + 1):
        seen = sightings(ROOM / f"IMG_{number}.JPG")
        if number >= FROM:
            seen = {tag + AGAIN if tag in (11, 13, 19) else tag: one for tag, one in seen.items()}
        found.append(Viewpoint(name=f"{number}", camera=CAMERA, seen=seen))
    return found


def placed() -> tuple[dict[int, FloatArray], dict[str, FloatArray], int]:
    """Return the tags' centres by number, the photos' places by name, and how many photos there are."""
    views = viewpoints()
    sizes = {tag: 1.0 for view in views for tag in view.seen}
    first = views[0]
    tag = min(first.seen)
    left_from_tag, _ = guesses(CAMERA, first.seen[tag], 1.0)[0]
    origin = np.linalg.inv(left_from_tag)  # the first photo's place, as seen from its first tag
    sources = Sources(poses={}, survey={}, remembered={}, sizes_m=sizes, points={}, starts={views[0].name: origin})
    start = place_visit(views[:3], sources, RegisterOptions())
    anchors = {name: (pose, np.eye(6) * 1e-6) for name, (pose, _) in start.poses.items()}
    sources = Sources(
        poses=anchors, survey={}, remembered={}, sizes_m=sizes, points={},
        starts={name: pose for name, (pose, _) in anchors.items()},
    )  # fmt: skip
    made = place_visit(views, sources, RegisterOptions())
    return (
        {number: place.centre_m for number, place in made.tags.items()},
        {name: pose[:3, 3] for name, (pose, _) in made.poses.items()},
        len(views),
    )


def room_lines() -> list[Line]:
    """Judge how far the loop fails to close, of its length."""
    if absent(ROOM):
        return []
    tags, photos, count = placed()
    names = sorted(photos)
    length = float(sum(np.linalg.norm(photos[b] - photos[a]) for a, b in pairwise(names)))
    ring = float(_ring([tags[n] for n in (13, 11, *range(11), 12, *range(14, 20)) if n in tags]))
    gaps = [float(np.linalg.norm(tags[n] - tags[n + AGAIN])) for n in (11, 13, 19) if n in tags and n + AGAIN in tags]
    worst = max(gaps, default=np.inf)
    return [
        told("a real room: photos placed", f"{len(photos)} of {count}", count),
        told("  walk, and ring of tags, in sides of a tag", f"{length:.0f}, {ring:.0f}", len(photos)),
        line(
            "  loop of its tags closes to", f"{worst / ring:.2%}", "1 %", len(gaps), worst <= CLOSES * ring, least_n=2
        ),
    ]


def _ring(places: list[FloatArray]) -> float:
    return float(sum(np.linalg.norm(b - a) for a, b in zip(places, [*places[1:], places[0]], strict=True)))
