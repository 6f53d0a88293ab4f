"""Tints, and what each says of concrete: as it scatters round what a visit shows, against anything of any colour."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from asbuilt_bim.camera.photo.chroma import is_grey
from asbuilt_bim.camera.photo.quality import clipped
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import StationMeasurement

DARK = 12.0
"""Lightness (0..100) under which colour is noise and isn't judged."""

BLACK = 16.0
"""CIE Lab's lightness is 16 too low to go with (a, b): only (a, b) / (lightness + 16) stays the same in weaker light.
By lightness alone, concrete in deep shade would look twice as tinted as in the sun."""

SCATTER = 0.06
"""Of concrete round its visit's tint, (a, b) / (lightness + 16), one sigma: sun and shade differ by 0.15 at most."""

ANY_TINT = 0.8
"""Timber, ply, rust, bricks, plants and paint lie anywhere within this of grey: fresh timber, formwork ply and rust
0.25 to 0.8 away, bricks 0.4, plants 0.3 and more. With `SCATTER` both are as likely at 0.18 from the concrete."""

OF_ANOTHER = 0.05
"""One face of concrete in twenty is of another colour than its visit's: stained, painted, faced. So colour alone is
worth 20 to 1 against, at most."""

BLUR_PX = 5
"""A colour is the mean over this many pixels of the picture: JPEG stores chroma at half its resolution."""

_PICTURES_KEPT = 8  # at hand, 10 MB each: a visit asks for each of its stations' twice


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Palette:
    """The tints (k, 2) that concrete has at a station, and the sigma with which it scatters round each."""

    tints: FloatArray
    sigma: float

    def log_odds(self, tints: FloatArray) -> FloatArray:
        """Return log p(tint | concrete) / p(tint | anything) of tints (N, 2); NaN where a tint is."""
        away = np.linalg.norm(tints[:, None, :] - self.tints, axis=-1).min(axis=1)
        peak = ANY_TINT**2 / (2.0 * self.sigma**2)
        odds: FloatArray = np.log((1.0 - OF_ANOTHER) * peak * np.exp(-0.5 * (away / self.sigma) ** 2) + OF_ANOTHER)
        return odds

    def with_tints(self, more: FloatArray) -> "Palette":
        """Return it with more tints (k, 2) that are held to be concrete, too."""
        return Palette(tints=np.concatenate([self.tints, more]), sigma=self.sigma) if len(more) else self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceTint:
    """A face's median tint (2,), and the share of its pixels that haven't the colour of concrete."""

    tint: FloatArray
    other_share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConcreteColour:
    """What concrete looks like at a station, and the median tint (2,) of its measured faces, by id."""

    palette: Palette
    faces: Mapping[str, FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TintedPicture:
    """A station's picture as tints (h, w, 2), NaN where too dark or clipped, and picture pixels per rectified pixel."""

    tint: Float32Array
    scale: float

    def fits(self, palette: Palette, pixels: FloatArray) -> BoolArray:
        """Say which rectified pixels (N, 2) could be concrete; dark ones and those out of the frame could."""
        height, width = self.tint.shape[:2]
        with np.errstate(invalid="ignore"):
            at = np.floor((pixels + 0.5) * self.scale)
            inside = np.all((at >= 0) & (at < [width, height]), axis=1)
        column, row = np.where(inside[:, None], at, 0).astype(int).T
        odds = palette.log_odds(self.tint[row, column].astype(np.float64))
        could: BoolArray = ~inside | ~(odds < 0.0)
        return could

    def other_share(self, palette: Palette, face: MeasuredFace) -> float:
        """Return the share of a face's pixels that haven't the colour of concrete."""
        return float(np.mean(palette.log_odds(self.of_faces([face])) < 0.0))

    def of_faces(self, faces: Iterable[MeasuredFace]) -> FloatArray:
        """Return the tints (N, 2) of all pixels of faces that are light enough."""
        outlines = [
            [np.round((ring + 0.5) * self.scale - 0.5).astype(np.int32) for ring in face.outline_px] for face in faces
        ]
        points = np.concatenate([np.zeros((0, 2), np.int32), *(ring for rings in outlines for ring in rings)])
        if not len(points):
            return np.zeros((0, 2))
        (x0, y0), (x1, y1) = np.maximum(points.min(axis=0), 0), np.maximum(points.max(axis=0) + 1, 0)
        window = self.tint[y0:y1, x0:x1]
        mask = np.zeros(window.shape[:2], dtype=np.uint8)
        for rings in outlines:
            cv2.fillPoly(mask, rings, 255, offset=(-int(x0), -int(y0)))
        shown = window[mask > 0]
        return shown[np.isfinite(shown[:, 0])].astype(np.float64)


@lru_cache(maxsize=_PICTURES_KEPT)
def tinted_picture(station: StationMeasurement) -> TintedPicture | None:
    """Read a station's picture; None where there is none, or none with colour."""
    data = np.frombuffer(station.thumbnail_jpeg, dtype=np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if image is None or is_grey(np.asarray(image, dtype=np.uint8)):
        return None
    soft = cv2.blur(image.astype(np.float32) / np.float32(255.0), (BLUR_PX, BLUR_PX))
    light, *chroma = cv2.split(cv2.cvtColor(soft, cv2.COLOR_BGR2Lab))
    shown = (light >= DARK) & ~clipped(np.asarray(image, dtype=np.uint8))
    tint = cv2.merge([one / np.where(shown, light + np.float32(BLACK), np.float32(np.nan)) for one in chroma])
    return TintedPicture(tint=np.asarray(tint, dtype=np.float32), scale=image.shape[1] / station.camera.width_px)
