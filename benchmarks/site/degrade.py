"""A site's photos under other light and another lens: what is done to the linear picture, before a camera stores it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

GAMMA = 2.2
WHITE_ELECTRONS, READ_ELECTRONS = 10_000.0, 5.0
"""A common sensor: what fills a pixel, and what reading it adds. Their noise is what a dark photo is left with."""
GREY = 0.12
"""Of the light: how far a pixel's channels differ where it may be concrete. The target, timber and plants differ by
more."""
SUN_LIKE = 0.6
"""Of white: a brighter pixel is sky."""
DROPS = 9

Gains = tuple[float, float, float]  # of blue, green and red
FloatArray = NDArray[np.float64]
FloatImage = NDArray[np.float32]
ByteImage = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Degradation:
    """What became of the light before it was a photo; as it is given, nothing."""

    name: str
    stops: float = 0.0  # of exposure
    light: Gains = (1.0, 1.0, 1.0)  # colour of the lamps, at the same brightness
    concrete: Gains = (1.0, 1.0, 1.0)  # wet, or of another colour
    veil: float = 0.0  # share of the light that is haze
    defocus_px: float = 0.0  # radius of the disc that a point becomes
    motion_px: float = 0.0  # length of the line that a point becomes
    motion_deg: float = 0.0
    drops: bool = False  # of rain on the lens
    gained: bool = False  # the camera makes up for the light that it lacks, and shows its noise
    jpeg: int = 92

    def applied(self, photo: ByteImage, rng: np.random.Generator) -> ByteImage:
        """Return a photo (H, W, 3) as it would have been taken."""
        light = ((photo.astype(np.float32) + 0.5) / 256.0) ** GAMMA
        light = np.where(_may_be_concrete(light)[..., None], light * np.float32(self.concrete), light)
        light = light * np.float32(np.array(self.light) / np.dot(self.light, (0.11, 0.59, 0.30)))
        light = light * (1.0 - self.veil) + self.veil * np.float32(0.8)
        light = _blurred(light, self, rng)
        light = np.minimum(light * np.float32(2.0**self.stops), 1.0)
        electrons = light * WHITE_ELECTRONS
        noise = np.sqrt(electrons + READ_ELECTRONS**2) / WHITE_ELECTRONS
        light = light + noise * rng.standard_normal(light.shape, dtype=np.float32)
        if self.gained:
            light = light * np.float32(2.0**-self.stops)
        stored = np.clip(np.clip(light, 0.0, 1.0) ** (1.0 / GAMMA) * 256.0 - 0.5, 0.0, 255.0)
        return np.asarray(np.round(stored), dtype=np.uint8)

    def encoded(self, photo: ByteImage, rng: np.random.Generator) -> bytes:
        """Return the photo as the camera stores it."""
        done, data = cv2.imencode(".jpg", self.applied(photo, rng), [cv2.IMWRITE_JPEG_QUALITY, self.jpeg])
        assert done
        return bytes(data)


def _may_be_concrete(light: FloatImage) -> NDArray[np.bool_]:
    soft = cv2.GaussianBlur(light, (0, 0), 2.0)
    most, least = soft.max(axis=-1), soft.min(axis=-1)
    sky = soft[..., 0] > 1.05 * soft[..., 2]
    return np.asarray((most - least < GREY) & (most < SUN_LIKE) & (least > 0.6 * most) & ~sky)


def _blurred(light: FloatImage, one: Degradation, rng: np.random.Generator) -> FloatImage:
    if one.defocus_px > 0.0:
        light = cv2.filter2D(light, -1, disc(one.defocus_px))
    if one.motion_px > 0.0:
        light = cv2.filter2D(light, -1, line_of(one.motion_px, one.motion_deg))
    if one.drops:
        light = _through_drops(light, rng)
    return np.asarray(light, dtype=np.float32)


def _through_drops(light: FloatImage, rng: np.random.Generator) -> FloatImage:
    """Blur round patches, a fifth of the photo's height wide; each lens has its own drops."""
    height, width = light.shape[:2]
    mask = np.zeros((height, width), dtype=np.float32)
    for x, y in rng.random((DROPS, 2)):
        centre = int(x * width), int((0.2 + 0.7 * y) * height)
        cv2.circle(mask, centre, int(height * 0.1), 1.0, -1)
    mask = cv2.GaussianBlur(mask, (0, 0), height * 0.01)[..., None]
    return np.asarray(light * (1.0 - mask) + mask * cv2.filter2D(light, -1, disc(6.0)), dtype=np.float32)


def disc(radius_px: float) -> FloatImage:
    """Return the picture of a point out of focus."""
    return _kernel(radius_px, lambda x, y: np.hypot(x, y) <= radius_px)


def line_of(length_px: float, angle_deg: float) -> FloatImage:
    """Return the picture of a point that moved."""
    along, across = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return _kernel(
        length_px / 2.0,
        lambda x, y: (np.abs(x * along + y * across) <= length_px / 2.0) & (np.abs(y * along - x * across) <= 0.5),
    )


def _kernel(reach_px: float, inside: Callable[[FloatArray, FloatArray], NDArray[np.bool_]]) -> FloatImage:
    size, fine = 2 * int(np.ceil(reach_px)) + 3, 9
    steps = (np.arange(size * fine) + 0.5) / fine - size / 2.0
    x, y = np.meshgrid(steps, steps)
    counts = inside(x, y).reshape(size, fine, size, fine).sum(axis=(1, 3)).astype(np.float32)
    return np.asarray(counts / counts.sum(), dtype=np.float32)


SHADE, BULB, SODIUM = (1.0, 0.70, 0.58), (0.16, 0.44, 1.0), (0.07, 0.47, 1.0)

CLEAN = Degradation(name="as it is")
DEGRADATIONS = (
    *(Degradation(name=f"exposure {stops:+d} EV", stops=float(stops)) for stops in (-4, -3, -2, -1, 1, 2, 3, 4)),
    Degradation(name="4 EV less light, gained", stops=-4.0, gained=True),
    Degradation(name="6 EV less light, gained", stops=-6.0, gained=True),
    Degradation(name="light of shade", light=SHADE),
    Degradation(name="light of bulbs", light=BULB),
    Degradation(name="light of sodium lamps", light=SODIUM),
    Degradation(name="sodium lamps at dusk", light=SODIUM, stops=-2.0),
    *(Degradation(name=f"JPEG {quality}", jpeg=quality) for quality in (95, 60, 30)),
    *(Degradation(name=f"defocus {radius:g} px", defocus_px=radius) for radius in (1.0, 2.0, 4.0)),
    Degradation(name="moved 4 px level", motion_px=4.0),
    Degradation(name="moved 8 px level", motion_px=8.0),
    Degradation(name="moved 8 px upright", motion_px=8.0, motion_deg=90.0),
    Degradation(name="moved 6 px aslant", motion_px=6.0, motion_deg=35.0),
    Degradation(name="haze 40 %", veil=0.4),
    Degradation(name="haze 70 %", veil=0.7),
    Degradation(name="drops on the lens", drops=True),
    Degradation(name="wet dark concrete", concrete=(0.35, 0.35, 0.35)),
    Degradation(name="red-brown concrete", concrete=(0.45, 0.65, 1.0)),
    Degradation(name="yellow concrete", concrete=(0.55, 0.95, 1.0)),
    Degradation(name="into the sun", stops=2.0, veil=0.2),
    Degradation(name="dusk, unsharp", stops=-3.0, defocus_px=1.5, light=BULB),
)
