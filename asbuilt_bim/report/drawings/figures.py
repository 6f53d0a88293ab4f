"""The pictures of one measured pair, as the paper shows them: returned, never shown or printed."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.errors import OutputError
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement, seen
from asbuilt_bim.report.drawings.colours import bgr
from asbuilt_bim.report.drawings.figure_depth import depth_figure, flatness_figure
from asbuilt_bim.report.drawings.figure_instance import face_name, instance_figure
from asbuilt_bim.report.drawings.label_placing import Box
from asbuilt_bim.report.drawings.overlay import MAX_WIDTH_PX, draw_layout, narrowed
from asbuilt_bim.report.drawings.overlay_labels import anchor_of, place_label
from asbuilt_bim.report.drawings.overlay_layout import Outline, OverlayLayout
from asbuilt_bim.report.drawings.plot import PALETTE
from asbuilt_bim.report.wording import values as wording

TEXT_SHARE = 1 / 70


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Figure:
    """A picture with its name and what it shows; a notebook shows it by itself."""

    name: str
    caption: str
    image: ByteImage  # (H, W, 3) BGR

    def png(self) -> bytes:
        """Return the picture as PNG bytes, without metadata.

        Raises:
            OutputError: OpenCV can't encode it.
        """
        done, data = cv2.imencode(".png", self.image)
        if not done:
            raise OutputError(f"figure {self.name}: can't be encoded as PNG")
        return data.tobytes()

    def _repr_png_(self) -> bytes:
        """Return what a notebook shows."""
        return self.png()


def figures(found: PairMeasurement) -> tuple[Figure, ...]:
    """Draw a pair's pictures: overlay, masks, depth map, flatness, and one for each wall or column with a face."""
    drawn = [
        Figure(name="overlay", caption="Faces with their areas, and the target", image=overlay(found)),
        Figure(name="masks", caption="The mask of each wall and column", image=masks(found)),
        Figure(name="depth", caption="Depth map: distance along the camera's axis", image=depth_figure(found)),
    ]
    if found.options.method == "default" and found.faces:
        caption = "How far the measured surface lies off each face's plane or cylinder"
        drawn.append(Figure(name="flatness", caption=caption, image=flatness_figure(found)))
    for number in sorted({face.instance for face in found.faces}):
        label = found.detail.instances[number].label
        caption = f"{label} {number + 1}: mask, boundary in pixels, reconstruction in metres"
        drawn.append(Figure(name=f"{label}-{number + 1}", caption=caption, image=instance_figure(found, number)))
    return tuple(drawn)


def colour_of(instance: int) -> str:
    """Return the colour of a wall or column by its number."""
    return PALETTE[instance % len(PALETTE)]


def overlay(found: PairMeasurement) -> ByteImage:
    """Draw the faces with area and sigma, and the target with its distance, on the rectified left photo."""
    pair = found.detail.shown
    image = narrowed(pair.left.copy(), MAX_WIDTH_PX)
    height, width = image.shape[:2]
    scale = width / pair.left.shape[1]
    text_px = max(width * TEXT_SHARE, 11.0)
    taken: list[Box] = []
    labels = []
    disc = None
    if found.target is not None:
        x, y = ((found.target.left_px + 0.5) * scale - 0.5).tolist()
        disc = (x, y, found.target.radius_px * scale)
        taken.append((x - disc[2], y - disc[2], 2 * disc[2], 2 * disc[2]))
        lines = (f"target Z {wording.length(found.target.depth_m)}",)
        at = (x, y + disc[2] + 1.3 * text_px)
        labels.append(place_label(at, lines, text_px, (width, height), taken, leader=False))
    outlines = []
    for face in sorted(found.faces, key=lambda face: -face.area_m2):
        rings = tuple((ring + 0.5) * scale - 0.5 for ring in face.outline_px)
        outlines.append(Outline(rings=rings, colour=colour_of(face.instance), meaning="", dashed=False))
        anchor, _ = anchor_of(rings, width, height)
        if anchor is not None:
            labels.append(place_label(anchor, (face_line(found, face),), text_px, (width, height), taken))
    layout = OverlayLayout(
        width=width, height=height, text_px=text_px, outlines=tuple(outlines), labels=tuple(labels), disc=disc
    )
    return draw_layout(image, layout, wording.plain(pair.name))


def face_line(found: PairMeasurement, face: MeasuredFace) -> str:
    """Write a face's number, class and area, and what speaks against its being the whole."""
    how = seen(face, found.options.method)
    how_seen = "" if how in ("whole", "not checked") else f" ({how})"
    return f"{face_name(face)} ({face.label}): {area_text(found, face.area_m2, face.area_sigma_m2)}{how_seen}"


def area_text(found: PairMeasurement, area_m2: float, sigma_m2: float) -> str:
    """Write an area with its sigma; alone where the method states none."""
    return wording.area(area_m2, sigma_m2 if found.options.method == "default" else None)


def masks(found: PairMeasurement) -> ByteImage:
    """Tint the mask of each wall and column on the rectified left photo."""
    image = found.detail.shown.left.copy()
    for number, instance in enumerate(found.detail.instances):
        colour = np.array(bgr(colour_of(number)), dtype=np.float64)
        x0, y0, x1, y1 = instance.box_px
        part, mask = image[y0:y1, x0:x1], instance.mask[y0:y1, x0:x1]
        part[mask] = np.round(0.5 * part[mask] + 0.5 * colour).astype(np.uint8)
    labels, taken = [], list[Box]()
    image = narrowed(image, MAX_WIDTH_PX)
    height, width = image.shape[:2]
    text_px = max(width * TEXT_SHARE, 11.0)
    for number, instance in enumerate(found.detail.instances):
        rings, _ = cv2.findContours(instance.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        scale = width / instance.mask.shape[1]
        largest = max(rings, key=cv2.contourArea).reshape(-1, 2) * scale
        anchor, _ = anchor_of((largest,), width, height)
        if anchor is not None:
            lines = (f"{instance.label} {number + 1}",)
            labels.append(place_label(anchor, lines, text_px, (width, height), taken))
    layout = OverlayLayout(
        width=width, height=height, text_px=text_px, outlines=(), labels=tuple(labels), disc=None
    )  # fmt: skip
    return draw_layout(image, layout, f"{wording.plain(found.detail.pair.name)}   masks")
