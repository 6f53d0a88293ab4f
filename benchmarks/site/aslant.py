"""A new kind of evidence in one file, as an example: how obliquely a station looks at a sample.

python benchmarks/site/fit_evidence.py --seeds 20 31 --with benchmarks/site/aslant.py

It says what the feature buys: on 16 sites next to nothing, so the package goes without it. One that is worth having is
entered in asbuilt_bim/progress/states/features.py in the same words, and fitted with --write.
"""

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import unit
from asbuilt_bim.progress.states.features import FEATURES, Shown


def aslant(one: Shown) -> FloatArray:
    """Return 0 for each sample (N,) that a station looks straight at, nearly 1 where it looks along the surface."""
    towards = unit(one.eye_m - one.samples.points_m)
    straight: FloatArray = np.clip(np.sum(towards * one.samples.normals, axis=1), 0.0, 1.0)
    return 1.0 - straight


FEATURES["aslant"] = aslant
