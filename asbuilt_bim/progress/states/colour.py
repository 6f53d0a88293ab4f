"""Whether what stands there has the colour of concrete: timber, rusty steel, bricks, plants and paint haven't."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.photo.quality import clipped
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.measure.station import StationMeasurement

DARK = 12.0
"""Lightness (0..100) under which colour is noise and isn't judged."""

BLACK = 16.0
"""CIE Lab's lightness is 16 too low to go with (a, b): only (a, b) / (lightness + 16) stays the same in weaker light.
By lightness alone, concrete in deep shade would look twice as tinted as in the sun."""

OTHER_COLOUR = 0.18
"""Distance in (a, b) / (lightness + 16) from the station's concrete. Concrete in sun and shade differs by 0.15 at most;
fresh timber, formwork ply and rust lie 0.25 to 0.8 away, bricks 0.4, plants 0.3 and more."""

MOST_TINT = 0.12
"""A station's concrete is taken as grey where it looks more tinted than the light of a day can make it."""

BLUR_PX = 5
"""A colour is the mean over this many pixels of the picture: JPEG stores chroma at half its resolution."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConcreteColour:
    """A station's picture as (a, b) / (lightness + 16) (h, w, 2), NaN where too dark; what concrete looks like (2,).

    It is NaN where the picture is clipped, too. `scale` is picture pixels per rectified pixel.
    """

    tint: Float32Array
    concrete: FloatArray
    scale: float

    def fits(self, pixels: FloatArray) -> BoolArray:
        """Say which rectified pixels (N, 2) could be concrete; dark ones and those out of the frame could."""
        height, width = self.tint.shape[:2]
        with np.errstate(invalid="ignore"):
            at = np.floor((pixels + 0.5) * self.scale)
            inside = np.all((at >= 0) & (at < [width, height]), axis=1)
        column, row = np.where(inside[:, None], at, 0).astype(int).T
        away = np.linalg.norm(self.tint[row, column] - self.concrete, axis=1)
        could: BoolArray = ~inside | ~(away > OTHER_COLOUR)
        return could


def concrete_colour(station: StationMeasurement, matched: Iterable[str]) -> ConcreteColour | None:
    """Learn what concrete looks like at a station from its matched faces (ids); None where there is no picture."""
    data = np.frombuffer(station.thumbnail_jpeg, dtype=np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if image is None:
        return None
    soft = cv2.blur(image.astype(np.float32) / np.float32(255.0), (BLUR_PX, BLUR_PX))
    lab = cv2.cvtColor(soft, cv2.COLOR_BGR2Lab)
    with np.errstate(divide="ignore", invalid="ignore"):
        shown = (lab[..., :1] >= DARK) & ~clipped(np.asarray(image, dtype=np.uint8))[..., None]
        tint = np.where(shown, lab[..., 1:] / (lab[..., :1] + BLACK), np.nan).astype(np.float32)
    scale = image.shape[1] / station.camera.width_px
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    wanted = set(matched)
    for face in station.faces:
        if face.face_id in wanted:
            rings = [np.round((ring + 0.5) * scale - 0.5).astype(np.int32) for ring in face.outline_px]
            cv2.fillPoly(mask, rings, 255)
    own = tint[(mask > 0) & np.isfinite(tint[..., 0])]
    concrete = np.median(own, axis=0).astype(np.float64) if len(own) else np.zeros(2)
    if np.linalg.norm(concrete) > MOST_TINT:
        concrete = np.zeros(2)
    return ConcreteColour(tint=tint, concrete=concrete, scale=scale)
