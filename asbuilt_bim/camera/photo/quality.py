"""A photo's own state, from its pixels: clipped, dark, grainy, compressed, hazy, tinted, unsharp, moved, smeared.

What follows from it (no target, no markers, little depth) is refused with this as its cause.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.photo.compression import rounded_away_grey
from asbuilt_bim.camera.photo.sharpness import Sharpness, sharpness_of, smeared_shares
from asbuilt_bim.camera.rectify import TakenPhoto
from asbuilt_bim.codes import Reason, Subject, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, median

WHITE, BLACK = 250, 3
"""A pixel this bright or dark is at the end of the sensor: JPEG moves it by so much."""
CLIPPED_PX = 9
"""What is clipped over this square shows nothing: stereo's own window. A smaller spot is a glint."""
GAMMA = 2.2
MID_GREY = 0.18
"""Of white: what a camera exposes the middle of a picture to."""
BLOCK_PX = 16
EVERY_PX = 4
"""Light is asked of every so many pixels across and down: the photo's middle needs no more."""

MOST_CLIPPED = 0.02
"""Share of the photo. The clean photos of building sites have none."""
LEAST_STOPS = -3.5
"""Under mid-grey. Then the texture of concrete, some 5 % of its light, is one of the file's 256 levels."""
MOST_NOISE_GREY = 4.0
"""Concrete's own texture is some 2 to 5 grey levels."""
MOST_ROUNDED_GREY = 2.0
"""The lower end of the same."""
MOST_VEIL = 0.2
"""The darkest things as a share of the brightest: more is light that no thing there sent."""
MOST_TINT_STOPS = 1.0
"""Between red and blue, where the photo is whitest."""
MOST_BLUR_PX = 1.0
"""Over the matcher's own window it costs little until here."""
MOST_MOTION_PX = 2.5
"""What passes for it on photos from a tripod stays under this; 4 px read as 3 to 4, and cost a tenth of the surface."""
MOST_SMEARED = 0.04
"""Of the parts. Things seen from the side make up to 5 % of them look so on other people's real pairs, mostly 1 %."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhotoQuality:
    """What one photo's pixels say of it; shares are of its own area."""

    white_share: float  # clipped over a square, every channel
    black_share: float
    stops: float  # of its middle light, over mid-grey
    veil: float  # the darkest light as a share of the brightest
    tint_stops: float  # red over blue where it is whitest; 0 where something is white
    noise_grey: float
    rounded_away_grey: float  # amplitude of texture that the file's compression no longer holds
    sharpness: Sharpness


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationQuality:
    """A pair's two photos."""

    left: PhotoQuality
    right: PhotoQuality


def quality_of(left: TakenPhoto, right: TakenPhoto, left_file: bytes, right_file: bytes) -> StationQuality:
    """Measure both photos of a pair as they were taken, and what their files had to leave out.

    Rectifying draws pixels between pixels: it takes noise away, and stretches edges by their direction, as motion does.
    """
    return StationQuality(
        left=photo_quality(left.image, left.shown, left_file, left),
        right=photo_quality(right.image, right.shown, right_file, right),
    )


def clipped(photo: ByteImage) -> BoolArray:
    """Return the pixels (H, W) of a photo (H, W, 3) that show nothing: white ones, and all round, too."""
    return _squares(white(photo))


def white(photo: ByteImage) -> BoolArray:
    """Return the pixels (H, W) of a photo (H, W, 3) whose every channel is clipped."""
    blue, green, red = cv2.split(photo)
    return np.asarray(cv2.min(cv2.min(blue, green), red) >= WHITE)


def photo_quality(
    photo: ByteImage, valid: BoolArray, file: bytes = b"", taken: TakenPhoto | None = None
) -> PhotoQuality:
    """Measure one photo (H, W, 3) where it is `valid` (H, W); `file` is what it was stored as.

    `taken` says where its parts lie beside the other photo's; without, its rows are the other's.
    """
    area = max(int(valid.sum()), 1)
    blue, green, red = cv2.split(photo)
    bleached, black = clipped(photo) & valid, _squares(np.asarray(cv2.max(cv2.max(blue, green), red) <= BLACK)) & valid
    some = photo[::EVERY_PX, ::EVERY_PX][valid[::EVERY_PX, ::EVERY_PX]]
    light = (np.asarray(some if len(some) else [[255, 255, 255]], dtype=np.float32) / 255.0) ** GAMMA
    bright = light @ np.array([0.11, 0.59, 0.30])
    grey = cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY)
    ends = ((grey >= WHITE) | (grey <= BLACK) | ~valid).astype(np.uint8)
    usable = cv2.dilate(ends, np.ones((CLIPPED_PX, CLIPPED_PX), np.uint8)) == 0
    picture: Float32Array = np.asarray(grey, dtype=np.float32)
    noise = _noise(picture, usable)
    return PhotoQuality(
        white_share=float(bleached.sum() / area),
        black_share=float(black.sum() / area),
        stops=float(np.log2(max(median(bright), 1e-5) / MID_GREY)),
        veil=float(np.quantile(bright, 0.02) / max(float(np.quantile(bright, 0.95)), 1e-5)),
        tint_stops=_tint(light),
        noise_grey=noise,
        rounded_away_grey=rounded_away_grey(file),
        sharpness=sharpness_of(picture, usable, noise, taken),
    )


