"""What the families of segmenters answer, all read as scored masks over the whole photo.

Each reader takes a network's outputs by role and gives its `Sighting`s; a wrong shape is refused by name.
"""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array
from asbuilt_bim.vision.networks.card import NetworkCard
from asbuilt_bim.vision.networks.detection import Outputs, Sighting, refuse_unknown_ids, wrong_shapes
from asbuilt_bim.vision.networks.instances import read_instances
from asbuilt_bim.vision.networks.map_geometry import Relief
from asbuilt_bim.vision.networks.picture import Fit

_ROUNDING = 1e-3  # of a half-precision likelihood
SHARES = 2.0
"""What boxes in shares of a picture stay below, also those that reach beyond its border."""


def read_sightings(outputs: Outputs, card: NetworkCard, fit: Fit, relief: Relief | None = None) -> list[Sighting]:
    """Read a segmenter's outputs by its card's layout; only classes that the card names, the surest first.

    `relief` of the input, where there is stereo, helps to tell what is one instance.

    Raises:
        NetworkError: the outputs haven't the shapes of the layout or the card's classes, or scores aren't 0 to 1.
    """
    if card.layout == "centres":
        found = read_instances(outputs, card, fit, relief)
    else:
        found = _READERS[card.layout](outputs, card, fit)
    return sorted((s for s in found if s.mask.any()), key=lambda s: -s.score)[: card.most_instances]


def _mask_rcnn(outputs: Outputs, card: NetworkCard, fit: Fit) -> list[Sighting]:
    """Boxes (N, 4) in input pixels, labels, scores (N,), masks (N, 1, H, W) of the input or (N, 1, m, m) of the box.

    Reference: He et al. 2017, Mask R-CNN; exports of torchvision (masks pasted) and Detectron2 (28 x 28 of the box).
    """
    boxes, labels, scores = outputs["boxes"], outputs["labels"].ravel(), outputs["scores"].ravel()
    masks = outputs["masks"]
    masks = masks[:, 0] if masks.ndim == 4 and masks.shape[1] == 1 else masks
    n = len(scores)
    if boxes.shape != (n, 4) or labels.shape != (n,) or masks.ndim != 3 or len(masks) != n:
        raise wrong_shapes(card, outputs, "boxes (N, 4), labels (N,), scores (N,), masks (N, 1, h, w)")
    pasted = masks.shape[1:] == (fit.input_size[1], fit.input_size[0])
    found: list[Sighting] = []
    chosen = _chosen(scores, labels, card)
    _refuse_shares(boxes[chosen], card)
    for k in chosen:
        if pasted:
            mask = fit.to_photo(masks[k].astype(np.float32), 1.0, 1.0) > 0.5
        else:
            mask = _pasted(masks[k].astype(np.float32), fit.boxes_to_photo(boxes[k : k + 1])[0], fit.photo_size)
        found.append(Sighting(number=int(labels[k]), score=min(float(scores[k]), 1.0), mask=mask))
    return found


