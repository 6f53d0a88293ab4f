"""How each array field of the result is written as JSON: its shape, its decimals, and the check on the way back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, frozen

METRE_DECIMALS = 6  # a thousandth of a millimetre: far below any sigma, and world coordinates stay short
PIXEL_DECIMALS = 2  # a hundredth of a pixel: a tenth of what the best sub-pixel edge claims


@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayForm:
    """The JSON form of one array field: `nesting` tuples around arrays of `shape` (None: any length)."""

    nesting: Literal[0, 1, 2]
    shape: tuple[int | None, ...]
    decimals: int | None  # None: written in full, for rotations and covariances


ARRAY_FORMS: dict[str, ArrayForm] = {
    "outline_px": ArrayForm(nesting=1, shape=(None, 2), decimals=PIXEL_DECIMALS),
    "before_px": ArrayForm(nesting=1, shape=(None, 2), decimals=PIXEL_DECIMALS),
    "outline_world_m": ArrayForm(nesting=1, shape=(None, 3), decimals=METRE_DECIMALS),
    "exposed_uv_m": ArrayForm(nesting=2, shape=(None, 2), decimals=METRE_DECIMALS),
    "built_uv_m": ArrayForm(nesting=2, shape=(None, 2), decimals=METRE_DECIMALS),
    "open_uv_m": ArrayForm(nesting=2, shape=(None, 2), decimals=METRE_DECIMALS),
    "row_log_odds": ArrayForm(nesting=0, shape=(None, None), decimals=0),
    "level_evidence": ArrayForm(nesting=0, shape=(None, None), decimals=1),
    "unknown_uv_m": ArrayForm(nesting=2, shape=(None, 2), decimals=METRE_DECIMALS),
    "outline_uv_m": ArrayForm(nesting=2, shape=(None, 2), decimals=METRE_DECIMALS),
    "target_left_px": ArrayForm(nesting=0, shape=(2,), decimals=PIXEL_DECIMALS),
    "target_right_px": ArrayForm(nesting=0, shape=(2,), decimals=PIXEL_DECIMALS),
    "frame_m": ArrayForm(nesting=0, shape=(3, 3), decimals=None),
    "rectified_from_left": ArrayForm(nesting=0, shape=(3, 3), decimals=None),
    "world_from_left": ArrayForm(nesting=0, shape=(4, 4), decimals=None),
    "pose_covariance": ArrayForm(nesting=0, shape=(6, 6), decimals=None),
    "world_from_marker": ArrayForm(nesting=0, shape=(4, 4), decimals=None),
    "marker_covariance": ArrayForm(nesting=0, shape=(7, 7), decimals=None),
}
"""By field name; a new array field of the result must be entered here, which a test sees to."""


def writer_of(form: ArrayForm) -> Callable[[Any], Any]:
    """Return the function that turns a field's arrays into nested lists of numbers; None stays None."""

    def write(value: Any, depth: int = form.nesting) -> Any:
        if value is None:
            return None
        if depth:
            return [write(part, depth - 1) for part in value]
        array = np.asarray(value, dtype=np.float64)
        rounded = array if form.decimals is None else np.round(array, form.decimals)
        whole = form.decimals == 0
        return (rounded.astype(int) if whole else rounded + 0.0).tolist()  # + 0.0 turns -0.0 into 0.0

    return write


def reader_of(form: ArrayForm) -> Callable[[Any, Any], Any]:
    """Return the function that makes read-only arrays of nested lists; None stays None.

    Raises (the returned function):
        ValueError: the lists are ragged, hold other things than finite numbers, or have another shape.
    """

    def read(value: Any, target: Any, depth: int = form.nesting) -> Any:
        if value is None:
            return None
        if depth:
            if not isinstance(value, list | tuple):
                raise ValueError(f"a list is expected, not {type(value).__name__}")
            return tuple(read(part, target, depth - 1) for part in value)
        return _array(value, form.shape)

    return read


def _array(value: Any, shape: tuple[int | None, ...]) -> FloatArray:
    """Make one array of nested lists and hold it to its shape."""
    array = np.asarray(value)
    if array.size == 0 and None in shape:
        return frozen(np.zeros([0 if n is None else n for n in shape]))
    if array.dtype.kind not in "if":
        raise ValueError("numbers are expected")
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=True)):
        wanted = " x ".join("N" if n is None else str(n) for n in shape)
        raise ValueError(f"{wanted} numbers are expected, not {' x '.join(map(str, array.shape)) or 'one'}")
    if not np.isfinite(array).all():
        raise ValueError("a number is not finite")
    return frozen(array)
