from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator

import pytest

from asbuilt_bim.errors import MissingExtraError
from asbuilt_bim.scale.executor import WorkerLoss, run_jobs


def square(number: int) -> int:
    return number * number


def threads(number: int) -> tuple[str, int]:
    import cv2

    return os.environ["OMP_NUM_THREADS"], cv2.getNumThreads()


def die_on_three(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
    return number


def fail(number: int) -> int:
    raise ValueError(f"bad {number}")


def test_one_worker_works_in_this_process_in_order() -> None:
    done = [(d.job, d.result) for d in run_jobs(lambda n: n + os.getpid(), iter([1, 2, 3]), workers=1)]
    assert done == [(n, n + os.getpid()) for n in (1, 2, 3)]


def test_a_pool_does_every_job_once_and_draws_them_only_as_it_goes() -> None:
    drawn: list[int] = []

    def jobs() -> Iterator[int]:
        for number in range(8):
            drawn.append(number)
            yield number

    results = {}
    ahead = []
    for done in run_jobs(square, jobs(), workers=2):
        results[done.job] = done.result
        ahead.append(len(drawn) - len(results))
    assert results == {n: n * n for n in range(8)}
    assert max(ahead) <= 2


def test_workers_hold_their_libraries_to_one_thread_and_this_process_keeps_its_own() -> None:
    before = os.environ.get("OMP_NUM_THREADS")
    assert {d.result for d in run_jobs(threads, iter([1, 2]), workers=2)} == {("1", 1)}
    assert os.environ.get("OMP_NUM_THREADS") == before


def test_a_worker_that_dies_costs_its_own_job_only() -> None:
    results = {done.job: done.result for done in run_jobs(die_on_three, iter(range(6)), workers=2)}
    assert isinstance(results.pop(3), WorkerLoss)
    assert results == {n: n for n in (0, 1, 2, 4, 5)}


@pytest.mark.parametrize("workers", [1, 2])
def test_what_the_work_raises_is_raised_here(workers: int) -> None:
    with pytest.raises(ValueError, match="bad 1"):
        list(run_jobs(fail, iter([1]), workers=workers))


def test_a_scheduler_without_dask_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install .*asbuilt-bim\[dask\]"):
        list(run_jobs(square, iter([1]), scheduler="tcp://localhost:1"))
