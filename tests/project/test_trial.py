"""A network that never answers is ended and named, wherever it would have run."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.project import trial
from asbuilt_bim.project.networks import NetworkChoice, identities
from asbuilt_bim.project.trial import try_network
from asbuilt_bim.scale.apart import Limits
from asbuilt_bim.vision.networks import session
from asbuilt_bim.vision.networks.card import read_card
from asbuilt_bim.vision.networks.session import open_network
from tests.vision.networks import graphs


@pytest.mark.skipif(sys.platform == "win32", reason="there the clock on the wall ends it, eight times later")
def test_a_network_that_loops_for_ever_stops_the_run_before_a_station_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "_LIMITS", Limits(seconds=2.0, memory_bytes=3e9))
    path = graphs.card(tmp_path, graphs.endless(), "semantic")
    with pytest.raises(
        NetworkError, match=r"tiny\.onnx: took more than (2 s of processor time|16 s) for one picture; export"
    ):
        identities(NetworkChoice(segment=str(path)))


def test_a_network_that_comes_to_an_end_passes_its_trial_whatever_it_answers(tmp_path: Path) -> None:
    try_network(graphs.card(tmp_path, graphs.endless(times=3), "semantic"))


def test_a_loop_that_a_picture_sets_going_is_ended_by_the_clock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "LATE_S", 1.0)
    path = graphs.card(tmp_path, graphs.endless(), "semantic")
    network = open_network(read_card(path), tmp_path / "tiny.onnx")
    with pytest.raises(NetworkError, match="took more than 1 s for one picture; export it without loops"):
        network.run((np.zeros((1, 3, 48, 64), dtype=np.float32),))
