"""Generated photo pairs with and without the red disc, on rendered and real backgrounds, with exact truth."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray, frozen
from benchmarks.sites import DATA, SAMPLE, benchmark_folder
from benchmarks.target.layers import GAMMA, Layer, draw, seen_from
from benchmarks.target.things import DISTRACTORS, cover, distractor, lit, target_disc

RADIUS_M = 0.15
DEVELOPING_SITES = (20, 1, 21, 22)
MOST_COVERED = 0.30
BLURRED_AS_SHOWN = 0.15
"""Of the pairs: their blur is of grey levels, as a resampler or a noise filter makes it, and not of light."""
_SHARPEST_PX = 0.6  # what a lens and a pixel blur at least
_MOST_PHOTOS = 27  # a background takes 7 MB
_LINEAR = ((np.arange(256) / 255.0) ** GAMMA).astype(np.float32)
_CAMERA = RectifiedCamera(f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
                          rectified_from_left=np.eye(3))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Background:
    """A rectified pair without a red disc in it, and where it comes from: `rendered`, `photo` or `stereo`."""

    kind: str
    pair: RectifiedPair


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """One generated pair and its truth; `range_m` is None where no disc was put in."""

    name: str
    pair: RectifiedPair
    range_m: float | None
    traits: dict[str, str | float]


def backgrounds() -> Iterator[Background]:
    """Give backgrounds in turn, for ever: a rendered one, a real photo (shifted crops), a real stereo pair."""
    makers = [maker for maker in (_rendered(), _photos(), _stereo()) if maker]
    turn = 0
    while True:
        for makers_of_kind in makers:
            yield makers_of_kind[turn % len(makers_of_kind)]
        turn += 1


def case(number: int, seed: int, background: Background, with_disc: bool) -> Case:
    """Compose one pair: a disc (or none), red things that are no target, light, blur, noise and JPEG."""
    rng = np.random.default_rng([seed, number])
    pair = background.pair
    light = str(rng.choice(["sun", "shade", "dusk"]))
    traits: dict[str, str | float] = {"background": background.kind, "light": light}
    layers: list[tuple[float, Layer]] = []
    places: list[tuple[FloatArray, float]] = []
    range_m = None
    if with_disc:
        centre, tilt, found = _disc(pair, light, rng, traits)
        layers += [(float(layer.centre_m[2]), layer) for layer in found]
        places.append((centre, RADIUS_M))
        range_m = float(np.linalg.norm(centre))
        traits.update(range_m=range_m, tilt_deg=float(np.rad2deg(tilt)))
    for _ in range(rng.integers(0, 5) if with_disc else rng.integers(1, 7)):
        kind = str(rng.choice(DISTRACTORS))
        centre = _place(pair, rng, 0.45, 2.5, 10.0)
        if all(_apart(pair.camera, centre, 0.45, other, reach) for other, reach in places):
            layers.append((float(centre[2]), distractor(kind, centre, lit(light, 0.3, rng), rng)))
            places.append((centre, 0.45))
    if with_disc and rng.random() < 0.06:
        layers.append(_reflection(places[0][0], light, rng))
        traits["reflection"] = 1.0
    blur = {"none": _SHARPEST_PX, "soft": rng.uniform(0.8, 1.5), "blurred": rng.uniform(1.5, 2.5)}
    sharpness = str(rng.choice(list(blur)))
    # drawn for itself: the other draws of a seed are what they were before there was such blur
    as_shown = bool(np.random.default_rng([seed, number, 1]).random() < BLURRED_AS_SHOWN)
    traits["blur"] = f"{sharpness}, of grey levels" if as_shown and sharpness != "none" else sharpness
    light_px = _SHARPEST_PX if as_shown else blur[sharpness]
    shown_px = float(np.sqrt(blur[sharpness] ** 2 - light_px**2))
    dusk = 0.25 if light == "dusk" else 1.0
    noise = rng.uniform(4.0, 8.0) if light == "dusk" else rng.uniform(1.0, 3.0)
    images = [
        _photo(image, layers, pair.camera, shift, (dusk, light_px, shown_px, noise), rng)
        for image, shift in ((pair.left, 0.0), (pair.right, pair.camera.baseline_m))
    ]
    return Case(
        name=f"{seed}/{number}",
        pair=RectifiedPair(
            name=f"{number}", left=images[0], right=images[1], camera=pair.camera,
            valid_left=pair.valid_left, valid_right=pair.valid_right,
        ),
        range_m=range_m,
        traits=traits,
    )  # fmt: skip


def _disc(
    pair: RectifiedPair, light: str, rng: np.random.Generator, traits: dict[str, str | float]
) -> tuple[FloatArray, float, list[Layer]]:
    camera = pair.camera
    centre = _place(pair, rng, RADIUS_M, 3.0, 8.0)
    tilt, about = float(np.deg2rad(rng.uniform(0, 60))), float(rng.uniform(0, 2 * np.pi))
    disc = target_disc(centre, tilt, about, lit(light, RADIUS_M, rng), float(rng.uniform(0, 0.4)), rng)
    layers = [disc]
    while rng.random() < 0.5:
        covering, _ = cover(centre, RADIUS_M, float(rng.uniform(0.03, MOST_COVERED)), rng)
        hidden = max(_hidden(camera, disc, covering, shift) for shift in (0.0, camera.baseline_m))
        if hidden <= MOST_COVERED:
            traits["covered"] = hidden
            layers.append(covering)
            break
    return centre, tilt, layers


def _hidden(camera: RectifiedCamera, disc: Layer, covering: Layer, shift_m: float) -> float:
    """Return the share of a disc's area that a layer before it hides from a camera."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 61)] * 2), axis=-1).reshape(-1, 2) * disc.reach_m
    points = disc.centre_m + grid[np.hypot(*grid.T) < disc.reach_m] @ np.stack([disc.u, disc.v])
    eye = np.array([shift_m, 0.0, 0.0])
    normal = np.cross(covering.u, covering.v)
    rays = points - eye
    share = ((covering.centre_m - eye) @ normal) / (rays @ normal)
    met = eye + rays * share[:, None] - covering.centre_m
    return float(np.mean(covering.paint(np.stack([met @ covering.u, met @ covering.v], axis=-1))[1]))


