"""Reads the layout `centres`: a class for each pixel and an arrow to its thing's middle become things with masks."""

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array
from asbuilt_bim.vision.networks.card import Meaning, NetworkCard
from asbuilt_bim.vision.networks.centres import Groups, grouped
from asbuilt_bim.vision.networks.detection import Outputs, Sighting, refuse_unknown_ids, wrong_shapes
from asbuilt_bim.vision.networks.layers import layers
from asbuilt_bim.vision.networks.map_geometry import Relief
from asbuilt_bim.vision.networks.part_affinity import joined
from asbuilt_bim.vision.networks.parts import Part, described, gaps, numbered_parts
from asbuilt_bim.vision.networks.picture import Fit

LEAST_LIKELY = 1e-3
"""A likelihood counts as no less: a few sure pixels mustn't decide for a whole thing."""

FURTHEST = 100
"""Sides of the map that an arrow may be long: a middle lies in the picture or near it; what is far off is damaged."""


def read_instances(outputs: Outputs, card: NetworkCard, fit: Fit, relief: Relief | None) -> list[Sighting]:
    """Read logits (1, C, h, w) and offsets (1, 2, h, w): to the middle of the thing, in units of the card's pixels.

    The class of a wall or column is decided for the whole thing; with `class_by: pixel` each pixel has its own, and the
    thing is divided. Classes that are something else give one sighting each, over all their pixels. `relief` of
    the network's input, if there is stereo, tells apart what stands one behind the other and joins what runs on.

    Raises:
        NetworkError: the outputs haven't these shapes or the card's classes, or offsets point beyond all bounds.
    """
    logits, offsets = outputs["logits"], outputs["offsets"]
    fits = logits.ndim == offsets.ndim == 4 and len(logits) == len(offsets) == 1 and offsets.shape[1] == 2
    if not fits or logits.shape[2:] != offsets.shape[2:] or logits.shape[1] < 2 or min(logits.shape[2:]) < 8:
        raise wrong_shapes(card, outputs, "logits (1, C, h, w) with two classes or more, offsets (1, 2, h, w)")
    refuse_unknown_ids(card, logits.shape[1])
    likely = _likelihoods(logits[0].astype(np.float32))
    step = (fit.input_size[0] / likely.shape[2], fit.input_size[1] / likely.shape[1])
    wall, column = (likely[_numbers(card, meaning)].sum(axis=0) for meaning in ("wall", "column"))
    inside = wall + column - np.float32(0.5)
    arrows = offsets[0] * (card.offset_px / np.array(step)[:, None, None])
    if (furthest := float(np.abs(arrows).max())) > FURTHEST * max(arrows.shape):
        raise NetworkError(
            f"network {card.name}: an offset points {furthest:.3g} cells away, on a map of {arrows.shape[2]} x "
            f"{arrows.shape[1]} (limit {FURTHEST} of its sides); correct offset_px in the card, or export it again"
        )
    small = relief.shrunk(inside.shape) if relief is not None else None
    groups = _of_parts(grouped(inside > 0.0, arrows.astype(np.float32)), arrows.astype(np.float32), wall, column, small)
    if card.class_by == "pixel":
        groups = groups.renumbered(np.where(groups.number >= 0, 2 * groups.number + (column > wall), -1))
    leads = groups.lead()
    found = _others(likely, card, fit, step)
    for thing, lead in enumerate(leads):
        own = groups.number == thing
        number, score = _verdict(likely[:, own], card)
        if score >= card.least_score:
            border = np.where(inside > 0.0, np.minimum(inside, np.clip(lead, -0.5, 0.5)), inside)
            found.append(Sighting(number=number, score=score, mask=_raised(border, own, fit, step)))
    return found


def _numbers(card: NetworkCard, meaning: Meaning) -> list[int]:
    return [one.id for one in card.classes if one.label == meaning]


def _likelihoods(logits: Float32Array) -> Float32Array:
    raised = np.exp(logits - logits.max(axis=0))
    return np.asarray(raised / raised.sum(axis=0), dtype=np.float32)


def _of_parts(
    groups: Groups, arrows: Float32Array, wall: Float32Array, column: Float32Array, relief: Relief | None
) -> Groups:
    """Return things cut to parts, and these joined by the odds that they are one instance."""
    number, parts = parts_of(groups, arrows, wall, column, relief)
    group = joined(parts, gaps(number, len(parts)), relief.f_px if relief is not None else 1.0)
    return groups.renumbered(np.append(group, -1)[number].astype(np.int32))


def parts_of(
    groups: Groups, arrows: Float32Array, wall: Float32Array, column: Float32Array, relief: Relief | None
) -> tuple[NDArray[np.int32], list[Part]]:
    """Return the parts of things that are of one surface and one class: their numbers (h, w), and what they are like.

    `arrows` (2, h, w) point to the middle of each pixel's thing, in pixels; `wall` and `column` (h, w) are likelihoods.
    """
    number = groups.number if relief is None else layers(groups.number, relief.inverse_depth_per_m)
    key = 2 * number + (column > wall)
    if relief is not None and relief.surface is not None:
        key = key * (int(relief.surface.max()) + 2) + relief.surface + 1
    number = numbered_parts(np.where(number >= 0, key, -1).astype(np.int32))
    height, width = number.shape
    votes = arrows + np.stack(np.meshgrid(np.arange(width), np.arange(height))).astype(np.float32)
    against = np.log(np.maximum(wall, LEAST_LIKELY)) - np.log(np.maximum(column, LEAST_LIKELY))
    return number, described(number, votes, against, relief)


def _verdict(likely: Float32Array, card: NetworkCard) -> tuple[int, float]:
    """Return the class number of a thing with these likelihoods (C, M) at its pixels, and a score 0..1.

    Wall or column is decided by the mean of the likelihoods' logarithms. The score is how sure the network is that the
    pixels are one or the other, less at most a quarter where it isn't sure of which.
    """
    walls, columns = _numbers(card, "wall"), _numbers(card, "column")
    as_wall, as_column = likely[walls].sum(axis=0), likely[columns].sum(axis=0)
    against = float(np.mean(np.log(np.maximum(as_wall, LEAST_LIKELY)) - np.log(np.maximum(as_column, LEAST_LIKELY))))
    number = max(walls if against >= 0.0 and walls else columns or walls, key=lambda k: float(likely[k].mean()))
    certain = 1.0 / (1.0 + float(np.exp(-abs(against))))
    return number, float((as_wall + as_column).mean()) * (0.5 + 0.5 * certain)


def _raised(border: Float32Array, own: BoolArray, fit: Fit, step: tuple[float, float]) -> BoolArray:
    """Return where over the photo a small map, looked at around its pixels `own`, is positive."""
    mask = np.zeros(fit.photo_size[::-1], dtype=bool)
    rows, columns, raised = fit.part_to_photo(border, cv2.boundingRect(own.view(np.uint8)), step)
    mask[rows, columns] = raised > 0.0
    return mask


def _others(likely: Float32Array, card: NetworkCard, fit: Fit, step: tuple[float, float]) -> list[Sighting]:
    """Return a sighting of each class that is something else, over all the pixels where it is the likeliest."""
    best = likely.argmax(axis=0)
    found: list[Sighting] = []
    for number in _numbers(card, "other"):
        own = best == number
        if own.any():
            lead = likely[number] - np.delete(likely, number, axis=0).max(axis=0)
            score = float(likely[number][own].mean())
            found.append(Sighting(number=number, score=score, mask=_raised(lead, own, fit, step)))
    return found
