"""What the plan wants seen, in squares of half a metre: a piece of an element, and the patches of its sides."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, freeze, frozen
from asbuilt_bim.geometry.polygon import areas_of_boxes
from asbuilt_bim.geometry.transform import apply
from asbuilt_bim.progress.surface import SurfaceState

SIDE_M = 0.5
"""Of a square: two cells of a wall, five of a column. What hides less than that is for the photos to show."""
_TO_CORNERS = 0.4 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Squares:
    """Patches (P) of the sides of elements, and the squares (S) that they are of: one side seen is the square seen.

    `points_m` and outward `normals` (P, 3) in the world; `corners_m` (P, 4, 3) lie four fifths of the way to a patch's
    own corners: what hides less of it doesn't count. `face` (P,) tells their faces apart; `square` (P,) the index
    into `area_m2` and `element` (S,), the index into `elements`. `area_m2` is of the square's largest side.
    """

    elements: tuple[BimElement, ...]
    points_m: FloatArray
    corners_m: FloatArray
    normals: FloatArray
    face: IntArray
    square: IntArray
    area_m2: FloatArray
    element: IntArray

    @property
    def total_m2(self) -> float:
        """Return the area of all squares: of each side by side pair once."""
        return float(self.area_m2.sum())

    def part(self, patches: BoolArray) -> "Squares":
        """Return the squares with some of their patches (P,) alone."""
        return replace(
            self,
            points_m=frozen(self.points_m[patches]),
            corners_m=frozen(self.corners_m[patches]),
            normals=frozen(self.normals[patches]),
            face=freeze(self.face[patches]),
            square=freeze(self.square[patches]),
        )

    def without(self, seen: BoolArray) -> "Squares":
        """Return the squares (S,) that are not seen."""
        kept = ~seen
        number = np.cumsum(kept) - 1
        left = self.part(kept[self.square])
        return replace(
            left,
            square=freeze(number[left.square].astype(np.int32)),
            area_m2=frozen(self.area_m2[kept]),
            element=freeze(self.element[kept]),
        )


def wanted_squares(design: BimModel, wanted: Collection[str], known: Mapping[str, SurfaceState]) -> Squares:
    """Return the squares of the wanted elements (GlobalIds) that no visit has seen built; `known` is by face id.

    What was seen open is wanted again: it may stand by now.
    """
    elements = tuple(one for one in design.elements if one.global_id in wanted and any(_sides(one)))
    points, corners, normals, of_square, areas, owners = [], [], [], [], [], []
    of_face: list[IntArray] = []
    count = 0
    for number, element in enumerate(elements):
        samples = cell_samples(element, SIDE_M)
        place = _places(element, samples.points_m)
        keys, square = np.unique(place, axis=0, return_inverse=True)
        square = square.reshape(-1)
        area = np.zeros(len(keys))
        built = np.zeros(len(samples.face), dtype=np.bool_)
        for index in np.unique(samples.face):
            face, mine = element.faces[index], samples.face == index
            side = np.bincount(square[mine], samples.area_m2[mine], minlength=len(keys))
            area = np.maximum(area, side)
            state = known.get(face.face_id)
            built[mine] = _built(state, samples.uv_m[mine], samples.step_m[mine])
            of_face.append(np.full(np.count_nonzero(mine), len(of_face), dtype=np.int32))
            points.append(samples.points_m[mine])
            around = samples.uv_m[mine, None] + _TO_CORNERS * samples.step_m[mine, None]
            corners.append(face.frame.from_uv(around.reshape(-1, 2)).reshape(-1, 4, 3))
            normals.append(samples.normals[mine])
            of_square.append(square[mine] + count)
        known_built = np.zeros(len(keys), dtype=np.bool_)
        known_built[square[built]] = True
        area[known_built] = 0.0  # taken out below: a square is seen where one side of it was
        areas.append(area)
        owners.append(np.full(len(keys), number))
        count += len(keys)
    whole = Squares(
        elements=elements,
        points_m=frozen(np.concatenate(points) if points else np.zeros((0, 3))),
        corners_m=frozen(np.concatenate(corners) if corners else np.zeros((0, 4, 3))),
        normals=frozen(np.concatenate(normals) if normals else np.zeros((0, 3))),
        face=freeze(_joined(of_face)),
        square=freeze(_joined(of_square)),
        area_m2=frozen(np.concatenate(areas) if areas else np.zeros(0)),
        element=freeze(_joined(owners)),
    )
    return whole.without(whole.area_m2 <= 0.0)


def _sides(element: BimElement) -> list[bool]:
    return [face.role != "reveal" and face.exposed_area_m2 > 0.0 for face in element.faces]


def _joined(parts: list[IntArray]) -> IntArray:
    whole: IntArray = (np.concatenate(parts) if parts else np.zeros(0)).astype(np.int32)
    return whole


def _places(element: BimElement, points_m: FloatArray) -> IntArray:
    """Return the square (N, 2) along an element and up it that points lie in; a column has one along."""
    own = apply(element.axis_from_world, points_m)
    along = np.zeros(len(own)) if element.kind == "column" else _pieces(own[:, 0], element.length_m)
    places: IntArray = np.column_stack([along, _pieces(own[:, 2], element.height_m)]).astype(np.int32)
    return places


def _pieces(at_m: FloatArray, size_m: float) -> FloatArray:
    """Return in which of the equal pieces of about `SIDE_M` places lie."""
    pieces = max(1, round(size_m / SIDE_M))
    found: FloatArray = np.clip(np.floor(at_m / max(size_m, 1e-9) * pieces), 0, pieces - 1)
    return found


def _built(state: SurfaceState | None, uv_m: FloatArray, step_m: FloatArray) -> BoolArray:
    """Say of patches (N,) of a face, boxes of `step_m` round `uv_m`, whether a visit saw most of each built."""
    if state is None or not state.built_uv_m:
        return np.zeros(len(uv_m), dtype=np.bool_)
    low, high = uv_m - 0.5 * step_m, uv_m + 0.5 * step_m
    covered = areas_of_boxes(state.built_uv_m, low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    share: BoolArray = covered >= 0.5 * np.prod(step_m, axis=1)
    return share
