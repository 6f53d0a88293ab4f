"""What counts as an opening of a face: what lies behind it, and what one photo alone sees beside a jamb."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.measure.outline.straight import _openings

ALL = np.ones((200, 300), dtype=bool)
NO_VOTES = np.zeros((200, 300), np.float32)
WINDOW = np.zeros((200, 300), dtype=bool)
WINDOW[60:130, 100:200] = True


def wall(unmeasured: float, seed: int = 0) -> np.ndarray:
    """Return how far a wall's depth lies off its plane, px: on it, but for a share that isn't measured."""
    rng = np.random.default_rng(seed)
    off = rng.normal(0.0, 0.2, (200, 300)).astype(np.float32)
    off[rng.random((200, 300)) < unmeasured] = np.nan
    return off


def test_a_window_reaches_its_far_jamb_past_what_one_photo_alone_sees() -> None:
    off = wall(0.005)
    off[WINDOW] = -12.0
    off[60:130, 178:200] = np.nan  # seen past the near jamb by the left camera alone
    off[92:96, 100:200] = np.nan  # between two things behind
    off[100:130, 140:160] = np.nan
    off[110:128, 150:156] = -4.0
    found = _openings(ALL, off, NO_VOTES, NO_VOTES)
    assert np.count_nonzero(found ^ WINDOW) < 0.02 * np.count_nonzero(WINDOW)


def test_a_plain_wall_without_depth_has_no_opening() -> None:
    off = wall(0.6)
    off[20:180, 30:120] = np.nan
    assert not _openings(ALL, off, NO_VOTES, NO_VOTES).any()


def test_beside_a_window_of_a_plain_wall_what_has_no_depth_is_wall() -> None:
    off = wall(0.6)
    off[WINDOW] = -12.0
    off[60:130, 202:280] = np.nan
    found = _openings(ALL, off, NO_VOTES, NO_VOTES)
    assert np.count_nonzero(found ^ WINDOW) < 0.02 * np.count_nonzero(WINDOW)


def test_a_stain_without_depth_on_a_wall_with_texture_is_no_opening() -> None:
    off = wall(0.005)
    off[40:140, 60:160] = np.nan
    off[80:92, 100:110] = -3.0  # a mismatch in it
    assert not _openings(ALL, off, NO_VOTES, NO_VOTES).any()
