"""Candidates: faces in the frame that look at the camera, and no others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim import candidates as candidates_module
from asbuilt_bim.bim.candidates import candidates
from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder

CAMERA = RectifiedCamera(
    f_px=1000.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip


@pytest.fixture
def design(tmp_path: Path) -> BimModel:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (-2.0, 5.0, 0.0), (4.0, 0.2, 3.0))
    builder.cylinder("R", (0.0, 8.0, 0.0), 0.2, 3.0)
    builder.box("IfcColumn", "behind", (0.0, -5.0, 0.0), (0.4, 0.4, 3.0))
    builder.box("IfcColumn", "far", (0.0, 60.0, 0.0), (0.4, 0.4, 3.0))
    return read_design(builder.write(tmp_path / "m.ifc"))


def _looking_north(at: tuple[float, float, float]) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    pose[:3, 3] = at
    return pose


def _names(design: BimModel, pose: FloatArray, reach_m: float = 20.0) -> list[tuple[str, float]]:
    name_of = {element.global_id: element.name for element in design.elements}
    return sorted((name_of[f.element], round(f.area_m2, 2)) for f in candidates(design, pose, CAMERA, reach_m))


def test_only_faces_ahead_near_and_turned_to_the_camera_are_candidates(design: BimModel) -> None:
    names = _names(design, _looking_north((0.0, 0.0, 1.5)))
    assert names == [("R", pytest.approx(3.77)), ("W", 12.0)]  # hidden or not: that is for the depth to say


def test_a_face_that_fills_the_whole_frame_is_a_candidate(design: BimModel) -> None:
    assert ("W", 12.0) in _names(design, _looking_north((0.3, 4.2, 1.4)))


def test_distance_limits_the_candidates(design: BimModel) -> None:
    assert _names(design, _looking_north((0.0, 0.0, 1.5)), reach_m=6.0) == [("W", 12.0)]
    assert ("far", 1.2) in _names(design, _looking_north((0.0, 0.0, 1.5)), reach_m=100.0)


def test_balls_are_laid_round_the_faces_once_for_all_stations(
    design: BimModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    before = candidates_module._balls

    def counted(faces):  # type: ignore[no-untyped-def]
        asked.append(len(faces))
        return before(faces)

    monkeypatch.setattr(candidates_module, "_balls", counted)
    first = candidates(design, _looking_north((0.0, 0.0, 1.5)), CAMERA, 20.0)
    assert candidates(design, _looking_north((0.0, 0.0, 1.5)), CAMERA, 20.0) == first
    assert len(asked) == 1
