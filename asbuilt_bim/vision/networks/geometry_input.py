"""What stereo knows of a photo, as a network's input: nearness, slope, facing and height, pixel by pixel.

The same function serves training and use. A plane n . X = d gives 1/Z = (n . ray) / d: inverse depth is linear over the
picture, and its slopes give the normal.
"""

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.vision.networks.picture import Fit
from asbuilt_bim.vision.scene.vertical import find_vertical
from asbuilt_bim.vision.stereo.depth import DepthMap

CHANNELS = 5
"""Nearness, |normal . up|, |normal . level viewing direction|, height over the camera, measured or not."""
NEAR_M = 2.0
"""What is as near as this has nearness 1."""
HEIGHT_M = 4.0
"""One storey and a bit: the unit of height."""
REACH_PX = 3
"""Normals are fitted over windows of 7 x 7 pixels: half a per cent of noise in 1/Z then leaves some degrees."""
STRIP_ROWS = 48
"""The picture is worked through in strips: their arrays stay in the processor's cache."""
LEAST_SHARE = 0.3
"""A window with fewer measured pixels than this share gives no normal, and a pixel no depth."""
CLEARLY = 0.5
"""A window beside the pixel takes the place of the one around it if its plane fits with this share of the variance."""
EVEN = 2e-3
"""Residuals under this share of 1/Z are alike: stereo isn't better."""