def _place(pair: RectifiedPair, rng: np.random.Generator, reach_m: float, near: float, far: float) -> FloatArray:
    """Return a place (3,) that both photos show whole, `near` to `far` metres away."""
    camera = pair.camera
    while True:
        pixel = rng.uniform([0, 0], [camera.width_px, camera.height_px])
        ray = np.array([*(pixel - [camera.cx_px, camera.cy_px]) / camera.f_px, 1.0])
        centre = ray / np.linalg.norm(ray) * rng.uniform(near, far)
        margin = camera.f_px * reach_m / centre[2] * 1.25 + 12
        seen = [seen_from(camera, centre[None], shift)[0] for shift in (0.0, camera.baseline_m)]
        if all(_is_photo(v, at, margin) for v, at in zip((pair.valid_left, pair.valid_right), seen, strict=True)):
            return centre


def _is_photo(valid: BoolArray, at: FloatArray, margin_px: float) -> bool:
    """Say whether a square about a pixel lies in the frame and shows something."""
    (x0, y0), (x1, y1) = (at - margin_px).astype(int), (at + margin_px).astype(int)
    inside = min(x0, y0) >= 0 and x1 < valid.shape[1] and y1 < valid.shape[0]
    return inside and bool(valid[y0:y1, x0:x1].all())


def _apart(camera: RectifiedCamera, a: FloatArray, reach_a: float, b: FloatArray, reach_b: float) -> bool:
    for shift in (0.0, camera.baseline_m):
        gap = np.linalg.norm(seen_from(camera, a[None], shift)[0] - seen_from(camera, b[None], shift)[0])
        if gap < 1.1 * camera.f_px * (reach_a / a[2] + reach_b / b[2]):
            return False
    return True


def _reflection(centre: FloatArray, light: str, rng: np.random.Generator) -> tuple[float, Layer]:
    """Return the disc's faint mirror picture in wet ground or glass: the same size, further away, below or beside."""
    behind = centre * rng.uniform(1.15, 1.4) + rng.uniform([-0.9, 0.5, 0.0], [0.9, 0.9, 0.0])
    layer = target_disc(behind, float(rng.uniform(0, 0.6)), 0.0, lit(light, RADIUS_M, rng), 0.2, rng,
                        opacity=float(rng.uniform(0.3, 0.5)))  # fmt: skip
    return float(behind[2]), layer


def _photo(
    image: ByteImage, layers: list[tuple[float, Layer]], camera: RectifiedCamera, shift_m: float,
    optics: tuple[float, float, float, float], rng: np.random.Generator,
) -> ByteImage:  # fmt: skip
    """Draw the layers from the far one to the near one; then light, its blur, grey levels, theirs, noise and JPEG."""
    exposure, light_px, shown_px, noise = optics
    canvas = cv2.LUT(image, _LINEAR)
    for _, layer in sorted(layers, key=lambda item: -item[0]):
        draw(canvas, layer, camera, shift_m)
    canvas = cv2.GaussianBlur(canvas * np.float32(exposure), None, light_px)
    shown = 255.0 * cv2.pow(np.clip(canvas, 0.0, 1.0), 1.0 / GAMMA)
    if shown_px > 0.0:
        shown = cv2.GaussianBlur(shown, None, shown_px)
    grain = np.empty(shown.shape, dtype=np.int16)
    cv2.setRNGSeed(int(rng.integers(1 << 30)))
    cv2.randn(grain, 0.0, 4.0 * noise)
    done, data = cv2.imencode(
        ".jpg", np.clip(shown + grain / np.float32(4.0), 0, 255).astype(np.uint8),
        [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(82, 96))],
    )  # fmt: skip
    if not done:
        raise SystemExit("OpenCV could not write a JPEG")
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


