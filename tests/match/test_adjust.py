from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import Plane, PlaneFrame, frame_on_plane
from asbuilt_bim.geometry.transform import apply, inverse
from asbuilt_bim.match.adjust import adjust_with_design
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.measure.faces import MeasuredFace
from tests.match.small_site import CAMERA, box, element, looking, measured, model, placement, station

POSE = looking([-4.0, -2.0, 1.5], [0.5, 0.0, 1.4])  # the wall's front is seen at a grazing angle
WALL = box(0, 0, 0, 1.0, 0.25, 2.8)
DESIGN = model([element("W", "wall", WALL)])
TRUE_AREA = 2.8


def seen_with_tilt(tilt_rad: float, sigma_rad: float) -> MeasuredFace:
    """Return the front as measured when its plane is misjudged by a turn about the upright: rays held, area wrong."""
    frame = DESIGN.elements[0].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    own = frame.moved(inverse(POSE))
    middle = own.from_uv([0.5, 1.4])
    normal = np.cos(tilt_rad) * own.normal + np.sin(tilt_rad) * own.u
    plane = Plane(normal=frozen(normal), offset_m=float(normal @ middle))
    wrong = frame_on_plane(plane, middle, own.v)
    corners = apply(inverse(POSE), frame.from_uv(polygon.box(0.0, 0.0, 1.0, 2.8)[0][0]))
    ring = wrong.to_uv(plane.intersect(np.zeros(3), corners))
    face = measured("A1/1", POSE, wrong.moved(POSE), polygon.polygon([ring]), tilt_sigma_rad=sigma_rad)
    assert np.allclose(CAMERA.project(corners), CAMERA.project(wrong.from_uv(ring)), atol=1e-6)
    return face


def both(face: MeasuredFace) -> tuple[FaceMatch, FaceMatch]:
    matched = match_faces(placement(station("A1", POSE, [WALL], [face])), DESIGN, MatchOptions())
    adjusted = adjust_with_design(matched, DESIGN, MatchOptions())
    return matched.matches[0], adjusted.matches[0]


@pytest.mark.parametrize("tilt_deg", [-4.0, 4.0])
def test_a_weak_normal_leans_on_the_design_and_its_area_is_nearer_the_truth(tilt_deg: float) -> None:
    before, after = both(seen_with_tilt(np.radians(tilt_deg), np.radians(5.0)))
    assert abs(before.area_m2 - TRUE_AREA) > 0.1
    assert abs(after.area_m2 - TRUE_AREA) < 0.2 * abs(before.area_m2 - TRUE_AREA)


def test_offset_and_tilt_stay_as_measured() -> None:
    before, after = both(seen_with_tilt(np.radians(4.0), np.radians(5.0)))
    assert (after.offset_m, after.tilt_rad) == (before.offset_m, before.tilt_rad)


def test_a_well_measured_deviation_is_not_hidden() -> None:
    before, after = both(seen_with_tilt(np.radians(6.0), np.radians(0.1)))
    assert after.area_m2 == before.area_m2


def test_the_image_sigma_shrinks_where_the_design_helps() -> None:
    face = seen_with_tilt(np.radians(3.0), np.radians(5.0))
    slope = abs(face.area_m2 - TRUE_AREA) / np.radians(3.0)
    from dataclasses import replace

    honest = replace(face, area_sigma_image_m2=float(np.hypot(0.02, slope * np.radians(5.0))))
    before, after = both(honest)
    assert after.area_sigma_image_m2 < 0.5 * before.area_sigma_image_m2
    assert after.area_sigma_image_m2 > 0.02
