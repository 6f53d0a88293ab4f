from __future__ import annotations

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from asbuilt_bim.vision.networks.card import ClassCard, InputCard, NetworkCard
from asbuilt_bim.vision.networks.kinds import LoadedNetwork, NetworkSegmenter
from shapely.geometry import Polygon

from asbuilt_training.real.depth import depth_errors, flat, ramp
from asbuilt_training.real.figures import Figures, by_pixel, finder_of
from asbuilt_training.real.labels import KINDS, LABELS, LabelledPhoto, Shape, read_labels
from asbuilt_training.real.page import write_page
from asbuilt_training.real.score import Counts, Scored, by_view, counts_of, everything, in_quarters, mean_iou

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).resolve().parents[2] / "../shared/data"))


Corners = list[tuple[float, float]]


def photo(*shapes: tuple[str, Corners], size: tuple[int, int] = (40, 20), **more: str) -> LabelledPhoto:
    drawn = tuple(Shape(label=label, corners_px=np.array(corners, dtype=float)) for label, corners in shapes)
    keys = {"file": "a.jpg", "view": "yard", "distance": "far", **more}
    return LabelledPhoto(sha256="0" * 64, size_px=size, shapes=drawn, **keys)  # type: ignore[arg-type]


def box(x0: float, y0: float, x1: float, y1: float) -> Corners:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def test_every_label_is_a_simple_polygon_inside_its_photo() -> None:
    photos = read_labels()
    assert len(photos) >= 20
    for one in photos:
        for shape in one.shapes:
            assert shape.label in KINDS
            assert Polygon(shape.corners_px).is_valid, (one.file, shape.corners_px)
            assert (shape.corners_px >= 0).all() and (shape.corners_px <= np.array(one.size_px) - 1).all(), one.file


def test_each_view_has_one_distance_and_each_photo_is_labelled_once() -> None:
    photos = read_labels()
    assert len({one.file for one in photos}) == len(photos)
    assert len({(one.view, one.distance) for one in photos}) == len({one.view for one in photos})
    assert {one.distance for one in photos} == {"far", "ground"}


def test_no_picture_lies_beside_the_labels() -> None:
    files = [path for path in LABELS.parent.rglob("*") if path.is_file()]
    assert {path.suffix for path in files} == {".json", ".md"}
    assert sum(path.stat().st_size for path in files) < 200_000
    assert all(not Path(one.file).is_absolute() and ".." not in one.file for one in read_labels())


def test_the_labelled_photos_are_those_of_the_data_folder() -> None:
    if not (DATA / "photos").is_dir():
        pytest.skip(f"no real photographs in {DATA}")
    for one in read_labels():
        assert one.is_there(DATA), one.file
        eighth = np.asarray(cv2.imread(str(DATA / one.file), cv2.IMREAD_REDUCED_GRAYSCALE_8))  # decodes fast
        assert np.abs(8 * np.array(eighth.shape[::-1]) - one.size_px).max() < 8, one.file


def test_another_photo_under_a_labelled_name_is_not_taken_for_it(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"something else")
    assert not photo().is_there(tmp_path)


def test_a_label_file_of_another_shape_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text(json.dumps({"images": []}), encoding="utf-8")
    with pytest.raises(ValueError, match=r"mine\.json"):
        read_labels(tmp_path)


def test_a_later_polygon_lies_over_an_earlier_one() -> None:
    kinds = photo(("wall", box(0, 0, 19, 19)), ("rest", box(5, 5, 9, 9)), ("column", box(7, 7, 8, 8))).kinds()
    assert [kinds[y, x] for y, x in ((0, 0), (5, 5), (7, 7), (19, 20))] == [1, 0, 2, 0]
    assert np.count_nonzero(kinds) == 20 * 20 - 25 + 4


def test_a_smaller_map_shows_the_same_place() -> None:
    kinds = photo(("wall", box(0, 0, 19, 19))).kinds(20)
    assert kinds.shape == (10, 20)
    assert kinds[:, :10].all() and not kinds[:, 11:].any()


def test_iou_of_two_bars_that_half_overlap_is_a_third() -> None:
    kinds = photo(("wall", box(0, 0, 19, 19))).kinds()
    answer = np.zeros((20, 40), dtype=bool)
    answer[:, 10:30] = True
    counts = counts_of(answer, kinds)
    assert counts == Counts(right=200, wrong=200, missed=200, all=800)
    assert (counts.iou, counts.precision, counts.recall, counts.alarms) == (1 / 3, 0.5, 0.5, 0.25)


def test_unclear_pixels_count_for_nothing() -> None:
    kinds = photo(("wall", box(0, 0, 19, 19)), ("unclear", box(20, 0, 39, 19))).kinds()
    assert counts_of(everything(np.zeros((20, 40, 3), dtype=np.uint8)), kinds).iou == 1.0
    assert counts_of(kinds == 1, kinds).all == 400


