"""A photo made into a network's input, and the way back: where each of the photo's pixels lies in the input."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array
from asbuilt_bim.vision.networks.card import InputCard


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Where a photo lies in the input: `input = (photo + 0.5) * scale - 0.5 + offset` in pixels."""

    scale_x: float
    scale_y: float
    offset_x_px: float
    offset_y_px: float
    photo_size: tuple[int, int]  # (width, height)
    input_size: tuple[int, int]

    def to_photo(self, small: Float32Array, step_x: float, step_y: float) -> Float32Array:
        """Carry a map of the input, each of whose values spans (step_x, step_y) input pixels, to the photo's size.

        Bilinear, in float32 (H, W); pixels beyond the map's border take the border's value.
        """
        width, height = self.photo_size
        columns = ((np.arange(width) + 0.5) * self.scale_x + self.offset_x_px) / step_x - 0.5
        rows = ((np.arange(height) + 0.5) * self.scale_y + self.offset_y_px) / step_y - 0.5
        across = np.broadcast_to(columns.astype(np.float32), (height, width))
        down = np.broadcast_to(rows.astype(np.float32)[:, None], (height, width))
        return np.asarray(
            cv2.remap(small, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32
        )

    def to_input(self, labels: NDArray[np.int16], outside: int) -> NDArray[np.int16]:
        """Carry labels (H, W) of the photo to the input's size, the nearest to each pixel; `outside` beside it."""
        width, height = self.input_size
        columns = np.floor((np.arange(width) + 0.5 - self.offset_x_px) / self.scale_x).astype(np.intp)
        rows = np.floor((np.arange(height) + 0.5 - self.offset_y_px) / self.scale_y).astype(np.intp)
        across, down = (columns >= 0) & (columns < labels.shape[1]), (rows >= 0) & (rows < labels.shape[0])
        found = np.full((height, width), outside, dtype=np.int16)
        found[np.ix_(down, across)] = labels[np.ix_(rows[down], columns[across])]
        return found

    def part_to_photo(
        self, small: Float32Array, box: Sequence[int], step: tuple[float, float]
    ) -> tuple[slice, slice, Float32Array]:
        """Carry a map's part within a box (x, y, width, height), and a pixel around it, to the photo: as `to_photo`.

        Return the photo's rows and columns, and their values.
        """
        x, y, width, height = box
        factor = np.array([self.scale_x / step[0], self.scale_y / step[1]])  # of the map's pixels to the photo's
        offset = np.array([self.offset_x_px / step[0], self.offset_y_px / step[1]])
        low = np.floor((np.array([x - 1, y - 1]) - offset) / factor).astype(int)
        low = np.clip(low, 0, np.array(self.photo_size) - 1)  # a part may lie beside the photo, where it was padded
        high = np.ceil((np.array([x + width + 1, y + height + 1]) - offset) / factor).astype(int)
        high = np.clip(high, low + 1, self.photo_size)
        turn = np.zeros((2, 3))
        turn[:, :2] = np.diag(factor)
        turn[:, 2] = (low + 0.5) * factor + offset - 0.5
        raised = cv2.warpAffine(
            small, turn, (high - low).tolist(), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        return slice(low[1], high[1]), slice(low[0], high[0]), np.asarray(raised, dtype=np.float32)

    def boxes_to_photo(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Carry boxes (N, 4) as x0, y0, x1, y1, in input pixels counted from the picture's corner, to the photo."""
        offset = np.array([self.offset_x_px, self.offset_y_px] * 2)
        return np.asarray((boxes - offset) / np.array([self.scale_x, self.scale_y] * 2))


def input_of(image: ByteImage, card: InputCard) -> tuple[NDArray[np.float32], Fit]:
    """Return the input array of a BGR photo (H, W, 3), in the card's order and size, and how the photo lies in it."""
    height, width = image.shape[:2]
    fit = _fit((width, height), card)
    inside = (max(1, round(width * fit.scale_x)), max(1, round(height * fit.scale_y)))
    shrunk = inside[0] < width or inside[1] < height
    small = cv2.resize(image, inside, interpolation=cv2.INTER_AREA if shrunk else cv2.INTER_LINEAR)
    values = np.full((3, card.height_px, card.width_px), card.pad_value, dtype=np.float32)
    x, y = round(fit.offset_x_px), round(fit.offset_y_px)
    colours = cv2.split(small)
    for plane, colour, mean, std in zip(
        values, colours[::-1] if card.colour == "rgb" else colours, card.mean, card.std, strict=True
    ):
        plane[y : y + inside[1], x : x + inside[0]] = colour
        plane *= np.float32(1.0 / (card.divide * std))
        plane -= np.float32(mean / std)
    ordered = values.transpose(1, 2, 0) if card.order == "nhwc" else values
    batched = ordered if card.order == "chw" else ordered[None]
    return np.ascontiguousarray(batched, dtype=np.float32), fit


def _fit(size: tuple[int, int], card: InputCard) -> Fit:
    width, height = size
    if card.resize == "stretch":
        inside = (card.width_px, card.height_px)
    else:
        scale = min(card.width_px / width, card.height_px / height)
        inside = (max(1, round(width * scale)), max(1, round(height * scale)))
    centred = card.resize == "letterbox"
    return Fit(
        scale_x=inside[0] / width, scale_y=inside[1] / height,
        offset_x_px=float((card.width_px - inside[0]) // 2 if centred else 0),
        offset_y_px=float((card.height_px - inside[1]) // 2 if centred else 0),
        photo_size=size, input_size=(card.width_px, card.height_px),
    )  # fmt: skip
