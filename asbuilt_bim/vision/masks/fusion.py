"""A network's masks and the geometry of the depth: two opinions on what stands in a photo, brought together.

The surfaces of the scene are the pieces that both refer to. A network that covers most of a piece says what it is.
Whether that can be is checked: walls and columns are upright planes or cylinders of a wall's or a column's size.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, freeze
from asbuilt_bim.vision.masks.given import box_of
from asbuilt_bim.vision.masks.refinement import refined_mask
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource, Refuter, Segmenter, SurfaceSegmenter
from asbuilt_bim.vision.scene.geometric import (
    GeometricOptions,
    Opinion,
    instance_of_pieces,
    neutral_of,
    of_concretes_colour,
    piece_groups,
)
from asbuilt_bim.vision.scene.read import Scene
from asbuilt_bim.vision.stereo.depth import DepthMap

HOLDS = 0.5
"""An opinion is about a piece when it covers at least this share of the piece's pixels."""
ALONE = 0.5
"""What geometry says and the network doesn't is one opinion of two: half as sure."""
LEAST_SEEN_PX = 2000
"""A network's instance of fewer pixels without a surface under it isn't worth a word."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Agreed:
    """The instances of both opinions, each with its source, and what only one found and could not be measured."""

    instances: tuple[Instance, ...]
    notes: tuple[Rejection, ...]


def agree(
    pair: RectifiedPair, scene: Scene, depth: DepthMap | None, network: Segmenter, options: GeometricOptions
) -> Agreed:
    """Bring a network's instances and the scene's upright pieces together.

    - Both: the network covers a piece that has a wall's or column's size. The class is decided for the instance: a
      round or a wide one by its metres, a slender one by the network.
    - Geometry alone: no opinion covers the piece; it stands if it would stand without a network.
    - The network alone: it sees concrete where no upright surface was found; that is noted, for without a surface
      there is no area.
    - A network that says "this is something else" (formwork, a hoarding) is believed: unknown is no harm, a wrong
      wall is. One that knows nothing but that has no opinion on the rest: it is geometry's, as without a network.
    - What stereo measures as level is no wall, whatever the network says: its pixels are taken off.
    """
    seen = _seen(pair, scene, depth, network)
    others = network.refuted(pair) if isinstance(network, Refuter) else ()
    knows_concrete = getattr(network, "finds_concrete", True)
    held = _holders(scene, [*(one.mask for one in seen), *others])
    found: list[Instance] = []
    coloured: list[Instance] = []
    spoken: set[int] = set()
    neutral = neutral_of(pair)
    taken = np.zeros(scene.labels.shape, dtype=bool)
    for group in _groups(piece_groups(scene.pieces), held, getattr(network, "finds_things", True)):
        holder = held[group[0]]
        if holder is not None and holder >= len(seen):
            continue
        opinion = Opinion(label=seen[holder].label, score=seen[holder].score) if holder is not None else None
        instance = instance_of_pieces(pair, scene, group, options, neutral, opinion)
        if instance is None:
            continue
        if holder is None and instance.score <= 0.0:
            coloured.append(instance)
            continue
        if holder is not None:
            spoken.add(holder)
            instance = _refined_mask(instance, seen[holder], pair, scene, taken)
            instance = replace(instance, source=InstanceSource.BOTH, segmenter=network.name)
        elif knows_concrete:
            instance = replace(instance, source=InstanceSource.GEOMETRY_ALONE, score=ALONE * instance.score)
        taken |= instance.mask
        found.append(instance)
    found.sort(key=lambda instance: -int(np.count_nonzero(instance.mask)))
    _, notes = of_concretes_colour(coloured, pair.name)
    if found and not seen and knows_concrete:
        station = about(SubjectKind.STATION, pair.name)
        notes = (*notes, rejected(Reason.NETWORK_SAW_NOTHING, station, segmenter=network.name))
    return Agreed(instances=tuple(found), notes=(*_alone(pair, seen, spoken, network.name), *notes))


def _seen(pair: RectifiedPair, scene: Scene, depth: DepthMap | None, network: Segmenter) -> list[Instance]:
    """Return the network's instances, without what stereo measures as level."""
    on_surfaces = network if isinstance(network, SurfaceSegmenter) else None
    seen = on_surfaces.segment_on(pair, depth, scene) if on_surfaces else network.segment(pair, depth)
    return upright_alone(seen, (scene.labels >= len(scene.pieces)) & (scene.labels < scene.bars_label))


def upright_alone(seen: Sequence[Instance], level: BoolArray) -> list[Instance]:
    """Return a network's instances without what stereo measures as `level` (H, W); what is all level is left out."""
    found: list[Instance] = []
    for one in seen:
        mask = one.mask & ~level
        if np.array_equal(mask, one.mask):
            found.append(one)
        elif mask.any():
            freeze(mask)
            found.append(replace(one, mask=mask, box_px=box_of(mask)))
    return found


def _holders(scene: Scene, masks: Sequence[BoolArray]) -> list[int | None]:
    """Return for each piece the number of the mask that covers most of it, None where none covers enough."""
    count = len(scene.pieces)
    if not masks:
        return [None] * count
    covered = np.zeros((len(masks), count))
    upright = (scene.labels >= 0) & (scene.labels < count)
    for row, mask in enumerate(masks):
        covered[row] = np.bincount(scene.labels[mask & upright], minlength=count)[:count]
    shares = covered / np.maximum(scene.sizes, 1)
    best = shares.argmax(axis=0)
    return [int(best[k]) if shares[best[k], k] >= HOLDS else None for k in range(count)]


def _groups(groups: Sequence[Sequence[int]], held: Sequence[int | None], things: bool) -> list[list[int]]:
    """Return pieces by what holds them: a thing across what stands between, a map's class within geometry's groups."""
    found: list[list[int]] = []
    of_thing: dict[int, list[int]] = {}
    for group in groups:
        of_thing = of_thing if things else {}
        before: int | None = None
        for number in group:
            holder = held[number]
            if holder is not None and holder not in of_thing:
                found.append(of_thing.setdefault(holder, []))
            elif holder is None and before != number - 1:
                found.append([])
            if holder is not None:
                of_thing[holder].append(number)
            else:
                found[-1].append(number)
                before = number
    return found


def _refined_mask(instance: Instance, other: Instance, pair: RectifiedPair, scene: Scene, taken: BoolArray) -> Instance:
    """Return an instance with its border where both opinions and the photo's edges say; no other surface is touched."""
    upright = (scene.labels >= 0) & (scene.labels < len(scene.pieces))
    mask = refined_mask(instance.mask, other.mask, pair.left) & (instance.mask | ~upright) & ~taken
    freeze(mask)
    return replace(instance, mask=mask, box_px=box_of(mask)) if mask.any() else instance


def _alone(pair: RectifiedPair, seen: Sequence[Instance], spoken: set[int], name: str) -> tuple[Rejection, ...]:
    """Name the network's instances that no surface of the scene stands under."""
    notes: list[Rejection] = []
    for number, one in enumerate(seen):
        if number in spoken or np.count_nonzero(one.mask) < LEAST_SEEN_PX:
            continue
        x0, y0, x1, y1 = one.box_px
        notes.append(
            rejected(
                Reason.INSTANCE_WITHOUT_SURFACE,
                about(SubjectKind.INSTANCE, f"{one.label} {number + 1}", pair.name),
                label=one.label,
                segmenter=name,
                score=float(one.score),
                x_px=(x0 + x1) // 2,
                y_px=(y0 + y1) // 2,
            )
        )
    return tuple(notes)
