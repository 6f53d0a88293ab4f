"""A network and geometry agree, or say who alone saw it; what a network knows to be something else is no concrete."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.masks.fusion import Agreed, agree
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource
from asbuilt_bim.vision.scene.geometric import (
    GeometricOptions,
    of_concretes_colour,
    segment_scene,
    upright_instances,
)
from asbuilt_bim.vision.scene.read import Scene, read_scene
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from tests.measure.box_world import site

COLUMN, ROUND, WALL = (300, 265), (300, 405), (300, 570)  # a pixel (row, column) on each


@dataclass
class FakeNetwork:
    """Says what it was told to say."""

    instances: list[Instance] = field(default_factory=list)
    others: tuple[BoolArray, ...] = ()
    name: str = "fake"

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        return self.instances

    def refuted(self, pair: RectifiedPair) -> tuple[BoolArray, ...]:
        return self.others


@pytest.fixture(scope="module")
def pair() -> RectifiedPair:
    return site()[1]


@pytest.fixture(scope="module")
def scene(pair: RectifiedPair) -> Scene:
    return read_scene(pair, depth_map(pair, SemiGlobalMatcher()))


@pytest.fixture(scope="module")
def alone(pair: RectifiedPair, scene: Scene) -> list[Instance]:
    return segment_scene(pair, scene)


def at(instances: list[Instance] | tuple[Instance, ...], pixel: tuple[int, int]) -> Instance | None:
    return next((instance for instance in instances if instance.mask[pixel]), None)


def said(mask: BoolArray, label: InstanceClass, score: float = 0.8) -> Instance:
    rows, columns = np.nonzero(mask)
    box = (int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1)
    return Instance(label=label, score=score, mask=mask, box_px=box, source=InstanceSource.NETWORK, segmenter="fake")


def mask_at(alone: list[Instance], pixel: tuple[int, int]) -> BoolArray:
    found = at(alone, pixel)
    assert found is not None
    return found.mask


def both(pair: RectifiedPair, scene: Scene, network: FakeNetwork, options: GeometricOptions | None = None) -> Agreed:
    return agree(pair, scene, None, network, options or GeometricOptions())


def test_what_both_see_carries_both_names_and_keeps_geometrys_mask_but_for_a_band_at_its_border(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    blunt = mask_at(alone, WALL).copy()
    blunt[::3] = False  # most of it is enough to mean it
    blunt[:, :5] = True
    found = both(pair, scene, FakeNetwork([said(blunt, "wall", 0.77)]))
    wall = at(found.instances, WALL)
    assert wall is not None
    assert (wall.source, wall.segmenter, wall.label, wall.score) == (InstanceSource.BOTH, "fake", "wall", 0.77)
    matched = mask_at(alone, WALL).astype(np.uint8)
    band = np.ones((25, 25), np.uint8)
    inner, outer = cv2.erode(matched, band, borderValue=0) > 0, cv2.dilate(matched, band) > 0
    assert wall.mask[inner].all()
    assert not wall.mask[~outer].any()
    assert found.notes == ()


def test_what_the_network_misses_stays_and_says_so(pair: RectifiedPair, scene: Scene, alone: list[Instance]) -> None:
    found = both(pair, scene, FakeNetwork())
    assert [i.label for i in found.instances] == [i.label for i in alone]
    assert {i.source for i in found.instances} == {InstanceSource.GEOMETRY_ALONE}
    assert [i.score for i in found.instances] == [0.5 * i.score for i in alone], "one opinion of two"


def test_a_network_that_sees_nothing_where_geometry_sees_walls_is_told_for_its_card_may_be_wrong(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    (note,) = both(pair, scene, FakeNetwork()).notes
    assert (note.code, note.subject.at_station) == (Reason.NETWORK_SAW_NOTHING, pair.name)
    assert "network fake" in words_of(note).what and "least_score" in words_of(note).remedy
    assert both(pair, scene, FakeNetwork([said(mask_at(alone, WALL), "wall")])).notes == ()


def test_a_slender_things_class_is_the_networks_a_wide_or_round_ones_is_its_size(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    network = FakeNetwork(
        [
            said(mask_at(alone, COLUMN), "wall"),
            said(mask_at(alone, ROUND), "wall"),
            said(mask_at(alone, WALL), "column"),
        ]
    )
    found = both(pair, scene, network).instances
    labels = [instance.label for pixel in (COLUMN, ROUND, WALL) if (instance := at(found, pixel))]
    assert labels == ["wall", "column", "wall"]


def test_a_map_of_classes_is_divided_by_geometry_into_walls_and_columns_with_their_own_class(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    class Semantic(FakeNetwork):
        finds_things = False

    everywhere = mask_at(alone, COLUMN) | mask_at(alone, ROUND) | mask_at(alone, WALL)
    found = both(pair, scene, Semantic([said(everywhere, "column")])).instances
    three = [at(found, pixel) for pixel in (COLUMN, ROUND, WALL)]
    assert [one and (one.label, one.source) for one in three] == [
        (label, InstanceSource.BOTH) for label in ("column", "column", "wall")
    ]
    assert len({id(one) for one in three}) == 3, "before, all were one wall"


def test_what_the_network_knows_to_be_something_else_is_no_instance(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    found = both(pair, scene, FakeNetwork(others=(mask_at(alone, WALL),)))
    assert at(found.instances, WALL) is None
    assert at(found.instances, COLUMN) is not None


def test_the_networks_word_stands_for_colour_but_not_for_size(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    strict = GeometricOptions(most_chroma=1e-6)
    assert segment_scene(pair, scene, strict) == []
    network = FakeNetwork([said(mask_at(alone, WALL), "wall")])
    found = both(pair, scene, network, strict)
    assert [i.source for i in found.instances] == [InstanceSource.BOTH]
    (note,) = found.notes
    assert note.code is Reason.SURFACES_OF_OTHER_COLOUR and note.values["count"] == len(alone) - 1
    tiny = GeometricOptions(most_chroma=1e-6, least_height_m=50.0)
    assert both(pair, scene, network, tiny).instances == ()


def test_what_is_left_out_for_its_colour_is_told_with_how_many_there_are_and_where_the_largest_stands(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    found = upright_instances(pair, scene, GeometricOptions(most_chroma=1e-6))
    grey, (note,) = of_concretes_colour(found, pair.name)
    assert grey == [] and note.values["count"] == len(alone)
    x, y = int(note.values["x_px"]), int(note.values["y_px"])
    assert alone[0].mask[y - 2 : y + 3, x - 2 : x + 3].any()
    assert f"{len(alone)} upright ones aren't as grey as concrete" in words_of(note).reason
    assert of_concretes_colour(alone, pair.name) == (alone, ())


def test_concrete_that_only_the_network_sees_is_named_and_not_measured(pair: RectifiedPair, scene: Scene) -> None:
    sky = np.zeros(scene.labels.shape, bool)
    sky[5:80, 450:780] = True
    found = both(pair, scene, FakeNetwork([said(sky, "wall")]))
    (note,) = found.notes
    assert (note.code, note.values["segmenter"]) == (Reason.INSTANCE_WITHOUT_SURFACE, "fake")
    assert "fake sees a wall" in words_of(note).reason and "not measured" in words_of(note).remedy
    assert not any(i.mask[sky].mean() > 0.5 for i in found.instances)


def test_two_of_the_networks_instances_divide_what_geometry_holds_for_one(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    column = mask_at(alone, COLUMN)
    numbers = sorted({int(n) for n in np.unique(scene.labels[column]) if n >= 0})
    assert len(numbers) == 2, "the column shows two sides"
    network = FakeNetwork([said(column & (scene.labels == n), "column", 0.6 + 0.1 * k) for k, n in enumerate(numbers)])
    found = [i for i in both(pair, scene, network).instances if (i.mask & column).any()]
    assert sorted(i.score for i in found) == pytest.approx([0.6, 0.7])


def test_surfaces_that_one_of_the_networks_things_holds_are_one_instance_also_beside_each_other(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    across = mask_at(alone, COLUMN) | mask_at(alone, WALL)
    found = both(pair, scene, FakeNetwork([said(across, "wall")])).instances
    held = [one for one in found if one.source is InstanceSource.BOTH]
    assert len(held) == 1
    assert held[0].mask[COLUMN]
    assert held[0].mask[WALL]


def test_a_network_that_knows_no_concrete_rejects_and_leaves_the_rest_to_geometry(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    class Rejecting(FakeNetwork):
        finds_concrete = False

    agreed = both(pair, scene, Rejecting(others=(mask_at(alone, WALL),)))
    found = agreed.instances
    assert agreed.notes == (), "it isn't told that it sees no wall: it knows none"
    rest = [one for one in alone if not one.mask[WALL]]
    assert at(found, WALL) is None and len(rest) == len(alone) - 1
    assert [(i.label, i.source, i.score) for i in found] == [(i.label, i.source, i.score) for i in rest]


def test_a_wall_that_the_network_sees_on_what_stereo_measures_as_level_is_no_wall(
    pair: RectifiedPair, scene: Scene, alone: list[Instance]
) -> None:
    floor = (scene.labels >= len(scene.pieces)) & (scene.labels < scene.bars_label)
    assert np.count_nonzero(floor) > 20_000
    notes = both(pair, scene, FakeNetwork([said(floor, "wall")])).notes
    assert [note.code for note in notes] == [Reason.NETWORK_SAW_NOTHING], "level ground isn't noted as concrete"
    over = mask_at(alone, WALL) | floor
    wall = at(both(pair, scene, FakeNetwork([said(over, "wall")])).instances, WALL)
    assert wall is not None and wall.source is InstanceSource.BOTH
    band = cv2.dilate(mask_at(alone, WALL).astype(np.uint8), np.ones((25, 25), np.uint8)) > 0
    assert not np.any(wall.mask & floor & ~band), "beyond its border's band no floor is taken for the wall"
