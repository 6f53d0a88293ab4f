"""Which design faces a station could see at all: in the frame, near enough, and not turned away."""

from dataclasses import dataclass
from typing import Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.bim.model import BimModel, DesignFace
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import bounds
from asbuilt_bim.geometry.transform import apply, inverse

_GRID_M = 0.25  # a face that fills the frame still has a point in it: at 1 m a frame sees more than this
_MAX_POINTS = 40  # a side, for halls a hundred metres long


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Balls:
    """Exposed faces with a ball round each: middles (N, 3) and radii (N,) in metres.

    `points_m` holds what was laid out of them so far: points (K, 3) over a face, by its place in `faces`.
    """

    faces: list[DesignFace]
    middles_m: FloatArray
    radii_m: FloatArray
    points_m: dict[int, FloatArray]

    def points_of(self, number: int) -> FloatArray:
        """Return points (K, 3) over a face; many stations ask for those of one face."""
        if number not in self.points_m:
            self.points_m[number] = _points(self.faces[number])
        return self.points_m[number]


_LAID_OUT: WeakKeyDictionary[BimModel, _Balls] = WeakKeyDictionary()


class PinholeCamera(Protocol):
    """What is asked of a camera here: its size and how it projects points of its own frame."""

    @property
    def width_px(self) -> int:
        """Return the width in pixels."""

    @property
    def height_px(self) -> int:
        """Return the height in pixels."""

    def project(self, points_left_m: ArrayLike) -> FloatArray:
        """Return pixels (..., 2) of points (..., 3), NaN behind the camera."""


def candidates(
    design: BimModel, world_from_left: FloatArray, camera: PinholeCamera, max_distance_m: float
) -> tuple[DesignFace, ...]:
    """Return the design faces in the frame of a camera at `world_from_left`, within the distance and not turned away.

    What stands in front is not asked: that is for the measured depth to say.
    """
    balls = _balls_of(design)
    if not balls.faces:
        return ()
    eye = world_from_left[:3, 3]
    near = np.linalg.norm(balls.middles_m - eye, axis=1) - balls.radii_m <= max_distance_m
    ahead = (balls.middles_m - eye) @ world_from_left[:3, 2] + balls.radii_m > 0.0
    left = [i for i in np.flatnonzero(near & ahead).tolist() if _faces(balls.faces[i], eye)]
    if not left:
        return ()
    grids = [balls.points_of(i) for i in left]
    owner = np.repeat(np.arange(len(left)), [len(grid) for grid in grids])
    points = np.concatenate(grids)
    pixels = camera.project(apply(inverse(world_from_left), points))
    with np.errstate(invalid="ignore"):
        seen = ((pixels >= -0.5) & (pixels < [camera.width_px - 0.5, camera.height_px - 0.5])).all(axis=1)
    seen &= np.linalg.norm(points - eye, axis=1) <= max_distance_m
    hits = np.bincount(owner, seen, minlength=len(left))
    return tuple(balls.faces[i] for i, count in zip(left, hits, strict=True) if count > 0)


def _balls_of(design: BimModel) -> _Balls:
    """Return the balls round a design's faces; they are laid out once for as long as the design is held."""
    found = _LAID_OUT.get(design)
    if found is None:
        found = _LAID_OUT[design] = _balls([f for element in design.elements for f in element.faces if f.exposed_uv_m])
    return found


def _balls(faces: list[DesignFace]) -> _Balls:
    centres, radii = np.zeros((len(faces), 3)), np.zeros(len(faces))
    for i, face in enumerate(faces):
        u0, v0, u1, v1 = bounds(face.exposed_uv_m)
        if isinstance(face.frame, CylinderFrame):
            centres[i] = face.frame.origin_m + (v0 + v1) / 2.0 * face.frame.axis
            radii[i] = np.hypot(face.frame.radius_m, (v1 - v0) / 2.0)
        else:
            centres[i] = face.frame.from_uv([(u0 + u1) / 2.0, (v0 + v1) / 2.0])
            radii[i] = np.hypot(u1 - u0, v1 - v0) / 2.0
    return _Balls(faces=faces, middles_m=centres, radii_m=radii, points_m={})


def _faces(face: DesignFace, eye: FloatArray) -> bool:
    """Say whether the eye is on the outer side of a face."""
    if isinstance(face.frame, CylinderFrame):
        return bool(face.frame.distance_m(eye) > 0.0)
    return bool(face.frame.normal @ (eye - face.frame.origin_m) > 0.0)


def _points(face: DesignFace) -> FloatArray:
    """Return points (N, 3) in world over a face: a grid over its box, and its corners."""
    u0, v0, u1, v1 = bounds(face.exposed_uv_m)
    u, v = (
        np.linspace(a, b, int(np.clip(np.ceil((b - a) / _GRID_M), 1, _MAX_POINTS)) + 1) for a, b in ((u0, u1), (v0, v1))
    )
    grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    return face.frame.from_uv(np.concatenate([grid, *(ring for rings in face.exposed_uv_m for ring in rings)]))