def _yolo(outputs: Outputs, card: NetworkCard, fit: Fit) -> list[Sighting]:
    """Predictions (1, 4 + classes + m, N): centre, size, class scores, mask coefficients; prototypes (1, m, h, w).

    Reference: Bolya et al. 2019, YOLACT (masks from prototypes), in the layout that Ultralytics exports.
    """
    predictions, prototypes = outputs["predictions"], outputs["prototypes"]
    wanted = "predictions (1, 4 + classes + m, N) without NMS, prototypes (1, m, h, w)"
    if predictions.ndim != 3 or prototypes.ndim != 4 or len(predictions) != 1 or len(prototypes) != 1:
        raise wrong_shapes(card, outputs, wanted)
    table, planes = predictions[0].T, prototypes[0]
    classes = table.shape[1] - 4 - len(planes)
    if classes < 1 or table.shape[1] > len(table):  # there are thousands of places: these lie turned
        raise wrong_shapes(card, outputs, wanted)
    refuse_unknown_ids(card, classes)
    scores, numbers = table[:, 4 : 4 + classes].max(axis=1), table[:, 4 : 4 + classes].argmax(axis=1)
    half = 0.5 * table[:, 2:4]
    boxes = np.concatenate([table[:, :2] - half, table[:, :2] + half], axis=1)
    known = _chosen(scores, numbers, card)
    _refuse_shares(boxes[known], card)
    kept = _without_doubles(boxes, scores, numbers, known, card.most_overlap)
    step = (fit.input_size[0] / planes.shape[2], fit.input_size[1] / planes.shape[1])
    found: list[Sighting] = []
    for k in kept[: card.most_instances]:
        logits = np.tensordot(table[k, 4 + classes :], planes, axes=1).astype(np.float32)
        mask = (fit.to_photo(logits, *step) > 0.0) & _inside(fit.boxes_to_photo(boxes[k : k + 1])[0], fit.photo_size)
        found.append(Sighting(number=int(numbers[k]), score=min(float(scores[k]), 1.0), mask=mask))
    return found


def _query(outputs: Outputs, card: NetworkCard, fit: Fit) -> list[Sighting]:
    """Logits (1, Q, C) and mask logits (1, Q, h, w), one query one instance; with softmax the last class is "nothing".

    Reference: Cheng et al. 2022, Mask2Former; RF-DETR's segmentation head gives the same two, with sigmoid scores.
    """
    logits, masks = outputs["logits"], outputs["masks"]
    if logits.ndim != 3 or masks.ndim != 4 or len(logits) != 1 or masks.shape[:2] != logits.shape[:2]:
        raise wrong_shapes(card, outputs, "logits (1, Q, C), masks (1, Q, h, w)")
    likely = _likely(logits[0], card.activation)
    likely = likely[:, :-1] if card.activation == "softmax" else likely
    refuse_unknown_ids(card, likely.shape[1])
    scores, numbers = likely.max(axis=1), likely.argmax(axis=1)
    step = (fit.input_size[0] / masks.shape[3], fit.input_size[1] / masks.shape[2])
    return [
        Sighting(
            number=int(numbers[k]), score=float(scores[k]),
            mask=fit.to_photo(masks[0, k].astype(np.float32), *step) > 0.0,
        )
        for k in _chosen(scores, numbers, card)
    ]  # fmt: skip


def _semantic(outputs: Outputs, card: NetworkCard, fit: Fit) -> list[Sighting]:
    """Logits (1, C, h, w): a class a pixel, no instances; geometry divides what is named here into pieces.

    Each class gives one sighting over all its pixels, its score the mean likelihood there.
    """
    logits = outputs["logits"]
    if logits.ndim != 4 or len(logits) != 1 or logits.shape[1] < 2 or _stretched(logits.shape, fit):
        raise wrong_shapes(card, outputs, "logits (1, C, h, w) with two classes or more")
    refuse_unknown_ids(card, logits.shape[1])
    step = (fit.input_size[0] / logits.shape[3], fit.input_size[1] / logits.shape[2])
    full = np.stack([fit.to_photo(plane.astype(np.float32), *step) for plane in logits[0]], axis=-1)
    best = full.argmax(axis=-1)
    found: list[Sighting] = []
    for number in range(logits.shape[1]):
        mask = best == number
        if card.meaning(number) is None or not mask.any():
            continue
        score = float(_likely(full[mask], card.activation)[:, number].mean())
        if score >= card.least_score:
            found.append(Sighting(number=number, score=score, mask=mask))
    return found


def _stretched(shape: tuple[int, ...], fit: Fit) -> bool:
    """Say whether a map (1, C, h, w) isn't of its input's proportions: its classes come last, and w is their number."""
    across, down = fit.input_size[0] / shape[3], fit.input_size[1] / shape[2]
    return max(across, down) > 2.0 * min(across, down)


