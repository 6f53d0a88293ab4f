"""Known lengths as a rig that stands otherwise than it is believed to makes of them."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.rectify import rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply
from asbuilt_bim.measure.sigma.area import hats
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.rig_lengths import KnownLengths
from asbuilt_bim.register.scale import KNOWN_TO, KnownLength

SIZE_M, DIAMETER_M, SURVEY_SIGMA_M = 0.25, 0.30, 0.002
CORNERS = 0.5 * SIZE_M * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def rays(points_m: FloatArray, noise: FloatArray) -> FloatArray:
    """Directions (N, 3), z = 1, off by noise (N, 2)."""
    return np.c_[points_m[:, :2] / points_m[:, 2:] + noise, np.ones(len(points_m))]


def visit(
    true: StereoRig, believed: StereoRig, seed: int, stations: int = 5, noise_px: float = 0.07, markers: int = 4,
    exact: bool = False, surveyed: bool = True, near_m: float = 2.5, far_m: float = 7.0,
    lens_px: float = 0.0,
) -> tuple[list[ScaleEvidence], KnownLengths]:  # fmt: skip
    """Stations that see the disc and some of ten surveyed markers; what is known of them errs by its own sigma."""
    rng = np.random.default_rng([seed, 7])
    spread = 0.0 if exact else 1.0
    size, disc, tape = (1.0 + spread * rng.normal(0.0, KNOWN_TO[kind]) for kind in (
        KnownLength.MARKER_SIZE, KnownLength.TARGET_DIAMETER, KnownLength.MARKER_DISTANCES
    ))  # fmt: skip
    world = np.c_[rng.uniform(-2.2, 2.2, 10), rng.uniform(-1.2, 1.2, 10), rng.uniform(near_m, far_m, 10)]
    world[:, :2] *= world[:, 2:] / far_m  # all inside both frames
    survey = [
        SurveyedMarker(
            marker_id=k, sigma_m=SURVEY_SIGMA_M,
            corners_m=frozen(CORNERS + place * tape + spread * rng.normal(0.0, SURVEY_SIGMA_M, 3)),
        )
        for k, place in enumerate(world)
    ]  # fmt: skip
    camera = rectification(believed).camera
    f, noise = camera.f_px, spread * noise_px
    cells = lens_px * rng.normal(0.0, 1.0, 24)
    evidence = []
    for _ in range(stations):
        ids = sorted(rng.choice(10, markers, replace=False).tolist())
        points = np.concatenate([world[ids][:, None] + CORNERS * size])
        place = np.array([*rng.uniform(-0.8, 0.8, 2), rng.uniform(near_m, far_m)])
        around = place + 0.5 * DIAMETER_M * disc * np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])
        at = np.concatenate([points.reshape(-1, 3), around])
        in_right = apply(true.right_from_left, at)
        seen = [rays(one, rng.normal(0.0, 1.0, (len(at), 2)) * noise / f) for one in (at, in_right)]
        rectified = at @ camera.rectified_from_left.T
        pixels = f * rectified[:, :2] / rectified[:, 2:] + [camera.cx_px, camera.cy_px]
        seen[1][:, 0] += hats(pixels, camera) @ cells / f
        met = midpoints(seen[0], seen[1], believed.right_from_left)
        corners = met[:-4].reshape(-1, 4, 3)
        disparity, side = (
            f * believed.baseline_m / corners[..., 2].mean(axis=1),
            f * SIZE_M / corners[..., 2].mean(axis=1),
        )
        centre = met[-4:].mean(axis=0)
        diameter = DIAMETER_M * disc * centre[2] / place[2] * (1.0 + spread * rng.normal(0.0, 0.004))
        depth = noise_px * np.sqrt(2.0) / disparity
        evidence.append(
            ScaleEvidence(
                target_diameter_m=float(diameter), target_m=frozen(centre), marker_ids=tuple(ids),
                marker_corners_m=frozen(corners),
                marker_sigma=frozen(np.hypot(depth / 2.0, noise_px / side)),
                marker_depth_m=frozen(depth * corners[..., 2].mean(axis=1)),
            )
        )  # fmt: skip
    known = KnownLengths(diameter_m=DIAMETER_M, size_m=SIZE_M, survey=survey if surveyed else ())
    return evidence, known