def _rendered() -> list[Background]:
    """Return the stations of generated sites (development seeds, else the sample), their own disc painted out."""
    folders = [benchmark_folder() / f"site-{seed}" for seed in DEVELOPING_SITES]
    folders = [folder for folder in folders if (folder / "complete").exists()] or [SAMPLE]
    found = []
    for folder in folders:
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        rig = true_rig(truth)
        prepared = rectification(rig)
        for visit in truth["visits"]:
            for station in visit["stations"]:
                paths = [folder / "visits" / visit["date"] / f"{station['name']}_{s}.jpg" for s in ("left", "right")]
                images = [cv2.imread(str(path), cv2.IMREAD_COLOR) for path in paths]
                for image, side in zip(images, ("left", "right"), strict=True):
                    _paint_out(image, station["disc"][f"{side}_px"], station["disc"]["range_m"], rig)
                found.append(Background(kind="rendered", pair=rectify(prepared, *images, station["name"])))
    return found


def true_rig(truth: dict) -> StereoRig:
    """Return the rig of a generated site's truth."""
    sides = {
        side: Intrinsics(
            K=frozen(truth["rig"][side]["K"]), distortion=frozen(truth["rig"][side]["distortion"]),
            width_px=truth["rig"][side]["width_px"], height_px=truth["rig"][side]["height_px"],
        )
        for side in ("left", "right")
    }  # fmt: skip
    return StereoRig(left=sides["left"], right=sides["right"], right_from_left=frozen(truth["rig"]["right_from_left"]),
                     covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))))  # fmt: skip


def _paint_out(image: ByteImage, centre: list[float], range_m: float, rig: StereoRig) -> None:
    """Paint the rendered disc over with what is beside it, in place."""
    reach = 1.3 * rig.left.K[0, 0] * RADIUS_M / range_m + 3
    hole = np.zeros(image.shape[:2], dtype=np.uint8)
    cv2.circle(hole, (round(centre[0]), round(centre[1])), round(reach), 255, -1)
    x0, y0 = np.maximum(np.array(centre) - 2 * reach, 0).astype(int)
    x1, y1 = (np.array(centre) + 2 * reach).astype(int) + 1
    part = (slice(y0, y1), slice(x0, x1))
    image[part] = cv2.inpaint(np.ascontiguousarray(image[part]), np.ascontiguousarray(hole[part]), 3, cv2.INPAINT_TELEA)


def _photos() -> list[Background]:
    """Return pairs of shifted crops of real photos: everything in them lies in one depth, 6 to 20 m away."""
    rng = np.random.default_rng(7)
    paths = sorted((DATA / "photos").glob("*/*.[jJ][pP][gG]"))
    found = []
    for path in paths[:: max(1, len(paths) // _MOST_PHOTOS)]:
        whole = cv2.imread(str(path), cv2.IMREAD_COLOR)
        shift = int(rng.integers(13, 44))
        scale = max((_CAMERA.width_px + shift) / whole.shape[1], _CAMERA.height_px / whole.shape[0], 0.35)
        whole = cv2.resize(
            whole, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
        )
        y = int(rng.integers(0, whole.shape[0] - _CAMERA.height_px + 1))
        x = int(rng.integers(0, whole.shape[1] - _CAMERA.width_px - shift + 1))
        crops = [whole[y : y + _CAMERA.height_px, x + s : x + s + _CAMERA.width_px].copy() for s in (0, shift)]
        found.append(_background("photo", crops[0], crops[1]))
    return found


def _stereo() -> list[Background]:
    """Return real stereo pairs (their rows agree to a pixel or two; what is drawn in is exact)."""
    root = DATA / "stereo"
    pairs = [(root / "eth3d_playground" / "im0.png", root / "eth3d_playground" / "im1.png")]
    pairs += [
        (left, Path(str(left).replace("left", "right"))) for left in sorted((root / "euroc" / "pairs").glob("*left*"))
    ]
    found = []
    for left, right in pairs:
        if not (left.exists() and right.exists()):
            continue
        images = [cv2.imread(str(path), cv2.IMREAD_COLOR) for path in (left, right)]
        scale = max(_CAMERA.width_px / images[0].shape[1], _CAMERA.height_px / images[0].shape[0])
        large = [cv2.resize(i, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC) for i in images]
        found.append(_background("stereo", *(i[: _CAMERA.height_px, : _CAMERA.width_px].copy() for i in large)))
    return found


def _background(kind: str, left: ByteImage, right: ByteImage) -> Background:
    everywhere = np.ones((_CAMERA.height_px, _CAMERA.width_px), dtype=bool)
    return Background(
        kind=kind,
        pair=RectifiedPair(
            name=kind, left=left, right=right, valid_left=everywhere, valid_right=everywhere, camera=_CAMERA
        ),
    )