def _squares(mask: BoolArray) -> BoolArray:
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((CLIPPED_PX, CLIPPED_PX))) > 0)


def _blocks(picture: Float32Array) -> Float32Array:
    """Return the means of whole blocks: noise and a photo's compression don't show in them."""
    height, width = (side // BLOCK_PX for side in picture.shape[:2])
    whole = picture[: height * BLOCK_PX, : width * BLOCK_PX]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), dtype=np.float32)


def _tint(light: Float32Array) -> float:
    """Return by how many stops red exceeds blue in what is nearly whitest; a bright thing of any colour is no lamp."""
    shown = light[light.max(axis=1) < 1.0]
    if not len(shown):
        return 0.0
    blue_of_red = float(np.quantile(shown[:, 0] / np.maximum(shown[:, 2], 1e-4), 0.95))
    return max(-float(np.log2(max(blue_of_red, 1e-4))), 0.0)


def _noise(picture: Float32Array, usable: BoolArray) -> float:
    """Return the noise in grey levels, by the least textured tenth of the photo (Immerkaer's mask)."""
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32) / 6.0
    rough = cv2.filter2D(picture, -1, mask)
    power = _blocks(np.asarray(rough * rough, dtype=np.float32))[_blocks(usable.astype(np.float32)) >= 1.0]
    return float(np.sqrt(np.quantile(power, 0.1))) if power.size else 0.0


def photo_faults(quality: StationQuality, station: str) -> tuple[Rejection, ...]:
    """Name what is wrong with a station's photos, by the worse of the two; empty where nothing is."""
    photos, subject = (quality.left, quality.right), about(SubjectKind.STATION, station)
    return (*_of_light(photos, subject), *_of_sharpness((quality.left.sharpness, quality.right.sharpness), subject))


def _of_light(photos: Sequence[PhotoQuality], station: Subject) -> Iterator[Rejection]:
    bleached = max(photo.white_share for photo in photos)
    if bleached > MOST_CLIPPED:
        yield rejected(Reason.PHOTO_CLIPPED, station, share=bleached, limit_share=MOST_CLIPPED)
    stops = min(photo.stops for photo in photos)
    if stops < LEAST_STOPS:
        yield rejected(Reason.PHOTO_DARK, station, stops=stops, limit_stops=LEAST_STOPS)
    noise = max(photo.noise_grey for photo in photos)
    if noise > MOST_NOISE_GREY:
        yield rejected(Reason.PHOTO_GRAINY, station, noise_grey=noise, limit_grey=MOST_NOISE_GREY)
    rounded = max(photo.rounded_away_grey for photo in photos)
    if rounded > MOST_ROUNDED_GREY:
        yield rejected(Reason.PHOTO_COMPRESSED, station, lost_grey=rounded, limit_grey=MOST_ROUNDED_GREY)
    veil = max(photo.veil for photo in photos)
    if veil > MOST_VEIL:
        yield rejected(Reason.PHOTO_HAZY, station, share=veil, limit_share=MOST_VEIL)
    tint = max(photo.tint_stops for photo in photos)
    if tint > MOST_TINT_STOPS:
        yield rejected(Reason.PHOTO_TINTED, station, stops=tint, limit_stops=MOST_TINT_STOPS)


def _of_sharpness(photos: tuple[Sharpness, Sharpness], station: Subject) -> Iterator[Rejection]:
    """Name motion where it widens edges by more than blur that is the same in all directions; a rig moves both eyes."""
    moved = min((one for one in photos if one.edges), key=lambda one: one.motion_px, default=photos[0])
    has_moved = moved.motion_px > MOST_MOTION_PX and moved.motion_px**2 / 12.0 > moved.blur_px**2
    if has_moved:
        yield rejected(
            Reason.PHOTO_MOVED, station, moved_px=moved.motion_px, moved_deg=moved.motion_deg, limit_px=MOST_MOTION_PX
        )
    blur = max(one.blur_px for one in photos)
    if blur > MOST_BLUR_PX:
        yield rejected(Reason.PHOTO_UNSHARP, station, blur_px=blur, limit_px=MOST_BLUR_PX)
    smeared = max(smeared_shares(*photos))
    if smeared > MOST_SMEARED and blur <= MOST_BLUR_PX and not has_moved:
        yield rejected(Reason.PHOTO_SMEARED, station, share=smeared, limit_share=MOST_SMEARED)
