"""People in pictures that leave the program: made unrecognisable where a network by card finds them."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage
from asbuilt_bim.vision.masks.segment import Blurrer, Segmenter

CELLS = 12
"""Cells across a person's own height: a face has one or two of them, and nobody is known by two grey squares."""
MARGIN_SHARE = 0.04
"""Of a person's height: masks end short of hair and hands."""


def without_people(image: ByteImage, segmenter: Segmenter | None) -> ByteImage:
    """Return a BGR picture with the people in coarse cells that a segmenter finds; itself where it looks for none."""
    if not isinstance(segmenter, Blurrer):
        return image
    people = segmenter.people(image)
    return image if people is None or not people.any() else pixelated(image, people)


def pixelated(image: ByteImage, people: BoolArray) -> ByteImage:
    """Return a picture whose pixels of `people` (H, W) are the means of cells, twelve to a figure."""
    found = image.copy()
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(people.astype(np.uint8))
    for number in range(1, count):
        x, y, width, height = (int(side) for side in boxes[number, :4])
        margin = max(1, round(MARGIN_SHARE * height))
        x0, y0 = max(0, x - margin), max(0, y - margin)
        x1, y1 = min(image.shape[1], x + width + margin), min(image.shape[0], y + height + margin)
        cell = max(2, round(max(height, width) / CELLS))
        own = (labels[y0:y1, x0:x1] == number).astype(np.uint8)
        own = cv2.dilate(own, np.ones((2 * margin + 1, 2 * margin + 1), np.uint8))
        part = image[y0:y1, x0:x1]
        small = cv2.resize(part, (max(1, (x1 - x0) // cell), max(1, (y1 - y0) // cell)), interpolation=cv2.INTER_AREA)
        coarse = cv2.resize(small, (x1 - x0, y1 - y0), interpolation=cv2.INTER_NEAREST)
        found[y0:y1, x0:x1][own > 0] = coarse[own > 0]
    return found
