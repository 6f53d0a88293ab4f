from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about, noted
from asbuilt_bim.errors import OutputError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.report.drawings.label_placing import free_box
from asbuilt_bim.report.drawings.lettering import ascii_text
from asbuilt_bim.report.drawings.overlay import draw_overlay
from asbuilt_bim.report.drawings.overlay_labels import place_label
from asbuilt_bim.report.drawings.overlay_layout import known_of, overlay_layout
from asbuilt_bim.report.drawings.private import shower_of
from asbuilt_bim.report.wording.of_faces import NOT_COUNTED_LABEL, UNCOUNTED
from tests.report.sample_report import renamed, sample_picture, sample_report


def drawn(index: int = 0, width: int = 1280) -> np.ndarray:
    report = sample_report()
    data = draw_overlay(
        sample_picture(width, width * 3 // 4), report.stations[index], known_of(report), shower_of(report, whole=True)
    )
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


def overlap(a, b) -> float:
    return max(0, min(a.left + a.width, b.left + b.width) - max(a.left, b.left)) * max(
        0, min(a.top + a.height, b.top + b.height) - max(a.top, b.top)
    )


def test_outlines_lie_where_the_faces_are_at_any_picture_size():
    report = sample_report()
    for width in (1280, 640, 320):
        ring = overlay_layout(report.stations[0], known_of(report), width, width * 3 // 4).outlines[1].rings[0]
        scale = width / 1280
        expected = (report.stations[0].faces[0].outline_px[0] + 0.5) * scale - 0.5
        assert np.allclose(ring, expected)


def test_labels_say_the_element_and_its_area_with_sigma():
    report = sample_report()
    labels = overlay_layout(report.stations[0], known_of(report), 1280, 960).labels
    assert ("C-01", "1.35 ± 0.02 m²") in {label.lines for label in labels}
    assert ("target 4.360 m",) in {label.lines for label in labels}


def test_an_unmatched_face_is_dashed_and_says_so():
    report = sample_report()
    layout = overlay_layout(report.stations[0], known_of(report), 1280, 960)
    assert [outline.dashed for outline in layout.outlines] == [False, False, True]
    assert ("2: 0.62 ± 0.02 m² (part)",) in {label.lines for label in layout.labels}


def test_labels_do_not_cover_one_another_and_stay_in_the_picture():
    report = sample_report()
    labels = overlay_layout(report.stations[0], known_of(report), 1280, 960).labels
    pairs = [(a, b) for i, a in enumerate(labels) for b in labels[i + 1 :]]
    assert all(overlap(a, b) == 0 for a, b in pairs)
    assert all(x.left >= 0 and x.left + x.width <= 1280 and x.top >= 0 and x.top + x.height <= 960 for x in labels)


def test_a_crowd_of_labels_is_spread():
    taken = []
    boxes = [free_box((500.0, 400.0), 120.0, 40.0, (1280.0, 960.0), taken) for _ in range(12)]
    assert len({(round(x), round(y)) for x, y, _, _ in boxes}) == 12


def test_the_overlay_keeps_the_picture_and_adds_a_legend_below():
    image = drawn()
    assert image.shape[1] == 1280 and image.shape[0] > 960
    plain = cv2.imdecode(np.frombuffer(sample_picture(), np.uint8), cv2.IMREAD_COLOR)
    corner = np.abs(image[900:950, 1200:1270].astype(int) - plain[900:950, 1200:1270])
    assert corner.mean() < 8.0


def test_the_hole_of_a_face_is_not_tinted():
    image, plain = drawn(), cv2.imdecode(np.frombuffer(sample_picture(), np.uint8), cv2.IMREAD_COLOR)
    change = np.abs(image[:960].astype(int) - plain).mean(axis=2)
    assert change[470:590, 790:870].mean() < 8.0
    assert change[300:360, 950:1150].mean() > 12.0


def test_a_small_picture_gives_an_overlay_too():
    assert drawn(width=320).shape[1] == 320


def test_no_exif_passes_into_an_overlay():
    report = sample_report()
    exif = b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x00GPS-SECRET"
    picture = sample_picture()
    tagged = picture[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + picture[2:]
    data = draw_overlay(tagged, report.stations[0], known_of(report), shower_of(report, whole=True))
    assert b"GPS-SECRET" in tagged and b"GPS-SECRET" not in data and b"Exif" not in data


def test_a_damaged_picture_is_an_output_error_that_names_the_station():
    report = sample_report()
    with pytest.raises(OutputError, match="station A1"):
        draw_overlay(b"not a picture", report.stations[0], known_of(report), shower_of(report, whole=True))


def test_without_opencv_5_text_is_written_in_plain_letters(monkeypatch):
    monkeypatch.delattr(cv2, "FontFace", raising=False)
    assert drawn(2).shape[1] == 1280
    assert ascii_text("Süd 1.35 ± 0.02 m² 墙") == "Sud 1.35 +- 0.02 m2 ?"


def test_a_small_unmatched_face_is_outlined_without_a_label():
    report = sample_report()
    small = replace(report.stations[0].faces[1], outline_px=(frozen([[10, 10], [40, 10], [40, 40], [10, 40]]),))
    station = replace(report.stations[0], faces=(report.stations[0].faces[0], small))
    layout = overlay_layout(station, known_of(report), 1280, 960)
    assert len(layout.outlines) == 2 and not any(label.lines[0].startswith("2:") for label in layout.labels)


def test_a_label_that_moved_off_its_face_points_back_at_it():
    taken = []
    first, second = (place_label((400.0, 300.0), ("Column C-01",), 18.0, (1280.0, 960.0), taken) for _ in range(2))
    assert first.leader is None
    assert second.leader is not None and second.leader[:2] == (400.0, 300.0)


@pytest.mark.parametrize("code", [Reason.STANDS_OFF, Reason.SURFACE_UNCLEAR, Reason.STARTER_BARS])
def test_what_does_not_count_is_drawn_as_such_and_bears_neither_name_nor_area(code):
    report = sample_report()
    face = report.stations[0].faces[0]
    index = [element.global_id for element in report.elements].index(face.elements[0])
    note = noted(code, about(SubjectKind.FACE, face.face_id, "A1"), area_m2=face.area_m2, offset_m=0.08)
    unclear = renamed(report, index, notes=(note,))
    layout = overlay_layout(unclear.stations[0], known_of(unclear), 1280, 960)
    assert NOT_COUNTED_LABEL in {outline.meaning for outline in layout.outlines}
    assert any(label.lines == (UNCOUNTED[code],) for label in layout.labels)
    assert ("C-01", "1.35 ± 0.02 m²") not in {label.lines for label in layout.labels}


def test_a_face_of_another_colour_that_counts_keeps_its_elements_name():
    report = sample_report()
    face = report.stations[0].faces[0]
    index = [element.global_id for element in report.elements].index(face.elements[0])
    note = noted(Reason.OTHER_COLOUR, about(SubjectKind.FACE, face.face_id, "A1"), counted=True)
    layout = overlay_layout(report.stations[0], known_of(renamed(report, index, notes=(note,))), 1280, 960)
    assert ("C-01", "1.35 ± 0.02 m²") in {label.lines for label in layout.labels}
