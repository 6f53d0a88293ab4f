"""Fixes AprilTags on built elements and on boards about the site, the same through the visits, and surveys them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from asbuilt_synthetic.building import STOREY_M, Building
from asbuilt_synthetic.clutter import Plan
from asbuilt_synthetic.meshes import Part, box, join, transform, tube
from asbuilt_synthetic.model import Decal, FloatArray, Marker
from asbuilt_synthetic.progress import progress
from asbuilt_synthetic.solids import in_opening, sides

MODULES, QUIET = 8, 1  # 36h11 with its black border; modules of white round it
SURVEY_SIGMA_M = 0.002
_OFF_SURFACE_M = 0.0015


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tag:
    """A tag in the site's local frame: centre, normal, and the visit from which it is there."""

    tag_id: int
    centre_m: FloatArray
    normal: FloatArray  # horizontal, towards the viewer
    since_visit: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tags:
    """All tags of a site with the boards that carry some of them: (since_visit, part)."""

    size_m: float
    tags: tuple[Tag, ...]
    stands: tuple[tuple[int, Part], ...]

    def markers(self, building: Building) -> tuple[Marker, ...]:
        """Return every tag of the site with true and surveyed corners in world."""
        rng = np.random.default_rng([building.seed, 8])
        out = []
        for t in self.tags:
            corners = transform(building.world_from_local, _corners(t, self.size_m))
            survey = corners + rng.normal(0, SURVEY_SIGMA_M, corners.shape)
            out.append(Marker(tag_id=t.tag_id, true_corners_m=corners, surveyed_corners_m=np.round(survey, 4)))
        return tuple(out)

    def decals(self, building: Building, visit: int) -> tuple[Decal, ...]:
        """Return the prints, quiet zone and all, that are there at a visit."""
        side = self.size_m * (MODULES + 2 * QUIET) / MODULES
        return tuple(
            Decal(
                name=f"tag {t.tag_id}",
                corners_m=transform(building.world_from_local, _corners(t, side)),
                image_srgb=tag_image(t.tag_id),
            )
            for t in self.tags
            if t.since_visit <= visit
        )

    def bodies(self, visit: int) -> list[Part]:
        """Return the stands that are there at a visit."""
        return [p for since, p in self.stands if since <= visit]


def tag_image(tag_id: int) -> np.ndarray:
    """Draw an AprilTag 36h11 with its quiet zone, 24 px a module, in printer's black and white."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    tag = cv2.aruco.generateImageMarker(family, tag_id, MODULES * 24)
    grey = np.pad(tag, QUIET * 24, constant_values=255)
    printed = (28 + (grey.astype(np.float32) / 255) * (206 - 28)).astype(np.uint8)
    return np.repeat(printed[:, :, None], 3, axis=2)


def place_tags(building: Building, plan: Plan, upper: Plan) -> Tags:
    """Choose the tags of a site; takes the stands' places in the plans of ground and first floor."""
    rng = np.random.default_rng([building.seed, 7])
    size = float(rng.choice([0.25, 0.28, 0.30]))
    spots: list[tuple[FloatArray, FloatArray, int]] = []
    stands: list[tuple[int, Part]] = []
    for visit in (0, 1):
        spots += _on_elements(building, visit, size, rng)
    for x, y, since, z in _stand_places(building, plan, upper, rng):
        angle = float(rng.uniform(0, np.pi))
        part, pair = _stand(size, float(rng.uniform(0.75, 1.35)))
        stands.append((since, part.moved((x, y), z, angle)))
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        spots += [(turn @ p + [x, y, z], turn @ n, since) for p, n in pair]
    tags = tuple(
        Tag(tag_id=i, centre_m=p + _OFF_SURFACE_M * n, normal=n, since_visit=v) for i, (p, n, v) in enumerate(spots)
    )
    return Tags(size_m=size, tags=tags, stands=tuple(stands))


def _corners(tag: Tag, side_m: float) -> FloatArray:
    """Corners top-left, top-right, bottom-right, bottom-left as seen from the front."""
    up = np.array([0, 0, 1.0])
    right = np.cross(up, tag.normal)
    h = side_m / 2
    return np.array([tag.centre_m + a * h * right + b * h * up for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))])


def _on_elements(
    building: Building, visit: int, size: float, rng: np.random.Generator
) -> list[tuple[FloatArray, FloatArray, int]]:
    """Fix tags on faces of elements that are complete at a visit and were not before."""
    now, before = progress(building, visit), (progress(building, visit - 1) if visit else None)
    need, out = size * 1.25 + 0.04, []
    for e in building.vertical:
        if now.fraction[e.global_id] < 1 or (before and before.fraction[e.global_id] == 1) or e.shape == "round":
            continue
        for side in sides(e):
            n = 0 if side.length_m < need else 1 + int(side.length_m > 2.4)
            for k in range(n):
                for _ in range(10):
                    u = rng.uniform(need / 2, side.length_m - need / 2)
                    if n == 2:
                        u = side.length_m * (k + rng.uniform(0.25, 0.75)) / 2
                    v = float(rng.uniform(1.0, 1.9))
                    p, normal = side.points(np.array([u]), np.array([v]))
                    x = side.x_from_u[0] + side.x_from_u[1] * (u + np.array([-1, 0, 1, -1, 0, 1]) * need / 2)
                    z = v + np.array([-1, -1, -1, 1, 1, 1]) * need / 2
                    if not in_opening(e, x, z).any():
                        m = e.local_from_element
                        out.append((transform(m, p)[0], m[:3, :3] @ normal[0], visit))
                        break
    return out


def _stand_places(
    building: Building, plan: Plan, upper: Plan, rng: np.random.Generator
) -> list[tuple[float, float, int, float]]:
    out: list[tuple[float, float, int, float]] = []
    for count, margin in ((6, -0.6), (12, 2.5), (7, 5.0)):
        for _ in range(count):
            at = plan.place(rng, 0.4, margin)
            if at is not None:
                out.append((*at, 0, plan.floor_m(*at)))
    for _ in range(12):
        at = upper.place(rng, 0.4, -0.8)
        if at is not None:
            out.append((*at, 1 if at[0] < building.joint_x_m - 0.4 else 2, STOREY_M))
    return out


def _stand(size: float, height: float) -> tuple[Part, list[tuple[FloatArray, FloatArray]]]:
    """Build a board on a pole with three feet; it carries a tag on each side."""
    h = size * 1.25 / 2 + 0.02
    board = box("board", (-0.009, -h, height - h), (0.009, h, height + h), "plaster")
    legs = [
        tube("leg", (0, 0, height - h), (0.3 * np.cos(a), 0.3 * np.sin(a), 0.0), 0.012, "stand_black", 8)
        for a in (0.5, 2.6, 4.7)
    ]
    part = replace(join("Tag stand", [board, *legs]), material="stand_black")
    x = np.array([1.0, 0, 0])
    return part, [(np.array([0.009, 0, height]), x), (np.array([-0.009, 0, height]), -x)]
