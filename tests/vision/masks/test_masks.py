"""Masks that are given: read with care, carried through the lens to the very pixel."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import MaskError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.vision.masks.coco import class_of
from asbuilt_bim.vision.masks.file import read_masks
from asbuilt_bim.vision.masks.given import (
    GivenMask,
    GivenMasks,
    photo_from_rectified,
    region_mask,
)

SIZE = (160, 120)
SQUARE = [[40.0, 30.0], [100.0, 30.0], [100.0, 90.0], [40.0, 90.0]]


def lens() -> Intrinsics:
    k = frozen([[150.0, 0.0, 81.0], [0.0, 150.0, 59.0], [0.0, 0.0, 1.0]])
    return Intrinsics(K=k, distortion=frozen([-0.22, 0.06, 0.001, -0.001, 0.0]), width_px=160, height_px=120)


def rig() -> StereoRig:
    pose = rigid(rotation_from_vector([0.01, -0.02, 0.005]), [-0.25, 0.002, 0.003])
    return StereoRig(left=lens(), right=lens(), right_from_left=pose, covariance=np.zeros((14, 14)))


def write(path: Path, document: object) -> Path:
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def coco(segmentation: object, **more: object) -> dict[str, object]:
    return {
        "images": [{"id": 1, "file_name": "photos/left.jpg", "width": 160, "height": 120}],
        "categories": [{"id": 1, "name": "Concrete wall"}, {"id": 2, "name": "pillar"}, {"id": 3, "name": "person"}],
        "annotations": [{"id": 9, "image_id": 1, "category_id": 1, "segmentation": segmentation}],
    } | more


def test_a_polygon_holds_the_pixels_whose_centres_lie_in_it() -> None:
    ring = frozen([[9.6, 4.6], [20.4, 4.6], [20.4, 12.4], [9.6, 12.4]])
    hole = frozen([[13.5, 7.5], [15.5, 7.5], [15.5, 9.5], [13.5, 9.5]])
    mask = region_mask((ring, hole), (20, 30))
    expected = np.zeros((20, 30), dtype=bool)
    expected[5:13, 10:21] = True
    expected[8:10, 14:16] = False
    assert np.array_equal(mask, expected)


def test_pixels_go_through_the_lens_and_back() -> None:
    prepared = rectification(rig())
    points = np.array([[3.0, 4.0], [150.0, 110.0], [80.0, 60.0]])
    there = prepared.camera.project(lens().rays(points))
    assert np.abs(there - points).max() > 1.0
    assert np.abs(photo_from_rectified(there, lens(), prepared.camera) - points).max() < 1e-6


def test_a_given_polygon_and_a_given_picture_lie_where_rectification_puts_the_photo() -> None:
    painted = np.zeros((120, 160, 3), dtype=np.uint8)
    painted[30:91, 40:101] = 255
    pair = rectify(rectification(rig()), painted, painted, "T")
    ring = frozen([[39.5, 29.5], [100.5, 29.5], [100.5, 90.5], [39.5, 90.5]])
    label = painted[..., 0] > 0
    masks = (
        GivenMask(label="wall", name="ring", polygons=((ring,),)),
        GivenMask(label="column", name="pixels", pixels=label),
    )
    found = GivenMasks(photo=lens(), masks=masks).segment(pair, None)
    truth = pair.left[..., 0] > 127
    for instance in found:
        assert np.count_nonzero(instance.mask ^ truth) < 0.01 * np.count_nonzero(truth)
        x0, y0, x1, y1 = instance.box_px
        assert np.count_nonzero(instance.mask[y0:y1, x0:x1]) == np.count_nonzero(instance.mask)
    assert [(instance.label, instance.segmenter) for instance in found] == [("wall", "ring"), ("column", "pixels")]


def test_coco_polygons_begin_at_pixel_corners(tmp_path: Path) -> None:
    flat = [value + 0.5 for point in SQUARE for value in point]
    found = read_masks(write(tmp_path / "m.json", coco([flat])), SIZE, "left.jpg")
    assert found.masks[0].label == "wall"
    assert np.allclose(found.masks[0].polygons[0][0], SQUARE)


def packed(counts: list[int]) -> str:
    """COCO's packing, written from its published description: 5 bits a letter, differences from the third on."""
    text = ""
    for i, count in enumerate(counts):
        value, more = count - (counts[i - 2] if i > 2 else 0), True
        while more:
            bits = value & 31
            value >>= 5
            more = value != (-1 if bits & 16 else 0)
            text += chr((bits | 32 if more else bits) + 48)
    return text


@pytest.mark.parametrize("form", ["plain", "packed"])
def test_run_lengths_run_down_the_columns(tmp_path: Path, form: str) -> None:
    mask = np.zeros((120, 160), dtype=np.uint8)
    mask[30:91, 40:101] = 1
    mask[50:60, 70:75] = 0
    flat = mask.T.ravel()
    changes = np.flatnonzero(np.diff(flat)) + 1
    counts = np.diff(np.concatenate([[0], changes, [flat.size]])).tolist()
    given = {"size": [120, 160], "counts": packed(counts) if form == "packed" else counts}
    found = read_masks(write(tmp_path / "m.json", coco(given)), SIZE, "left.jpg")
    assert np.array_equal(found.masks[0].pixels, mask > 0)


