"""Visits whose sightings are simulated: two storeys of walls and columns, prints stuck to them, a rig walked through.

No photo is drawn. A print is seen where it is in the frame of both photos, or of the left one, not too far, not too
oblique, and not behind a wall. What the finder and the rig err by is put on its corners: noise of each corner, black
that bleeds, what a lens model leaves over the frame (a smooth field, the same all through the visit), the rig's yaw.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.measure.depth_reference import DepthReference
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.solve import project_both
from asbuilt_bim.register.tags import SQUARE
from asbuilt_bim.vision.markers.find import MarkerSighting

ORIGIN_M = np.array([512_345.0, 5_412_876.0, 431.0])
"""Sites are far from the origin of their coordinates."""
STOREY_M, SIZE_M, SURVEY_M = 3.2, 0.25, 0.002
CORNER_PX, DIRECTION_PX, BETWEEN_PX, EDGE_PX, DISPARITY_PX = 0.08, 0.15, 0.05, (0.0, 0.15), 0.08
"""Errors, one sigma each: of a corner; of what the lens model leaves in both photos alike, and between them; how far
black bleeds, least and most; of the yaw. All but the last are what the sample's rendered photos show against its
survey; the last is what twenty boards leave of a rig."""
SPACING_M, STEP_M = 1.0, 0.5
"""Of prints along a wall; and of a building's length for each station: its two storeys make twice that between them."""
LEAST_SIDE_PX, MOST_OBLIQUE = 20.0, float(np.cos(np.radians(65.0)))
CAMERA = RectifiedCamera(
    f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
    rectified_from_left=frozen(rotation_from_vector([0.003, -0.008, 0.002])),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Print:
    """A print on the wall: its pose (4, 4) in the world, x right, y down, z into the wall; its true side."""

    marker_id: int
    world_from_tag: FloatArray
    size_m: float = SIZE_M

    @property
    def corners_m(self) -> FloatArray:
        """Return its corners (4, 3)."""
        return (SQUARE * self.size_m) @ self.world_from_tag[:3, :3].T + self.world_from_tag[:3, 3]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walls:
    """N upright walls: ends (N, 2, 2) in plan, and lower and upper end (N, 2)."""

    ends_m: FloatArray
    heights_m: FloatArray

    def hide(self, eye_m: FloatArray, points_m: FloatArray) -> np.ndarray:
        """Say of points (P, 3) which are behind a wall, as seen from an eye (3,)."""
        a, along = self.ends_m[:, 0], self.ends_m[:, 1] - self.ends_m[:, 0]
        ray = points_m[:, None, :2] - eye_m[:2]
        det = ray[..., 0] * along[None, :, 1] - ray[..., 1] * along[None, :, 0]
        off = a[None] - eye_m[:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (off[..., 0] * along[None, :, 1] - off[..., 1] * along[None, :, 0]) / det
            s = (off[..., 0] * ray[..., 1] - off[..., 1] * ray[..., 0]) / det
            height = eye_m[2] + t * (points_m[:, None, 2] - eye_m[2])
            crosses = (t > 1e-6) & (t < 1.0 - 0.02) & (s > 0.0) & (s < 1.0)
            crosses &= (height > self.heights_m[None, :, 0]) & (height < self.heights_m[None, :, 1])
        return np.asarray(crosses.any(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visit:
    """A visit as the program gets it, and its truth: poses (4, 4) of the stations by name."""

    measured: tuple[StationMeasurement, ...]
    survey: tuple[SurveyedMarker, ...]
    true: dict[str, FloatArray]
    prints: tuple[Print, ...]
    path_m: float


def upright(x: float, y: float, z: float, outward: FloatArray) -> FloatArray:
    """Return the pose (4, 4) of a print on a wall whose outward normal (2,) is level."""
    into = np.array([-outward[0], -outward[1], 0.0])
    down = np.array([0.0, 0.0, -1.0])
    return rigid(np.column_stack([np.cross(down, into), down, into]), [x, y, z])


def looking(eye: FloatArray, bearing_rad: float, rng: np.random.Generator) -> FloatArray:
    """Return the pose (4, 4) of a left camera held by hand at an eye (3,), about upright."""
    ahead = np.array([np.cos(bearing_rad), np.sin(bearing_rad), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    turn = np.column_stack([np.cross(down, ahead), down, ahead])
    return rigid(turn @ rotation_from_vector(rng.normal(0.0, [0.04, 0.0, 0.02])), eye)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Building:
    """A building of some bays: its walls, and prints on them."""

    walls: Walls
    prints: tuple[Print, ...]
    length_m: float
    width_m: float


def building(rng: np.random.Generator, length_m: float, width_m: float, storeys: int = 2) -> Building:
    """Make storeys of outer walls and cross walls with gaps, an opening between them at one end, and prints."""
    segments, heights, prints = [], [], []
    count = round(length_m / 6.0)
    for level in range(storeys):
        z = level * STOREY_M
        lines = [((0, 0), (length_m, 0)), ((length_m, 0), (length_m, width_m)), ((length_m, width_m), (0, width_m)),
                 ((0, width_m), (0, 0))]  # fmt: skip
        for k in range(1, count):
            x, gap = 6.0 * k + rng.uniform(-1, 1), rng.uniform(0.35, 0.65) * width_m
            lines += [((x, 0), (x, gap - 2.5)), ((x, gap + 2.5), (x, width_m))]
        for a, b in lines:
            a, b = np.array(a, dtype=float), np.array(b, dtype=float)
            segments.append((a, b))
            heights.append((z, z + STOREY_M))
            along = (b - a) / np.linalg.norm(b - a)
            side = np.array([-along[1], along[0]])
            for outward in (side, -side):
                for at in np.arange(rng.uniform(0.3, 0.9), float(np.linalg.norm(b - a)) - 0.3, SPACING_M):
                    place = a + along * (at + rng.uniform(-0.3, 0.3)) + 0.01 * outward
                    if -0.1 < place[0] < length_m + 0.1 and -0.1 < place[1] < width_m + 0.1:
                        prints.append((place, z + rng.uniform(0.9, 2.4), outward))
    shaft = [
        (np.array([0.01, y + rng.uniform(-0.2, 0.2)]), z + rng.uniform(-0.1, 0.1), np.array([1.0, 0.0]))
        for y in np.arange(1, width_m, 1.5)
        for z in (2.7, 3.6)
    ]
    made = tuple(
        Print(
            marker_id=number,
            world_from_tag=upright(place[0], place[1], z, outward),
            size_m=float(rng.normal(SIZE_M, 0.001)),
        )
        for number, (place, z, outward) in enumerate(prints + shaft)
    )
    return Building(
        walls=Walls(ends_m=np.array(segments), heights_m=np.array(heights)), prints=made, length_m=length_m,
        width_m=width_m,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lens:
    """What a lens model leaves: a smooth field over the frame (2 photos, 2 axes, 10 terms up to cubes) in pixels."""

    terms: FloatArray

    def at(self, pixels: FloatArray, photo: int) -> FloatArray:
        """Return how far points (N, 2) are shifted."""
        x, y = (pixels[:, 0] - 640.0) / 640.0, (pixels[:, 1] - 480.0) / 640.0
        basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3], axis=1)
        return basis @ self.terms[photo].T


def rig_errors(rng: np.random.Generator) -> tuple[Lens, float]:
    """Draw what a visit's rig errs by: its lenses and the disparity in common."""
    terms = rng.normal(0.0, 1.0, (2, 2, 10))
    grid = np.stack(np.meshgrid(np.linspace(0, 1279, 9), np.linspace(0, 959, 7)), axis=-1).reshape(-1, 2)
    for part, size in ((0, DIRECTION_PX), (1, BETWEEN_PX)):
        terms[part] *= size / np.sqrt(np.mean(Lens(terms=terms).at(grid, part) ** 2))
    lens = Lens(terms=np.stack([terms[0] + 0.5 * terms[1], terms[0] - 0.5 * terms[1]]))
    return lens, float(rng.normal(0.0, DISPARITY_PX))


def sightings(
    pose: FloatArray, site: Building, lens: Lens, disparity_px: float, rng: np.random.Generator
) -> tuple[MarkerSighting, ...]:
    """Return what the photos of a station (4, 4) show of the prints."""
    found = []
    eye = pose[:3, 3]
    centres = np.array([one.world_from_tag[:3, 3] for one in site.prints])
    normals = -np.array([one.world_from_tag[:3, 2] for one in site.prints])
    to = eye - centres
    range_m = np.linalg.norm(to, axis=1)
    faces = np.einsum("nk,nk->n", to, normals) / range_m > MOST_OBLIQUE
    ahead = ((centres - eye) @ pose[:3, 2]) > 0.8
    candidates = np.flatnonzero(faces & ahead & (range_m < 14.0))
    candidates = candidates[~site.walls.hide(eye, centres[candidates] + 0.03 * normals[candidates])]
    for number in candidates:
        one = site.prints[number]
        pixels, _ = project_both(CAMERA, pose, one.corners_m)
        side = float(np.min(np.linalg.norm(np.roll(pixels[:, :2], 1, axis=0) - pixels[:, :2], axis=1)))
        if side < LEAST_SIDE_PX or not _inside(pixels[:, :2]) or rng.uniform() < 0.1:
            continue
        bleed = rng.uniform(*EDGE_PX)
        eyes = []
        for photo, clean in enumerate((pixels[:, :2], pixels[:, 2:])):
            outwards = clean - clean.mean(axis=0)
            outwards = outwards / np.sqrt(np.mean(outwards**2))
            noise = rng.normal(0.0, CORNER_PX, clean.shape)
            eyes.append(clean + bleed * outwards + lens.at(clean, photo) + noise)
        eyes[1][:, 0] -= disparity_px
        right = eyes[1] if _inside(pixels[:, 2:]) and rng.uniform() > 0.05 else None
        found.append(
            MarkerSighting(marker_id=one.marker_id, left_px=frozen(eyes[0]),
                           right_px=None if right is None else frozen(right), sigma_px=CORNER_PX)
        )  # fmt: skip
    return tuple(sorted(found, key=lambda sighting: sighting.marker_id))


def _inside(pixels: FloatArray) -> bool:
    return bool(np.all(pixels > 4.0) and np.all(pixels < [CAMERA.width_px - 4.0, CAMERA.height_px - 4.0]))


def station(name: str, markers: tuple[MarkerSighting, ...]) -> StationMeasurement:
    """Return a measurement that shows prints and nothing else."""
    return StationMeasurement(
        station=name, camera=CAMERA, faces=(), target=None, markers=markers,
        depth_ref=DepthReference(png=b"", sigma_png=b"", scale=2), vertical=None, rejections=(), seconds={},
        left_digest="", right_digest="", thumbnail_jpeg=b"",
    )  # fmt: skip


def walk(rng: np.random.Generator, site: Building, stations: int, storeys: int = 2) -> list[FloatArray]:
    """Return poses (4, 4) of stations: round each storey, each photo showing some of what the one before showed.

    The first station of a storey looks at the opening that links it to the other.
    """
    poses: list[FloatArray] = []
    each = int(np.ceil(stations / storeys))
    for level in range(storeys):
        z = level * STOREY_M + 1.6
        count = min(each, stations - len(poses))
        round_m = np.linspace(0.0, 1.0, count, endpoint=False) * 2.0 * (site.length_m - 6.0)
        for k, at in enumerate(round_m):
            there = at < site.length_m - 6.0
            x = 3.0 + at if there else 3.0 + 2.0 * (site.length_m - 6.0) - at
            y = (0.40 if there else 0.60) * site.width_m + rng.uniform(-0.5, 0.5)
            bearing = (np.pi if k == 0 else (-0.5 if there else np.pi - 0.5)) + rng.uniform(-0.3, 0.3)
            poses.append(looking(np.array([x + (2.5 if k == 0 else 0.0), y, z]), bearing, rng))
    return poses


def surveyed(prints: list[Print], rng: np.random.Generator) -> tuple[SurveyedMarker, ...]:
    """Survey prints: half of the variance is common to a print's corners."""
    found = []
    for one in prints:
        off = rng.normal(0.0, SURVEY_M * 0.5**0.5, (4, 3)) + rng.normal(0.0, SURVEY_M * 0.5**0.5, 3)
        found.append(
            SurveyedMarker(marker_id=one.marker_id, corners_m=frozen(one.corners_m + off + ORIGIN_M), sigma_m=SURVEY_M)
        )
    return tuple(found)


def simulated(seed: int, stations: int, length_m: float | None = None, width_m: float = 9.0) -> Visit:
    """Make a visit: what is seen, three surveyed prints, and the truth."""
    rng = np.random.default_rng([seed, stations])
    site = building(rng, length_m or max(12.0, STEP_M * stations), width_m)
    return _visited(rng, site, stations)


def moved_in(seed: int, stations: int, marker_id: int, by_m: float) -> Visit:
    """Make another visit to the site of a seed, one of whose prints was moved along its wall since."""
    rng = np.random.default_rng([seed, stations])
    site = building(rng, max(12.0, STEP_M * stations), 9.0)
    along = rigid(np.eye(3), [by_m, 0.0, 0.0])
    prints = [
        replace(one, world_from_tag=one.world_from_tag @ along) if one.marker_id == marker_id else one
        for one in site.prints
    ]
    return _visited(np.random.default_rng([seed, stations, 2]), replace(site, prints=tuple(prints)), stations)


def _visited(rng: np.random.Generator, site: Building, stations: int) -> Visit:
    lens, disparity = rig_errors(rng)
    poses = walk(rng, site, stations)
    measured = [
        station(f"S{number:03d}", sightings(pose, site, lens, disparity, rng)) for number, pose in enumerate(poses)
    ]
    survey = surveyed(three(measured, site, rng), rng)
    shift = np.eye(4)
    shift[:3, 3] = ORIGIN_M
    path = float(sum(np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in pairwise(poses)))
    return Visit(
        measured=tuple(measured), survey=survey, prints=site.prints, path_m=path,
        true={one.station: shift @ pose for one, pose in zip(measured, poses, strict=True)},
    )  # fmt: skip


def three(measured: list[StationMeasurement], site: Building, rng: np.random.Generator) -> list[Print]:
    """Choose three prints to survey, as a surveyor would: two below, far apart, one above, each seen twice or more."""
    ids = [one.marker_id for station in measured for one in station.markers]
    seen = [one for one in site.prints if ids.count(one.marker_id) >= 2]
    low = [one for one in seen if one.world_from_tag[2, 3] < STOREY_M]
    high = [one for one in seen if one.world_from_tag[2, 3] > STOREY_M]
    first = low[int(rng.integers(0, len(low)))]
    last = max(low, key=lambda one: float(np.linalg.norm(one.world_from_tag[:2, 3] - first.world_from_tag[:2, 3])))
    return [first, last, high[int(rng.integers(0, len(high)))]]
