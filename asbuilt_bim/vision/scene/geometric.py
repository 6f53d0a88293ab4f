"""Walls and columns by geometry alone: what stands upright, hangs together at convex edges, and has their size."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.photo.chroma import is_grey
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, freeze
from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource
from asbuilt_bim.vision.scene.read import Scene, SceneOptions

IndexArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True)
class GeometricOptions:
    """Sizes by building practice."""

    column_width_m: float = 1.05  # in-situ columns are cast up to 1.0 m; a wider thing is a wall
    least_width_m: float = 0.12  # a thinner upright is a prop, a tube or a board
    least_height_m: float = 0.30  # a kerb is lower; the first lift of a wall is higher
    most_chroma: float = 0.42  # (max - min) / max of BGR: concrete keeps under 0.25, plywood and brick over 0.4
    scene: SceneOptions = field(default_factory=SceneOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class Opinion:
    """What another segmenter says of a group of pieces: its class, and how sure it is, 0..1."""

    label: InstanceClass
    score: float


def segment_scene(pair: RectifiedPair, scene: Scene, options: GeometricOptions | None = None) -> list[Instance]:
    """Group a scene's upright pieces to instances as grey as concrete, the largest first."""
    return of_concretes_colour(upright_instances(pair, scene, options), pair.name)[0]


def upright_instances(pair: RectifiedPair, scene: Scene, options: GeometricOptions | None = None) -> list[Instance]:
    """Group a scene's upright pieces to instances, the largest first; those of another colour have a score of 0."""
    chosen = options or GeometricOptions()
    neutral = neutral_of(pair)
    groups = piece_groups(scene.pieces)
    instances = (instance_of_pieces(pair, scene, group, chosen, neutral) for group in groups)
    found = [instance for instance in instances if instance is not None]
    return sorted(found, key=lambda instance: -int(np.count_nonzero(instance.mask)))


def of_concretes_colour(found: Sequence[Instance], station: str) -> tuple[list[Instance], tuple[Rejection, ...]]:
    """Return the instances that are as grey as concrete may be, and a note of the others: these aren't measured."""
    grey = [one for one in found if one.score > 0.0]
    others = [one for one in found if one.score <= 0.0]
    if not others:
        return grey, ()
    x0, y0, x1, y1 = max(others, key=lambda one: int(np.count_nonzero(one.mask))).box_px
    subject = about(SubjectKind.INSTANCE, "of another colour", station)
    place = {"x_px": (x0 + x1) // 2, "y_px": (y0 + y1) // 2}
    return grey, (rejected(Reason.SURFACES_OF_OTHER_COLOUR, subject, count=len(others), **place),)


def piece_groups(pieces: tuple[Piece, ...]) -> list[list[int]]:
    """Return the pieces' numbers by instance: neighbours in a chain that meet in a convex edge."""
    groups: list[list[int]] = [[0]] if pieces else []
    for one, other in pairwise(range(len(pieces))):
        if pieces[one].chain == pieces[other].chain and pieces[one].convex_next:
            groups[-1].append(other)
        else:
            groups.append([other])
    return groups


@dataclass(frozen=True, slots=True, kw_only=True)
class _Size:
    """One piece's size in metres."""

    width_m: float
    height_m: float


def instance_of_pieces(
    pair: RectifiedPair,
    scene: Scene,
    group: list[int],
    options: GeometricOptions,
    neutral: FloatArray | None,
    opinion: Opinion | None = None,
) -> Instance | None:
    """Return a group of pieces as an instance, None where it hasn't a wall's or a column's size and place.

    Its score is by its colour: 0 where concrete has none such. `neutral` (3,) is the photo's own, of `neutral_of`.
    An `opinion` stands for colour; of a slender thing it decides the class too, which size can't tell.
    """
    sizes: list[_Size] = []
    mask = np.zeros(scene.labels.shape, dtype=bool)
    round_column = False
    for number in group:
        if scene.sizes[number] == 0:
            continue
        rows, columns = scene.pixels(number)
        size = _size(scene, scene.pieces[number], rows, columns)
        if size is None or size.height_m < options.least_height_m:
            continue
        sizes.append(size)
        mask[rows, columns] = True
        circle = scene.pieces[number].circle
        round_column |= circle is not None and circle.radius_m < 0.5 * options.column_width_m
    if not sizes:
        return None
    if sum(size.width_m for size in sizes) < options.least_width_m:
        return None
    score = opinion.score if opinion is not None else _concrete_score(pair, mask, neutral, options.most_chroma)
    slender = all(size.width_m < options.column_width_m for size in sizes)
    label: InstanceClass = "column" if round_column or slender else "wall"
    if opinion is not None and slender and not round_column:
        label = opinion.label
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    box = (int(x), int(y), int(x + width), int(y + height))
    freeze(mask)
    return Instance(label=label, score=score, mask=mask, box_px=box, source=InstanceSource.GEOMETRY)


def _size(scene: Scene, piece: Piece, rows: IndexArray, columns: IndexArray) -> _Size | None:
    """Measure a piece by its pixels: 2 and 98 per cent quantiles, so that a crumb doesn't count."""
    if rows.size == 0:
        return None
    x = scene.level.x_px[rows, columns]
    ends = np.quantile(x, [0.02, 0.98])
    f, b = scene.level.view.f_px, scene.level.baseline_m
    d = piece.at(ends) if piece.circle is None else np.full(2, piece.offset_px)
    if np.any(~(d > 0.5)):
        return None
    depth = f * b / d
    plan = np.stack([ends * depth / f, depth], axis=1)
    at = np.nan_to_num(piece.at(x), nan=piece.offset_px)
    drop: FloatArray = scene.level.y_px[rows, columns] * b / at
    low, high = np.quantile(drop, [0.02, 0.98])
    return _Size(
        width_m=float(np.linalg.norm(plan[1] - plan[0])), height_m=float(high - low),
    )  # fmt: skip


def neutral_of(pair: RectifiedPair) -> FloatArray | None:
    """Return what the greyer half of the photo averages to (3,), mean 1; None where it is black or has no colour.

    A warm evening then doesn't turn walls to wood.
    """
    if is_grey(pair.left):
        return None
    small = (
        cv2.resize(pair.left, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA).reshape(-1, 3).astype(np.float64)
    )
    small = small[small.max(axis=1) > 20.0]
    if len(small) < 50:
        return None
    greyest = small[np.argsort(_chroma(small))[: len(small) // 2]]
    neutral = greyest.mean(axis=0)
    return np.asarray(np.clip(neutral / neutral.mean(), 0.85, 1.18), dtype=np.float64)


def _concrete_score(pair: RectifiedPair, mask: BoolArray, neutral: FloatArray | None, most_chroma: float) -> float:
    """Return 0..1: how grey the mask's pixels are against the photo's own neutral (3,); 0 is no concrete.

    A photo without colour says nothing of that: 0.5.
    """
    spots = np.flatnonzero(mask)
    pixels = pair.left.reshape(-1, 3)[spots[:: max(1, len(spots) // 4000)]].astype(np.float64)
    if neutral is None or len(pixels) < 20:
        return 0.5
    chroma = float(np.median(_chroma(pixels / neutral)))
    return float(np.clip(1.0 - chroma / most_chroma, 0.0, 1.0))


def _chroma(pixels: FloatArray) -> FloatArray:
    largest = np.maximum(pixels.max(axis=1), 1.0)
    chroma: FloatArray = (largest - pixels.min(axis=1)) / largest
    return chroma
