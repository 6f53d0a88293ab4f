"""Shared work has the answers of one process, in their order, and starts others only where that pays."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence

import pytest

from asbuilt_bim.scale import share
from asbuilt_bim.scale.share import AmongProcesses, in_turn


def squares(numbers: Sequence[int]) -> list[tuple[int, int]]:
    return [(number * number, os.getpid()) for number in numbers]


def squares_but_in_a_child(numbers: Sequence[int]) -> list[int]:
    if 3 in numbers and os.environ["ASBUILT_TEST_MAIN"] != str(os.getpid()):
        os.kill(os.getpid(), signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
    return [number * number for number in numbers]


@pytest.mark.parametrize("workers", [2, 3])
def test_shared_work_has_the_same_answers_in_the_same_order(workers: int) -> None:
    shared = AmongProcesses(workers=workers, least_items=0)(squares, range(7))
    assert [square for square, _ in shared] == [square for square, _ in in_turn(squares, range(7))]
    assert os.getpid() not in {process for _, process in shared}


def test_neighbours_go_to_different_processes() -> None:
    shared = AmongProcesses(workers=2, least_items=0)(squares, range(6))
    processes = [process for _, process in shared]
    assert processes[::2] == [processes[0]] * 3
    assert processes[1::2] == [processes[1]] * 3


@pytest.mark.parametrize(("workers", "items"), [(1, 1000), (2, 9), (2, 0)])
def test_too_little_work_or_one_worker_starts_no_process(
    workers: int, items: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(share, "run_jobs", lambda *asked, **more: pytest.fail("processes were started"))
    shared = AmongProcesses(workers=workers, least_items=10)(squares, range(items))
    assert shared == squares(range(items))


def test_what_a_process_that_died_had_to_do_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ASBUILT_TEST_MAIN", str(os.getpid()))
    shared = AmongProcesses(workers=2, least_items=0)(squares_but_in_a_child, range(6))
    assert shared == [0, 1, 4, 9, 16, 25]
