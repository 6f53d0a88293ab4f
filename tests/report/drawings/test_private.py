"""Pictures that leave show elements and what was measured; people beside them can't be known by them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.progress.report import ProgressReport, StationRecord
from asbuilt_bim.project.networks import NetworkChoice, people_sought
from asbuilt_bim.report.drawings.private import blurred_but, shower_of
from asbuilt_bim.report.outputs import write_outputs
from asbuilt_bim.report.page.photos import station_cards
from asbuilt_bim.report.page.write import page_html
from tests.report.sample_report import sample_report

SIZE = (960, 1280)


def noise() -> np.ndarray:
    """Return a picture whose every pixel can be told from its neighbours."""
    return np.random.default_rng(3).integers(0, 256, (*SIZE, 3), dtype=np.uint8)


def square(low: float, high: float) -> np.ndarray:
    return frozen(np.array([[low, low], [high, low], [high, high], [low, high]]))


def with_one_face(report: ProgressReport) -> tuple[ProgressReport, StationRecord]:
    """Return a result whose first station measured one face in a corner, and decided nothing else."""
    station = report.stations[0]
    scale = station.width_px / 1280
    ring = frozen(np.array([[100.0, 100.0], [300.0, 100.0], [300.0, 400.0], [100.0, 400.0]]) * scale)
    face = replace(station.faces[0], outline_px=(ring,))
    station = replace(station, faces=(face,), target_left_px=None)
    faces = tuple(replace(f, surface=replace(f.surface, stations={})) for f in report.faces)
    return replace(report, stations=(station, *report.stations[1:]), faces=faces), station


def test_a_picture_is_sharp_in_what_was_measured_and_unknowable_elsewhere() -> None:
    report, station = with_one_face(sample_report())
    image = noise()
    shown = shower_of(report, whole=False).shown(image, station)
    assert np.array_equal(shown[110:390, 110:290], image[110:390, 110:290])
    far = shown[500:, 500:].astype(float)
    assert np.abs(np.diff(far, axis=1)).max() < 8.0  # nothing in it is as small as a face's eye
    assert np.array_equal(shower_of(report, whole=True).shown(image, station), image)


def test_where_outlines_overlap_both_are_sharp() -> None:
    image = noise()
    square = np.array([[100.0, 100.0], [500.0, 100.0], [500.0, 500.0], [100.0, 500.0]])
    shown = blurred_but(image, [(square,), (square + 150.0,)])
    assert np.array_equal(shown[260:490, 260:490], image[260:490, 260:490])


def test_where_an_element_is_missing_nobody_past_its_place_can_be_known_but_that_it_is_missing_shows() -> None:
    report, station = with_one_face(sample_report())
    pose = np.eye(4)
    design = replace(
        report.faces[0],
        kind="plane",
        frame_m=frozen(np.array([[-1.0, -1.0, 5.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
        surface=replace(
            report.faces[0].surface,
            stations={station.name: 1.0},
            open_uv_m=((square(0.0, 2.0), square(0.5, 1.1)),),  # a person stood before the hole
            built_uv_m=(),
        ),
    )
    station = replace(station, world_from_left=frozen(pose), rectified_from_left=frozen(np.eye(3)))
    report = replace(report, faces=(design, *report.faces[1:]), stations=(station, *report.stations[1:]))
    image = noise()
    image[:, 640:, 2] = 255  # half of it is red: cells keep that
    shown = shower_of(report, whole=False).shown(image, station)
    scale = 1280 / station.width_px

    def at(u_m: float, v_m: float) -> tuple[slice, slice]:
        x = round((station.f_px * (u_m - 1.0) / 5.0 + station.cx_px) * scale)
        y = round((station.f_px * (v_m - 1.0) / 5.0 + station.cy_px) * scale)
        return slice(y - 4, y + 4), slice(x - 4, x + 4)

    red, other, before = (shown[at(*where)].astype(float) for where in ((1.5, 1.5), (0.3, 1.5), (0.8, 0.8)))
    assert max(red.std(axis=(0, 1)).max(), other.std(axis=(0, 1)).max()) < 25.0  # of noise whose own is 74
    assert red[..., 2].mean() > 220.0 and abs(other[..., 2].mean() - 128.0) < 40.0
    assert before.std(axis=(0, 1)).max() < 8.0


def test_where_an_element_was_judged_but_not_measured_here_nobody_before_it_can_be_known() -> None:
    """A worker stood sharp before a column that other stations had measured."""
    report, station = with_one_face(sample_report())
    surface = replace(
        report.faces[0].surface, stations={station.name: 1.0}, built_uv_m=((square(0.0, 2.0),),), open_uv_m=()
    )
    frame_m = frozen(np.array([[-1.0, -1.0, 5.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    design = replace(report.faces[0], kind="plane", frame_m=frame_m, surface=surface)
    looking = replace(station, world_from_left=frozen(np.eye(4)), rectified_from_left=frozen(np.eye(3)))
    for elements in ((), (design.element,)):
        measured = replace(looking.faces[0], elements=elements)
        one = replace(looking, faces=(measured,))
        seen = replace(report, faces=(design, *report.faces[1:]), stations=(one, *report.stations[1:]))
        shown = shower_of(seen, whole=False).shown(noise(), one).astype(float)
        scale = 1280 / one.width_px
        x, y = round(one.cx_px * scale) + 100, round(one.cy_px * scale) + 100
        assert shown[y - 4 : y + 4, x - 4 : x + 4].std(axis=(0, 1)).max() < 25.0  # of noise whose own is 74


def test_what_stands_before_an_element_is_blurred_and_the_target_is_not() -> None:
    report, station = with_one_face(sample_report())
    scale = station.width_px / 1280
    body = frozen(np.array([[180.0, 150.0], [260.0, 150.0], [260.0, 350.0], [180.0, 350.0]]) * scale)
    disc = {"target_left_px": frozen(np.array([220.0, 200.0]) * scale), "target_radius_px": 15.0 * scale}
    station = replace(station, before_px=(body,), **disc)
    image = noise()
    shown = shower_of(report, whole=False).shown(image, station)
    assert np.array_equal(shown[120:140, 120:160], image[120:140, 120:160])
    assert np.array_equal(shown[192:208, 212:228], image[192:208, 212:228])
    assert shown[250:340, 190:250].astype(float).std(axis=(0, 1)).max() < 25.0


def test_pages_and_overlays_hold_the_blurred_picture_alone(tmp_path: Path) -> None:
    report, station = with_one_face(sample_report())
    data = cv2.imencode(".jpg", noise(), [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / f"{station.name}.jpg").write_bytes(data)
    write_outputs(report, tmp_path / "out", tmp_path / "pictures")
    overlay = cv2.imread(str(tmp_path / "out" / station.overlay))
    (card, *_) = station_cards(report, {station.name: data})
    assert card.photo is not None
    assert overlay[500:900, 700:].std() < 25.0 < overlay[110:390, 110:290].std()
    whole = replace(report, pictures="whole")
    (open_card, *_) = station_cards(whole, {station.name: data})
    assert open_card.photo is not None and len(card.photo.jpeg) < 0.5 * len(open_card.photo.jpeg)


def test_the_page_says_what_its_pictures_show_and_whether_people_were_looked_for() -> None:
    report = sample_report()
    assert "All else is blurred" in page_html(report, {})
    assert "What 2 outlines given by hand held is blurred" in page_html(replace(report, people_outlined=2), {})
    assert "can be recognised" in page_html(replace(report, people_sought=False), {})
    page = page_html(replace(report, people_sought=True, pictures="whole"), {})
    assert "whole photos, as somebody asked" in page and "blurs those that it finds" in page


def test_without_a_network_nobody_looks_for_people() -> None:
    assert people_sought(NetworkChoice()) is False
    assert people_sought(NetworkChoice(segment="plugin:x")) is False
