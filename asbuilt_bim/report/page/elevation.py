"""Each observed design face drawn from outside: what is built, open and unknown of it."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, ProgressReport
from asbuilt_bim.report.wording.values import area, number

UNITS_PER_M = 100.0  # path data in centimetres: whole numbers are fine enough to look at


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceDrawing:
    """SVG paths of one face in centimetres, y downwards; `outline` is what was measured."""

    title: str
    caption: str
    width: float
    height: float
    exposed: str
    built: str
    open: str
    outline: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementDrawing:
    """An element and the drawings of its faces; `hidden` faces were not seen at all."""

    element: ElementProgress
    faces: tuple[FaceDrawing, ...]
    hidden: int


def element_drawings(report: ProgressReport) -> tuple[ElementDrawing, ...]:
    """Draw the faces of every element of which something was decided, or of which there is something to say."""
    by_element: dict[str, list[DesignFaceRecord]] = {}
    for face in report.faces:
        by_element.setdefault(face.element, []).append(face)
    drawings = []
    order = {storey.key: index for index, storey in enumerate(report.storeys)}
    key = partial(_place, order)
    for element in sorted(report.elements, key=key):
        faces = by_element.get(element.global_id, [])
        shown = [face for face in faces if face.surface.built_uv_m or face.surface.open_uv_m]
        if shown or element.notes:
            drawn = tuple(_drawing(index + 1, face) for index, face in enumerate(shown))
            drawings.append(ElementDrawing(element=element, faces=drawn, hidden=len(faces) - len(shown)))
    return tuple(drawings)


def _place(order: dict[str, int], element: ElementProgress) -> tuple[int, str, str, str]:
    """Return where an element stands in the lists: by storey from below, class and name."""
    return (order.get(element.storey, len(order)), element.ifc_class, element.name, element.global_id)


def _drawing(index: int, face: DesignFaceRecord) -> FaceDrawing:
    """Draw one face."""
    surface = face.surface
    corners = np.vstack([polygon[0] for polygon in face.exposed_uv_m if polygon])
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = (float(size) for size in np.maximum(high - low, 0.01))
    seen = surface.built_area_m2 + surface.open_area_m2
    sigma = float(np.hypot(surface.as_built_sigma_calibration_m2, surface.as_built_sigma_image_m2))
    caption = f"seen {number(seen)} of {number(face.exposed_area_m2)} m², built {number(surface.built_area_m2)} m²"
    if surface.as_built_area_m2 is not None:
        caption += f", measured {area(surface.as_built_area_m2, sigma)}"
    if surface.conflict_area_m2 > 0.005:
        caption += f", {number(surface.conflict_area_m2)} m² in conflict"
    return FaceDrawing(
        title=f"{'lateral surface' if face.kind == 'cylinder' else face.role} {index}",
        caption=caption,
        width=width * UNITS_PER_M,
        height=height * UNITS_PER_M,
        exposed=_path(face.exposed_uv_m, low, height),
        built=_path(surface.built_uv_m, low, height),
        open=_path(surface.open_uv_m, low, height),
        outline=_path(surface.outline_uv_m, low, height),
    )


def _path(region: Region, low_m: FloatArray, height_m: float) -> str:
    """Return a region as SVG path data, its lower left corner at `low_m`."""
    parts = []
    for ring in (ring for polygon in region for ring in polygon if len(ring) >= 3):
        shifted = (np.asarray(ring) - low_m) * UNITS_PER_M
        shifted[:, 1] = height_m * UNITS_PER_M - shifted[:, 1]
        parts.append("M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in shifted) + "Z")
    return "".join(parts)