def geometry_channels(
    inverse_depth_per_m: Float32Array, *, fx_px: float, fy_px: float, cx_px: float, cy_px: float, up: FloatArray
) -> Float32Array:
    """Return the geometry of a picture as float32 (5, h, w); all 0 where nothing was measured.

    `inverse_depth_per_m` (h, w) is 1/Z, 0 (or NaN) where not measured. Focal lengths and principal point are those of
    this picture, pixel centres integers. `up` (3,) is a unit vector in the camera frame (x right, y down, z forward).

    Channels: 2 m / Z, at most 2; |n . up|, 0 for an upright surface, 1 for a level one; |n . v|, v being the viewing
    direction made level: how frontal it stands; height over the camera / 4 m, within 1.5; 1 where measured.
    Where too little is measured for a normal n, both its channels are 0.
    """
    inverse = np.nan_to_num(np.asarray(inverse_depth_per_m, dtype=np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    height, width = inverse.shape
    x = ((np.arange(width) - cx_px) / fx_px).astype(np.float32)
    y = ((np.arange(height) - cy_px) / fy_px).astype(np.float32)[:, None]
    channels = np.empty((CHANNELS, height, width), dtype=np.float32)
    for top in range(0, height, STRIP_ROWS):
        low, end = max(top - 2 * REACH_PX, 0), min(top + STRIP_ROWS, height)
        rows = slice(low, min(end + 2 * REACH_PX, height))
        strip = _channels(inverse[rows], x, y[rows], (np.float32(fx_px), np.float32(fy_px)), up)
        channels[:, top:end] = strip[:, top - low : end - low]
    return channels


def geometry_of_pair(pair: RectifiedPair, depth: DepthMap, fit: Fit) -> Float32Array:
    """Return the channels (5, h, w) at a network's input size, of a pair's measured depth and upright edges.

    Where no upright edges are seen the camera is taken to be held level. Each pixel gets the mean of the measured ones
    that it covers.
    """
    width, height = fit.input_size
    inside = (round(fit.photo_size[0] * fit.scale_x), round(fit.photo_size[1] * fit.scale_y))
    x, y = round(fit.offset_x_px), round(fit.offset_y_px)
    per_disparity = np.float32(1.0 / (depth.f_px * depth.baseline_m))
    total, share = (
        np.asarray(cv2.resize(one, inside, interpolation=cv2.INTER_AREA), dtype=np.float32)
        for one in (np.where(depth.valid, depth.disparity_px, np.float32(0.0)), depth.valid.astype(np.float32))
    )
    inverse = np.zeros((height, width), dtype=np.float32)
    known = share > LEAST_SHARE
    inverse[y : y + inside[1], x : x + inside[0]][known] = total[known] / share[known] * per_disparity
    camera, vertical = pair.camera, find_vertical(pair)
    return geometry_channels(
        inverse, fx_px=camera.f_px * fit.scale_x, fy_px=camera.f_px * fit.scale_y,
        cx_px=(camera.cx_px + 0.5) * fit.scale_x - 0.5 + fit.offset_x_px,
        cy_px=(camera.cy_px + 0.5) * fit.scale_y - 0.5 + fit.offset_y_px,
        up=vertical.up if vertical is not None else np.array([0.0, -1.0, 0.0]),
    )  # fmt: skip


def no_geometry(fit: Fit) -> Float32Array:
    """Return the channels of a photo without stereo: all 0."""
    return np.zeros((CHANNELS, fit.input_size[1], fit.input_size[0]), dtype=np.float32)


def _channels(
    inverse: Float32Array, x: Float32Array, y: Float32Array, focal_px: tuple[np.float32, np.float32], up: FloatArray
) -> Float32Array:
    """Return the channels of a strip of rows, whose rays are (x, y, 1)."""
    known = inverse > 0.0
    ux, uy, uz = (np.float32(value) for value in up)
    rise = ux * x + uy * y + uz  # the ray's share upwards
    level_x, level_y, level_z = x - rise * ux, y - rise * uy, 1.0 - rise * uz
    across, down, at_centre = _planes(inverse, known, x * focal_px[0], y * focal_px[1])
    across, down = across * focal_px[0], down * focal_px[1]
    length = np.sqrt(across * across + down * down + at_centre * at_centre)
    reach = np.sqrt(level_x * level_x + level_y * level_y + level_z * level_z)
    scale = 1.0 / np.maximum(length, 1e-9)
    facing = across * level_x + down * level_y + at_centre * level_z
    channels = np.empty((CHANNELS, *inverse.shape), dtype=np.float32)
    np.minimum(np.float32(NEAR_M) * inverse, 2.0, out=channels[0])
    channels[1] = np.abs(across * ux + down * uy + at_centre * uz) * scale
    channels[2] = np.abs(facing) * scale / np.maximum(reach, 1e-6)
    channels[3] = np.clip(rise / np.maximum(np.float32(HEIGHT_M) * inverse, 1e-6), -1.5, 1.5)
    channels[4] = 1.0
    return np.multiply(channels, known, out=channels)


def _planes(
    inverse: Float32Array, known: BoolArray, x_px: Float32Array, y_px: Float32Array
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Return slopes of 1/Z per pixel across and down, and its plane's value at the principal point; 0 where unknown.

    Of the window around a pixel and the four beside it, each holding the pixel, the flattest one counts. A window over
    an edge would give a surface that isn't there. `x_px` (w,) and `y_px` (h, 1) count from the principal point.
    """
    slope_x, slope_y, value, variance = _fits(inverse, known)
    at_centre = value - slope_x * x_px - slope_y * y_px
    variance = np.maximum(variance, np.square(np.float32(EVEN) * inverse))
    worst = np.float32(CLEARLY) * variance
    chosen = [slope_x.copy(), slope_y.copy(), at_centre.copy()]
    height, width = inverse.shape
    padded = np.pad(variance, REACH_PX, constant_values=np.inf)
    for right, below in ((-REACH_PX, 0), (REACH_PX, 0), (0, -REACH_PX), (0, REACH_PX)):
        top, left = REACH_PX + below, REACH_PX + right
        beside = padded[top : top + height, left : left + width]
        at = np.flatnonzero((beside < worst) & known)  # few: the pixels at edges
        worst.flat[at] = variance.flat[at + below * width + right]
        for plane, source in zip(chosen, (slope_x, slope_y, at_centre), strict=True):
            plane.flat[at] = source.flat[at + below * width + right]
    return chosen[0], chosen[1], chosen[2]


def _fits(inverse: Float32Array, known: BoolArray) -> Float32Array:
    """Fit a plane to the measured pixels of the window around each pixel, by least squares.

    Return (4, h, w): slope across, slope down, value in the middle, and the residuals' variance; 0, 0, 0 and infinity
    where the window holds too little.
    """
    steps = np.arange(-REACH_PX, REACH_PX + 1, dtype=np.float32)
    ones = np.ones_like(steps)
    weight = known.astype(np.float32)

    def total(of: Float32Array, across: Float32Array, down: Float32Array) -> Float32Array:
        return np.asarray(cv2.sepFilter2D(of, cv2.CV_32F, across, down, borderType=cv2.BORDER_CONSTANT))

    count = total(weight, ones, ones)
    share = np.float32(1.0) / np.maximum(count, np.float32(1.0))
    mean_x, mean_y = total(weight, steps, ones) * share, total(weight, ones, steps) * share
    mean = total(inverse, ones, ones) * share
    xx = total(weight, steps * steps, ones) * share - mean_x * mean_x
    yy = total(weight, ones, steps * steps) * share - mean_y * mean_y
    xy = total(weight, steps, steps) * share - mean_x * mean_y
    xq = total(inverse, steps, ones) * share - mean_x * mean
    yq = total(inverse, ones, steps) * share - mean_y * mean
    qq = total(inverse * inverse, ones, ones) * share - mean * mean
    spread = xx * yy - xy * xy
    enough = (count >= LEAST_SHARE * len(steps) ** 2) & (spread > 0.25)  # 0.25 px^4: not all on one line
    sure = enough.astype(np.float32)
    inside = sure / np.maximum(spread, np.float32(0.25))
    slope_x, slope_y = (xq * yy - yq * xy) * inside, (yq * xx - xq * xy) * inside
    value = (mean - slope_x * mean_x - slope_y * mean_y) * sure
    variance = np.where(enough, np.maximum(qq - slope_x * xq - slope_y * yq, 0.0), np.float32(np.inf))
    return np.stack([slope_x, slope_y, value, variance], dtype=np.float32)
