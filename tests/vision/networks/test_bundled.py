"""The shipped networks open by name, are small, and answer about a photo of any shape."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.bundled import bundled_card
from asbuilt_bim.vision.networks.card import Task
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkSegmenter, load

MOST_BYTES = 20_000_000


@pytest.mark.parametrize("task", ["segment", "depth"])
def test_each_is_there_with_its_licence_and_under_20_megabytes(task: Task) -> None:
    loaded = load(bundled_card(task), task)
    assert loaded.card.licence == "Apache-2.0"
    assert loaded.network.path.stat().st_size < MOST_BYTES


@pytest.mark.parametrize("shape", [(96, 128), (200, 90)])
def test_they_answer_about_photos_of_other_sizes_and_shapes(shape: tuple[int, int]) -> None:
    photo = np.random.default_rng(2).integers(0, 255, (*shape, 3), dtype=np.uint8)
    segmenter = NetworkSegmenter(loaded=load(bundled_card("segment"), "segment"))
    masks = [one.mask for _, one in segmenter.sightings(photo)]
    assert all(mask.shape == shape for mask in masks)
    assert not masks or np.sum(masks, axis=0).max() == 1, "no pixel is two things'"
    nearness = NetworkDepth(loaded=load(bundled_card("depth"), "depth")).estimate(photo)
    assert nearness.shape == shape
    assert np.isfinite(nearness).all()
    assert np.ptp(nearness) > 0.0


def test_stereo_has_none() -> None:
    with pytest.raises(NetworkError, match="no network for stereo is shipped"):
        bundled_card("stereo")
