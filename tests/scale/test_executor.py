from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import cast

import cv2
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from asbuilt_bim.errors import MissingExtraError
from asbuilt_bim.scale.cluster import Scheduler
from asbuilt_bim.scale.executor import WorkerLoss, one_thread, run_jobs


def square(number: int) -> int:
    return number * number


@one_thread()
def threads(number: int) -> set[int]:
    return {cv2.getNumThreads(), *(int(library["num_threads"]) for library in threadpool_info())}


def blas() -> set[int]:
    return {int(library["num_threads"]) for library in threadpool_info() if library["user_api"] == "blas"}


def variable(name: str) -> str | None:
    return os.environ.get(name)


def die_on_three(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
    return number


def say_and_sleep(number: int) -> None:
    sys.stdout.write(f"{os.getpid()}\n")
    sys.stdout.flush()
    time.sleep(60.0)


def hang_on_three(number: int) -> int:
    while number == 3:  # it holds the interpreter's lock
        pass
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


@pytest.mark.parametrize("workers", [1, 2])
def test_work_is_held_to_one_thread_whatever_the_machine_says(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    before = cv2.getNumThreads()
    assert [d.result for d in run_jobs(threads, iter([1, 2]), workers=workers)] == [{1}, {1}]
    assert os.environ["OMP_NUM_THREADS"] == "4"
    assert cv2.getNumThreads() == before


def test_pools_that_overlap_leave_the_variables_as_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    first, second = (cast("Generator[object, None, None]", run_jobs(square, iter(range(9)), workers=2)) for _ in "ab")
    next(first)
    next(second)
    first.close()
    assert os.environ["OMP_NUM_THREADS"] == "1", "the second one still starts processes"
    second.close()
    assert os.environ["OMP_NUM_THREADS"] == "4" and "MKL_NUM_THREADS" not in os.environ


def test_threads_that_overlap_leave_the_libraries_as_they_were() -> None:
    before = cv2.getNumThreads()
    cv2.setNumThreads(3)
    try:
        with threadpool_limits(limits=2, user_api="blas"):
            limited = blas()
            first, second = ExitStack(), ExitStack()
            first.enter_context(one_thread())
            second.enter_context(one_thread())
            first.close()
            assert blas() <= {1} and cv2.getNumThreads() == 1, "the second one still works"
            second.close()
            assert blas() == limited and cv2.getNumThreads() == 3
    finally:
        cv2.setNumThreads(before)


def test_a_process_of_the_pool_starts_with_one_thread_for_each_library() -> None:
    names = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"]
    assert [done.result for done in run_jobs(variable, iter(names), workers=2)] == ["1"] * 4


def test_a_worker_that_dies_costs_its_own_job_only() -> None:
    results = {done.job: done.result for done in run_jobs(die_on_three, iter(range(6)), workers=2)}
    assert results.pop(3) == WorkerLoss()
    assert results == {n: n for n in (0, 1, 2, 4, 5)}


def test_a_job_that_never_ends_costs_its_own_result_only() -> None:
    done = run_jobs(hang_on_three, iter(range(5)), workers=2, limit_s=1.5)
    results = {one.job: one.result for one in done}
    assert results.pop(3) == WorkerLoss(limit_s=1.5)
    assert results == {n: n for n in (0, 1, 2, 4)}


@pytest.mark.parametrize("workers", [1, 2])
def test_what_the_work_raises_is_raised_here(workers: int) -> None:
    with pytest.raises(ValueError, match="bad 1"):
        list(run_jobs(fail, iter([1]), workers=workers))


def test_a_scheduler_without_dask_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install distributed"):
        list(run_jobs(square, iter([1]), scheduler=Scheduler(address="tcp://localhost:1")))


@pytest.mark.skipif(sys.platform == "win32", reason="signals are not sent so there")
@pytest.mark.parametrize("sent", ["SIGTERM", "SIGKILL"])
def test_workers_end_with_a_main_process_that_is_killed(sent: str, tmp_path: Path) -> None:
    script = tmp_path / "main.py"
    script.write_text(
        "from asbuilt_bim.scale.executor import run_jobs\n"
        "from tests.scale.test_executor import say_and_sleep\n"
        'if __name__ == "__main__":\n'
        "    list(run_jobs(say_and_sleep, [1, 2], workers=2))\n"
    )
    paths = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])}
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, env={**os.environ, **paths}) as main:
        assert main.stdout is not None
        workers = [int(main.stdout.readline()) for _ in range(2)]
        main.send_signal(getattr(signal, sent))
        assert main.wait() == -getattr(signal, sent)
        late = time.monotonic() + 10.0
        while time.monotonic() < late and any(map(_lives, workers)):
            time.sleep(0.05)
        left = [worker for worker in workers if _lives(worker)]
        for worker in left:
            os.kill(worker, signal.SIGKILL)
    assert not left


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/status")
    return not (status.exists() and "State:\tZ" in status.read_text())


STRANGER = "from pathlib import Path\nPath(__file__).with_name('ran').write_text('')\nraise SystemExit\n"


def test_modules_in_the_folder_that_one_stands_in_are_no_part_of_a_worker(tmp_path: Path) -> None:
    stranger = tmp_path / "site" / "multiprocessing" / "__init__.py"
    stranger.parent.mkdir(parents=True)
    stranger.write_text(STRANGER)
    (tmp_path / "program.py").write_text(
        "from asbuilt_bim.scale.executor import _pool\n"
        "if __name__ == '__main__':\n"
        "    with _pool(1) as pool:\n"
        "        print(pool.submit(abs, -7).result())\n"
    )
    run = [sys.executable, str(tmp_path / "program.py")]
    done = subprocess.run(run, cwd=tmp_path / "site", capture_output=True, text=True, timeout=120, check=False)
    assert (done.stdout.strip(), [*(tmp_path / "site").rglob("ran")]) == ("7", []), done.stderr


def test_modules_in_the_folder_that_one_stands_in_are_no_part_of_the_program(tmp_path: Path) -> None:
    (tmp_path / "click.py").write_text(STRANGER)
    run = [sys.executable, "-m", "asbuilt_bim", "--version"]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert "asbuilt-bim" in done.stdout and not (tmp_path / "ran").exists(), done.stderr
