"""Patterns: what recorded pictures were drawn with stays as it was."""

import numpy as np
import pytest

from asbuilt_synthetic.materials import MATERIALS
from asbuilt_synthetic.textures import bake, tile


def test_the_pattern_of_a_known_material_is_the_one_that_recorded_pictures_show() -> None:
    rust = tile("rebar")
    assert rust.levels[0].shape == (1024, 1024, 3)
    assert rust.levels[3][5, 7] == pytest.approx([0.119223, 0.060844, 0.039679], abs=2e-5)
    assert rust.levels[-1].mean((0, 1)) == pytest.approx([0.103735, 0.054459, 0.036708], abs=2e-6)


def test_a_pattern_is_baked_from_its_generator_alone() -> None:
    one, again, other = (bake(MATERIALS["brick"], np.random.default_rng(k), 64, 0.5) for k in (3, 3, 4))
    assert np.array_equal(one.levels[0], again.levels[0])
    assert not np.array_equal(one.levels[0], other.levels[0])
    assert [level.shape[0] for level in one.levels] == [64, 32, 16, 8]