_READERS: dict[str, Callable[[Outputs, NetworkCard, Fit], list[Sighting]]] = {
    "mask-rcnn": _mask_rcnn,
    "yolo-seg": _yolo,
    "query": _query,
    "semantic": _semantic,
}


def _chosen(scores: NDArray[np.float64], numbers: NDArray[np.generic], card: NetworkCard) -> list[int]:
    """Return which rows score enough and are of a class that the card names, the surest first.

    Raises:
        NetworkError: the scores aren't likelihoods.
    """
    if scores.size and np.abs(scores - 0.5).max() > 0.5 + _ROUNDING:
        raise NetworkError(
            f"network {card.name}: its scores run from {scores.min():.4g} to {scores.max():.4g}, and a score is 0 to "
            "1; export it with its sigmoid or softmax"
        )
    order = np.argsort(-scores, kind="stable")
    return [int(k) for k in order if scores[k] >= card.least_score and card.meaning(int(numbers[k])) is not None]


def _refuse_shares(boxes: NDArray[np.float64], card: NetworkCard) -> None:
    """Refuse boxes (N, 4) that all lie in the picture's first pixels: they are shares of its sides.

    Raises:
        NetworkError: they do.
    """
    if boxes.size and np.abs(boxes).max() <= SHARES:
        raise NetworkError(
            f"network {card.name}: its boxes run to {np.abs(boxes).max():.3g} on an input of {card.input.width_px} x "
            f"{card.input.height_px} px, as shares of it do; export them in pixels of the input"
        )


def _without_doubles(
    boxes: NDArray[np.float64], scores: NDArray[np.float64], numbers: NDArray[np.generic], known: list[int], most: float
) -> list[int]:
    """Keep of boxes of one class that overlap by more than `most` the surest; the surest first."""
    kept: list[int] = []
    for number in sorted({int(numbers[k]) for k in known}):
        own = [k for k in known if int(numbers[k]) == number]
        sides = np.concatenate([boxes[own, :2], boxes[own, 2:] - boxes[own, :2]], axis=1)
        chosen = cv2.dnn.NMSBoxes(sides.tolist(), scores[own].tolist(), 0.0, most)
        kept += [own[int(i)] for i in np.asarray(chosen).ravel()]
    return sorted(kept, key=lambda k: -scores[k])


def _likely(logits: NDArray[np.generic], activation: str) -> NDArray[np.float64]:
    values = np.asarray(logits, dtype=np.float64)
    if activation == "sigmoid":
        return np.asarray(1.0 / (1.0 + np.exp(-np.clip(values, -60.0, 60.0))))
    raised = np.exp(values - values.max(axis=-1, keepdims=True))
    return np.asarray(raised / raised.sum(axis=-1, keepdims=True))


def _inside(box: NDArray[np.float64], size: tuple[int, int]) -> BoolArray:
    """Say which pixels (H, W) have their centre in a box."""
    columns, rows = np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5
    across = (columns >= box[0]) & (columns <= box[2])
    inside: BoolArray = ((rows >= box[1]) & (rows <= box[3]))[:, None] & across[None, :]
    return inside


def _pasted(small: Float32Array, box: NDArray[np.float64], size: tuple[int, int]) -> BoolArray:
    """Lay a mask of a box's own grid (m, m) over the photo."""
    width, height = max(box[2] - box[0], 1e-6), max(box[3] - box[1], 1e-6)
    columns = ((np.arange(size[0]) + 0.5 - box[0]) / width * small.shape[1] - 0.5).astype(np.float32)
    rows = ((np.arange(size[1]) + 0.5 - box[1]) / height * small.shape[0] - 0.5).astype(np.float32)
    across = np.broadcast_to(columns, (size[1], size[0]))
    down = np.broadcast_to(rows[:, None], (size[1], size[0]))
    full = cv2.remap(small, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    mask: BoolArray = (np.asarray(full) > 0.5) & _inside(box, size)
    return mask
