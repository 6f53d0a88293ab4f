"""Segmenters and depth networks of other packages, checked against their interface: an error names the package."""

from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.errors import PluginError
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, freeze
from asbuilt_bim.storage.plugins import in_one_line
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource, Segmenter
from asbuilt_bim.vision.stereo.depth import DepthMap, RelativeDepth

MAX_INSTANCES = 500
"""More walls and columns than any photo shows: a plugin that gives them has mistaken something."""
_Answer = TypeVar("_Answer")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedSegmenter:
    """A plugin's segmenter; `who` names it and its package in messages."""

    name: str
    who: str
    inner: Segmenter

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Return the plugin's instances, with the boxes of their masks; those without a pixel are left out.

        Raises:
            PluginError: it failed, or its answer isn't as the interface says.
        """
        given = deepcopy(pair), deepcopy(depth)  # its own: it may draw into them, and nothing else sees it
        found = _asked(self.who, lambda: _listed(self.inner.segment(*given)))
        if len(found) > MAX_INSTANCES:
            raise PluginError(f"{self.who} gave more than {MAX_INSTANCES} instances")
        made = [self._checked(one, pair.left.shape[:2]) for one in found]
        return [one for one in made if one is not None]

    def _checked(self, one: object, shape: tuple[int, int]) -> Instance | None:
        if not isinstance(one, Instance):
            raise PluginError(f"{self.who} gave a {type(one).__name__} where an Instance is wanted")
        if not isinstance(one.label, str) or one.label not in get_args(InstanceClass):
            raise PluginError(f"{self.who} gave the label {one.label!r:.60}; 'wall' or 'column' is wanted")
        score = one.score
        if not isinstance(score, int | float | np.integer | np.floating) or not 0.0 <= score <= 1.0:  # NaN is neither
            raise PluginError(f"{self.who} gave the score {score!r:.60}; a number from 0 to 1 is wanted")
        mask = _array(self.who, "a mask", one.mask, shape, np.bool_)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if rows.size == 0:
            return None
        box = (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
        checked: BoolArray = freeze(mask.copy())
        return Instance(
            label=one.label, score=float(score), mask=checked, box_px=box, source=InstanceSource.NETWORK,
            segmenter=self.name,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedDepth:
    """A plugin's relative depth; `who` names it and its package in messages."""

    name: str
    who: str
    inner: RelativeDepth

    def estimate(self, image: ByteImage) -> Float32Array:
        """Return the plugin's relative depth.

        Raises:
            PluginError: it failed, or its answer isn't as the interface says.
        """
        found = _asked(self.who, lambda: self.inner.estimate(image.copy()))
        depth = _array(self.who, "relative depth", found, image.shape[:2], np.float32)
        if not np.isfinite(depth).all():
            raise PluginError(f"{self.who} gave relative depth that isn't finite everywhere")
        checked: Float32Array = freeze(depth.copy())
        return checked


def _listed(answer: Iterable[Instance]) -> list[Instance]:
    """Return an answer's instances up to one too many: a generator may have no end."""
    if not isinstance(answer, Iterable):
        raise TypeError(f"segment() gave {answer!r:.60}, no list")
    return list(islice(answer, MAX_INSTANCES + 1))


def _asked(who: str, ask: Callable[[], _Answer]) -> _Answer:
    try:
        return ask()
    except (Exception, SystemExit) as problem:  # others' code: whatever it throws is named as theirs
        raise PluginError(f"{who} failed ({in_one_line(problem)}); report it to its makers") from problem


def _array(who: str, what: str, found: object, shape: tuple[int, int], kind: type[np.generic]) -> NDArray[Any]:
    if not isinstance(found, np.ndarray) or found.shape != shape or found.dtype != kind:
        is_ = f"{found.dtype} {found.shape}" if isinstance(found, np.ndarray) else type(found).__name__
        raise PluginError(f"{who} gave {what} as {is_}; {np.dtype(kind)} {shape} is wanted, as the photo is")
    return found
