import csv
import struct
from datetime import datetime
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from asbuilt_synthetic import sample
from asbuilt_synthetic.boards import Board, board_poses
from asbuilt_synthetic.lens import camera_of, in_frame, project
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.photo_file import ExifTags, write_photo
from asbuilt_synthetic.rig import rig_truth
from asbuilt_synthetic.tags import tag_image


@pytest.fixture
def folder(site_scene, tmp_path, monkeypatch) -> Path:
    calls = []

    def fake(scene, station, side):
        calls.append((station.name, side))
        return np.full((24, 32, 3), 90, np.uint8)

    monkeypatch.setattr(sample, "_renderer", lambda name: fake)
    monkeypatch.setattr(sample, "scene", lambda seed, visit, stations: site_scene)
    sample.write_site(site_scene.seed, tmp_path, visits=1, board_count=2, truth=False)
    assert len(calls) == 2 * len(site_scene.stations) + 4
    sample.write_site(site_scene.seed, tmp_path, visits=1, board_count=2, truth=False)
    assert len(calls) == 2 * len(site_scene.stations) + 4, "photos that are there are not taken again"
    return tmp_path


def test_the_project_file_names_photos_that_are_there(folder, site_scene):
    project_ = yaml.safe_load((folder / "project.yaml").read_text())
    assert project_["format"] == "asbuilt-bim/project" and (folder / project_["ifc"]).exists()
    (visit,) = project_["visits"]
    assert str(visit["date"]) == site_scene.day.isoformat()
    assert [s["name"] for s in visit["stations"]] == [s.name for s in site_scene.stations]
    assert all((folder / s[side]).exists() for s in visit["stations"] for side in ("left", "right"))
    assert len(list(folder.glob(project_["rig"]["boards"]["left"]))) == 2


def test_the_survey_lists_four_corners_a_tag_with_millimetres_of_noise(folder, site_scene):
    with (folder / "markers.csv").open() as f:
        rows = list(csv.DictReader(f))
    assert list(rows[0]) == ["id", "corner", "x_m", "y_m", "z_m"] and len(rows) == 4 * len(site_scene.markers)
    true = np.concatenate([m.true_corners_m for m in site_scene.markers])
    noise = np.array([[float(r[k]) for k in ("x_m", "y_m", "z_m")] for r in rows]) - true
    assert 0.0015 < noise.std() < 0.0025
    size = yaml.safe_load((folder / "project.yaml").read_text())["markers"]["size_m"]
    assert np.linalg.norm(true[1] - true[0]) == pytest.approx(size)


def test_a_photo_carries_the_camera_and_opens_as_jpeg(tmp_path):
    path = tmp_path / "a" / "p.jpg"
    tags = ExifTags(
        make="Synthetic",
        model="Stereo 250",
        serial="S-1-L",
        focal_mm=4.7,
        taken=datetime(2026, 3, 2, 9, 12),
        width_px=32,
        height_px=24,
    )
    write_photo(path, np.full((24, 32, 3), (200, 30, 20), np.uint8), tags)
    data = path.read_bytes()
    assert (
        np.abs(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[12, 16].astype(int) - [20, 30, 200]).max()
        < 8
    )
    assert data[:4] == b"\xff\xd8\xff\xe1" and data[6:12] == b"Exif\0\0"
    found = _exif(data[12:])
    assert found[0x010F] == b"Synthetic\0" and found[0x0110] == b"Stereo 250\0" and found[0xA431] == b"S-1-L\0"
    assert found[0x9003] == b"2026:03:02 09:12:00\0" and struct.unpack("<II", found[0x920A]) == (470, 100)
    assert not list(path.parent.glob("*.part"))


def _exif(tiff: bytes) -> dict[int, bytes]:
    out: dict[int, bytes] = {}
    offsets = [struct.unpack_from("<I", tiff, 4)[0]]
    while offsets:
        at = offsets.pop()
        for k in range(struct.unpack_from("<H", tiff, at)[0]):
            tag, kind, count = struct.unpack_from("<HHI", tiff, at + 2 + 12 * k)
            size = count * {2: 1, 3: 2, 4: 4, 5: 8}[kind]
            where = at + 10 + 12 * k if size <= 4 else struct.unpack_from("<I", tiff, at + 10 + 12 * k)[0]
            out[tag] = tiff[where : where + size]
            if tag == 0x8769:
                offsets.append(struct.unpack("<I", out[tag])[0])
    return out


def test_tags_are_printed_so_that_a_detector_reads_them():
    canvas = np.full((400, 400), 150, np.uint8)
    canvas[80:320, 80:320] = tag_image(17)[..., 0]
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    corners, ids, _ = detector.detectMarkers(canvas)
    assert ids.ravel().tolist() == [17]
    assert np.abs(corners[0][0] - [[104, 104], [295, 104], [295, 295], [104, 295]]).max() < 1.5


def test_the_boards_together_cover_the_frames_of_both_cameras():
    rig, board = rig_truth(2), Board()
    poses = board_poses(rig, board, np.random.default_rng(0), 20)
    for side in ("left", "right"):
        camera = camera_of(rig, side)
        shift = np.eye(4) if side == "left" else rig.right_from_left
        px = np.concatenate([project(camera, transform(shift @ p, board.corners_m())) for p in poses])
        px = px[in_frame(camera, px)]
        count, _, _ = np.histogram2d(px[:, 0], px[:, 1], bins=(6, 4), range=((0, 1280), (0, 960)))
        assert (count > 0).mean() > 0.9