def test_what_is_neither_wall_nor_column_is_left_out_by_name(tmp_path: Path) -> None:
    document = coco([[1, 1, 9, 1, 9, 9]])
    one = document["annotations"][0]  # type: ignore[index]
    document["annotations"] = [one, {**one, "category_id": 3}, {**one, "category_id": 2}]
    found = read_masks(write(tmp_path / "m.json", document), SIZE, "left.jpg")
    assert [mask.label for mask in found.masks] == ["wall", "column"]
    assert found.left_out == ("1 masks of 'person', which is no wall or column",)
    assert class_of("Stahlbeton-Wall") == "wall"
    assert class_of("window") is None


def test_of_several_photos_the_one_with_the_name_counts(tmp_path: Path) -> None:
    document = coco([[1, 1, 9, 1, 9, 9]])
    other = {"id": 2, "file_name": "other.jpg", "width": 160, "height": 120}
    document["images"] = [other, *document["images"]]  # type: ignore[misc]
    path = write(tmp_path / "m.json", document)
    assert len(read_masks(path, SIZE, "left.jpg").masks) == 1
    document["annotations"] = [{**document["annotations"][0], "image_id": 2, "category_id": 3}]  # type: ignore[index]
    write(path, document)
    with pytest.raises(MaskError, match="holds no wall and no column of this photo; 1 masks of 'person', which is no"):
        read_masks(path, SIZE, "other.jpg")
    with pytest.raises(MaskError, match="0 of 2 are named third"):
        read_masks(path, SIZE, "third.jpg")


@pytest.mark.parametrize(
    ("segmentation", "said"),
    [
        ([[1, 2, 3]], "three points"),
        ([[1, 2, 3, 4, 5, "x"]], "finite numbers"),
        ([[1, 2, 3, 4, 5, 1e9]], "finite numbers"),
        ("0101", "list of polygons"),
        ({"size": [1, 1], "counts": [1]}, "is not"),
        ({"size": [120, 160], "counts": [5]}, "add up to 5"),
        ({"size": [120, 160], "counts": [-1, 19201]}, "whole numbers"),
        ({"size": [120, 160], "counts": "\x00"}, "no packed COCO text"),
        ({"size": [120, 160], "counts": "oooooooooooo0"}, "no packed COCO text"),
        ({"size": [120, 160], "counts": "o"}, "middle of a number"),
    ],
)
def test_a_damaged_coco_file_is_refused_in_words(tmp_path: Path, segmentation: object, said: str) -> None:
    with pytest.raises(MaskError, match=said):
        read_masks(write(tmp_path / "m.json", coco(segmentation)), SIZE, "left.jpg")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "nested too deeply|not JSON"),
        ('{"annotations": NaN}', "NaN"),
        ("[]", "keys with values"),
        ("{}", "neither COCO"),
        ('{"annotations": [], "images": 3}', "images must be a list"),
        (
            '{"format": "asbuilt-bim/clicks", "version": 1, "polygons": [{"class": "door"}]}',
            "three points|neither wall",
        ),
        ("polygon,class,x\n", "the first line must be"),
    ],
)
def test_a_file_that_is_something_else_is_refused_in_words(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / ("m.csv" if text.startswith("polygon") else "m.json")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MaskError, match=said):
        read_masks(path, SIZE)


