from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.errors import PluginError
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array
from asbuilt_bim.project import networks
from asbuilt_bim.project.networks import NetworkChoice, identities, load_models
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.networks.interface_check import CheckedDepth, CheckedSegmenter
from asbuilt_bim.vision.stereo.depth import DepthMap
from tests.example_package import example_package
from tests.vision.stereo.test_depth_modes import pair

__all__ = ["example_package"]
MASK = np.zeros((120, 160), bool)
MASK[20:60, 30:50] = True
GOOD = Instance(label="wall", score=0.5, mask=MASK, box_px=(0, 0, 1, 1), source=InstanceSource.GIVEN)


@dataclass(frozen=True)
class Says:
    """A plugin that gives what it was told to."""

    answer: Any
    name: str = "says"

    def segment(self, pair: object, depth: object) -> Any:
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    def estimate(self, image: object) -> Any:
        return self.segment(None, None)


def segmented(answer: Any) -> list[Instance]:
    return CheckedSegmenter(name="says", who="the plugin 'says' of pack 1.0", inner=Says(answer)).segment(pair(), None)


def test_a_good_answer_comes_through_with_the_box_of_its_mask_and_the_plugins_name() -> None:
    empty = replace(GOOD, mask=np.zeros_like(MASK))
    (one,) = segmented([GOOD, empty])
    assert one.box_px == (30, 20, 50, 60)
    assert (one.source, one.segmenter) == (InstanceSource.NETWORK, "says")
    assert not one.mask.flags.writeable
    assert MASK.flags.writeable  # the plugin's own array is left as it was


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (RuntimeError("no memory"), r"failed \(RuntimeError: no memory\); report it to its makers"),
        (None, "gave None, no list"),
        (["wall"], "gave a str where an Instance is wanted"),
        ([replace(GOOD, label="door")], "gave the label 'door'"),  # type: ignore[arg-type]
        ([replace(GOOD, score=float("nan"))], "gave the score nan"),
        ([replace(GOOD, mask=MASK[:60])], r"a mask as bool \(60, 160\); bool \(120, 160\) is wanted"),
        ([replace(GOOD, mask=MASK.astype(np.uint8))], "a mask as uint8"),
        ([replace(GOOD, label=np.array(["wall", "column"]))], r"gave the label array\(.*'wall' or 'column' is wanted"),  # type: ignore[arg-type]
        ([replace(GOOD, score="0.9")], "gave the score '0.9'; a number from 0 to 1 is wanted"),  # type: ignore[arg-type]
        ([GOOD] * 501, "gave more than 500 instances"),
        (repeat(GOOD), "gave more than 500 instances"),
    ],
)
def test_a_segmenter_that_breaks_its_promise_is_named_with_its_package(answer: Any, says: str) -> None:
    with pytest.raises(PluginError, match=f"the plugin 'says' of pack 1.0 {says}|{says}"):
        segmented(answer)


def test_a_plugins_message_of_many_lines_is_told_in_one() -> None:
    missing = "\n".join(f"  size mismatch for backbone.{k}.weight" for k in range(1000))
    with pytest.raises(PluginError) as caught:
        segmented(RuntimeError(f"Error(s) in loading state_dict:\n{missing}"))
    told = str(caught.value)
    assert "\n" not in told and len(told) < 500
    assert "loading state_dict: size mismatch for backbone.0.weight" in told and "report it to its makers" in told


def test_a_score_of_numpys_own_kinds_is_a_number() -> None:
    scores = [one.score for one in segmented([replace(GOOD, score=kind(1)) for kind in (np.float32, np.int64)])]  # type: ignore[arg-type]
    assert scores == [1.0, 1.0]
    assert {type(score) for score in scores} == {float}


class Draws:
    """A plugin that works in its arguments' place."""

    name = "draws"

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Black out both photos and the depth."""
        assert depth is not None
        for array in (pair.left, pair.right, pair.valid_left, pair.valid_right):
            array[:] = 0
        for array in (depth.disparity_px, depth.sigma_px, depth.valid):
            array[:] = 0
        return []

    def estimate(self, image: ByteImage) -> Float32Array:
        """Black out the photo."""
        image[:] = 0
        return image[..., 0].astype(np.float32)


def test_what_a_plugin_draws_into_its_photos_and_depth_no_measurement_sees() -> None:
    seen, shape = pair(), pair().left.shape[:2]
    depth = DepthMap(
        disparity_px=np.ones(shape, np.float32), sigma_px=np.ones(shape, np.float32), valid=np.ones(shape, bool),
        f_px=1000.0, baseline_m=0.25, method="stereo",
    )  # fmt: skip
    arrays = (seen.left, seen.right, seen.valid_left, seen.valid_right, depth.disparity_px, depth.sigma_px, depth.valid)
    before = [array.copy() for array in arrays]
    CheckedSegmenter(name="draws", who="the plugin", inner=Draws()).segment(seen, depth)
    CheckedDepth(name="draws", who="the plugin", inner=Draws()).estimate(seen.left)
    assert all(np.array_equal(array, was) for array, was in zip(arrays, before, strict=True))


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (np.zeros((120, 160)), "relative depth as float64"),
        (np.zeros((60, 160), np.float32), r"float32 \(60, 160\)"),
        (np.full((120, 160), np.nan, np.float32), "isn't finite"),
        (ValueError("x"), "failed"),
    ],
)
def test_a_depth_network_that_breaks_its_promise_is_named(answer: Any, says: str) -> None:
    with pytest.raises(PluginError, match=says):
        CheckedDepth(name="says", who="the plugin 'says'", inner=Says(answer)).estimate(pair().left)


@pytest.mark.usefixtures("example_package")
def test_a_project_runs_the_example_packages_segmenter_and_depth() -> None:
    choice = NetworkChoice(segment="plugin:example-halves", depth="plugin:example-rows")
    chosen = load_models(choice)
    assert chosen.opinion is not None
    assert chosen.relative_depth is not None
    (wall,) = chosen.opinion.segment(pair(), None)
    assert wall.mask[:, :80].all()
    assert not wall.mask[:, 80:].any()
    (given,) = chosen.opinion.inner.segment(pair(), None)  # type: ignore[attr-defined]
    assert isinstance(given.source, InstanceSource)  # as the interface says: others copy the example
    depth = chosen.relative_depth.estimate(pair().left)
    assert (depth[-1] > depth[0]).all()
    assert identities(choice)["plugin:example-halves"] == "asbuilt-bim-example 1.2.0: example-halves"
    networks._opened.cache_clear()