def test_a_stone_column_counts_as_concrete() -> None:
    kinds = photo(("stone column", box(0, 0, 9, 19))).kinds()
    assert counts_of(kinds > 0, kinds).right == 200


def test_frames_of_one_view_count_once_and_views_without_concrete_not_at_all() -> None:
    def scored(view: str, right: int, missed: int) -> Scored:
        counts = Counts(right=right, wrong=0, missed=missed, all=100)
        nothing = np.zeros((2, 2), dtype=np.uint8)
        return Scored(photo=photo(view=view), image=nothing, kinds=nothing, answer=nothing > 0, counts=counts)

    views = by_view([scored("a", 1, 0), scored("a", 1, 1), scored("b", 1, 3), scored("none", 0, 0)], "far")
    assert mean_iou(views) == (0.5, 2)
    assert by_view([scored("a", 1, 0)], "ground") == {}


def test_quarters_are_put_back_where_they_were_cut() -> None:
    image = np.arange(5 * 7, dtype=np.uint8).reshape(5, 7, 1).repeat(3, axis=2)
    sizes: list[tuple[int, ...]] = []

    def even(part: np.ndarray) -> np.ndarray:
        sizes.append(part.shape[:2])
        return np.asarray(part[..., 0] % 2 == 0)

    assert (in_quarters(even)(image) == (image[..., 0] % 2 == 0)).all()
    assert sizes == [(2, 3), (2, 4), (3, 3), (3, 4)]


class Unsure:
    """Stands for a network that leans to wall on the left half, by very little."""

    path, inputs = Path("unsure.onnx"), ("image",)

    def run(self, pictures: tuple[np.ndarray, ...]) -> dict[str, np.ndarray]:
        height, width = pictures[0].shape[2] // 2, pictures[0].shape[3] // 2
        logits = np.zeros((1, 3, height, width))
        logits[:, 1, :, : width // 2] = 0.1
        return {"logits": logits, "offsets": np.zeros((1, 2, height, width))}


def test_by_pixel_a_network_answers_also_what_it_is_not_sure_of() -> None:
    classes = (ClassCard(id=1, name="wall", label="wall"), ClassCard(id=2, name="thing", label="other"))
    card = NetworkCard(
        format="asbuilt-bim/network", version=1, name="unsure", file="unsure.onnx", layout="centres",
        input=InputCard(width_px=64, height_px=32), classes=classes, outputs={"logits": "a", "offsets": "b"},
    )  # fmt: skip
    segmenter = NetworkSegmenter(loaded=LoadedNetwork(card=card, network=Unsure()))  # type: ignore[arg-type]
    image = np.zeros((32, 64, 3), dtype=np.uint8)
    assert not finder_of(segmenter)(image).any()
    found = finder_of(by_pixel(segmenter))(image)
    assert found[:, :30].all() and not found[:, 34:].any()


def test_depth_that_is_right_up_to_scale_and_shift_has_no_error() -> None:
    truth = np.linspace(2.0, 20.0, 200).reshape(10, 20)
    truth[0, 0] = np.nan
    for scale in (7.0, 1e-15):
        errors = depth_errors(scale / truth - 3.0 * scale, truth)
        assert errors.abs_rel == pytest.approx(0.0, abs=1e-9)
        assert (errors.within, errors.pixels) == (1.0, 199)


def test_a_flat_guess_says_the_mean_inverse_depth() -> None:
    truth = np.array([[1.0, 2.0]])  # inverse depth 1 and 1/2, their mean 3/4: Z = 4/3
    errors = depth_errors(flat((1, 2)), truth)
    assert errors.abs_rel == pytest.approx((1 / 3 + 1 / 3) / 2)
    assert errors.within == 0.0


def test_level_ground_is_what_a_ramp_describes() -> None:
    rows = np.arange(1, 21, dtype=float)[:, None]
    assert depth_errors(ramp((20, 5)), np.repeat(30.0 / rows, 5, axis=1)).abs_rel == pytest.approx(0.0, abs=1e-9)


def test_the_page_escapes_names_and_shows_each_photo(tmp_path: Path) -> None:
    kinds = photo(("wall", box(0, 0, 19, 19))).kinds()
    one = Scored(
        photo=photo(view="<b>yard</b>"), image=np.zeros((20, 40, 3), dtype=np.uint8), kinds=kinds, answer=kinds == 1,
        counts=counts_of(kinds == 1, kinds),
    )  # fmt: skip
    figures = Figures(network="<net>", scored=(one,), beside={}, stereo=(), depth=(), absent=())
    text = write_page(figures, tmp_path).read_text(encoding="utf-8")
    assert "<b>" not in text and "&lt;b&gt;yard" in text and "&lt;net&gt;" in text
    assert {path.name for path in tmp_path.iterdir()} == {"real.html", "00_labels.jpg", "00_answer.jpg"}