def test_clicked_polygons_are_read_from_json_and_csv(tmp_path: Path) -> None:
    hole = [[60, 50], [70, 50], [70, 60]]
    document = {
        "format": "asbuilt-bim/clicks", "version": 1,
        "polygons": [{"class": "column", "points_px": SQUARE, "holes_px": [hole]}],
    }  # fmt: skip
    (mask,) = read_masks(write(tmp_path / "m.json", document), SIZE).masks
    assert mask.label == "column"
    assert [len(ring) for ring in mask.polygons[0]] == [4, 3]
    lines = ["polygon,class,x_px,y_px", *(f"west,wall,{x},{y}" for x, y in SQUARE)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    (mask,) = read_masks(path, SIZE).masks
    assert (mask.label, mask.name) == ("wall", "polygon west")
    assert np.allclose(mask.polygons[0][0], SQUARE)


def test_clicks_as_csv_may_end_their_lines_as_on_any_system_and_what_is_no_csv_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    lines = ["polygon,class,x_px,y_px", *(f"west,wall,{x},{y}" for x, y in SQUARE)]
    path.write_bytes("\r".join(lines).encode())
    assert np.allclose(read_masks(path, SIZE).masks[0].polygons[0][0], SQUARE)
    path.write_bytes(("\n".join(lines) + "\n" + "x" * 200_000).encode())
    with pytest.raises(MaskError, match=r"m\.csv: .*line 6: no CSV"):
        read_masks(path, SIZE)


def test_labels_of_a_png_need_a_class_and_the_photos_size(tmp_path: Path) -> None:
    labels = np.zeros((120, 160), dtype=np.uint16)
    labels[10:20, 10:20], labels[50:60, 50:60] = 1, 300
    path = tmp_path / "m.png"
    cv2.imwrite(str(path), labels)
    found = read_masks(path, SIZE, classes={1: "wall", 300: "column"}).masks
    assert [(mask.label, np.count_nonzero(mask.pixels)) for mask in found] == [("wall", 100), ("column", 100)]
    with pytest.raises(MaskError, match="--mask-class 300=wall"):
        read_masks(path, SIZE, classes={1: "wall"})
    with pytest.raises(MaskError, match="160 x 120 px, the left photo has 1280 x 960"):
        read_masks(path, (1280, 960), classes={1: "wall"})
    cv2.imwrite(str(path), np.zeros((120, 160, 3), dtype=np.uint8))
    with pytest.raises(MaskError, match="one channel"):
        read_masks(path, SIZE)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(MaskError, match="truncated"):
        read_masks(path, SIZE)


def test_an_outline_that_crosses_itself_all_over_is_refused_at_once_and_a_slip_is_mended(tmp_path: Path) -> None:
    points = np.random.default_rng(0).uniform([0.0, 0.0], SIZE, (2000, 2))
    with pytest.raises(MaskError, match=r"annotations\[0\]: its outline crosses itself more than 100 times"):
        read_masks(write(tmp_path / "m.json", coco([points.ravel().tolist()])), SIZE, "left.jpg")
    bow = [[40.0, 30.0, 100.0, 90.0, 100.0, 30.0, 40.0, 90.0]]
    (mask,) = read_masks(write(tmp_path / "m.json", coco(bow)), SIZE, "left.jpg").masks
    assert region_mask(mask.polygons[0], (120, 160)).sum() == pytest.approx(1800, abs=120)


@pytest.mark.parametrize(
    ("polygons", "says"),
    [
        ([[1, 1, 9, 1, 9, 9]] * 2001, "2,001 polygons with 6,003 points"),
        ([[0, 0, 90_000, 0, 0, 90_000]] * 4, "outlines of 1,229,117 px together"),
    ],
)
def test_more_outlines_than_a_photo_has_are_refused(tmp_path: Path, polygons: list[list[int]], says: str) -> None:
    with pytest.raises(MaskError, match=says):
        read_masks(write(tmp_path / "m.json", coco(polygons)), SIZE, "left.jpg")


def test_of_a_polygon_beyond_the_photo_what_lies_in_it_counts() -> None:
    painted = np.full((120, 160, 3), 255, dtype=np.uint8)
    pair = rectify(rectification(rig()), painted, painted, "T")
    found = []
    for edge in (-0.5, -1e5):
        ring = frozen([[edge, edge], [60.5, edge], [60.5, 50.5], [edge, 50.5]])
        masks = (GivenMask(label="wall", name="m", polygons=((ring,),)),)
        found.append(GivenMasks(photo=lens(), masks=masks).segment(pair, None)[0].mask)
    assert np.array_equal(*found)


def test_masks_of_a_file_that_names_another_photo_alone_are_refused(tmp_path: Path) -> None:
    document = coco([[1, 1, 9, 1, 9, 9]])
    path = write(tmp_path / "m.json", document)
    with pytest.raises(MaskError, match=r"one image is 'photos/left.jpg', not G1.jpg: masks of another photo"):
        read_masks(path, SIZE, "G1.jpg")
    document["images"][0]["file_name"] = "G12.jpg"  # type: ignore[index]
    with pytest.raises(MaskError, match="masks of another photo"):
        read_masks(write(path, document), SIZE, "G1.jpg")
    document["images"][0]["file_name"] = "upload/7f3a-G1_jpg.rf.12ab.jpg"  # type: ignore[index]
    assert read_masks(write(path, document), SIZE, "G1.jpg").masks  # as annotation services rename what they are given


@pytest.mark.parametrize(
    ("key", "second", "says"),
    [
        ("categories", {"id": 1, "name": "column"}, r"categories\[3\]: the id 1 stands twice"),
        ("images", {"id": 1, "file_name": "other.jpg", "width": 160, "height": 120}, "images: the id 1 stands twice"),
    ],
)
def test_one_id_for_two_classes_or_two_photos_is_refused(
    tmp_path: Path, key: str, second: dict[str, object], says: str
) -> None:
    document = coco([[1, 1, 9, 1, 9, 9]])
    document[key].append(second)  # type: ignore[attr-defined]
    with pytest.raises(MaskError, match=says):
        read_masks(write(tmp_path / "m.json", document), SIZE, "left.jpg")
