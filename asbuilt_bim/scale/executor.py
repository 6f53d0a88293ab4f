"""Many stations on many processors: one pure function, run in this process, in a pool, or through Dask.

A worker that dies (killed for memory, a crash in a decoder) or never ends costs one station, by name, never the run.
"""

import contextlib
import faulthandler
import itertools
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Generic, TypeVar

import cv2
from threadpoolctl import threadpool_limits

from asbuilt_bim.scale.cluster import Cluster, SameCode, Scheduler, cluster
from asbuilt_bim.scale.fingerprint import measuring_identity

Job = TypeVar("Job")
Result = TypeVar("Result")

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")
_SAFE_PATH = "PYTHONSAFEPATH"
"""A worker starts as `python -c`, which else looks for modules in the current folder first: it may be a stranger's."""
_LOOK_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerLoss:
    """Stands for the result of a job whose worker process died, or was ended: it took more than `limit_s`."""

    limit_s: float | None = None  # None where it died of itself


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Done(Generic[Job, Result]):
    """One job and what came of it."""

    job: Job
    result: Result | WorkerLoss


def run_jobs(
    work: Callable[[Job], Result],
    jobs: Iterable[Job],
    *,
    workers: int = 0,
    scheduler: Scheduler | None = None,
    limit_s: float | None = None,
    identity: Callable[[], dict[str, str]] = measuring_identity,
) -> Iterator[Done[Job, Result]]:
    """Yield each job with its result as it is done, in no promised order.

    `workers` 0 is one per processor, 1 is this process without a pool; `scheduler` is a Dask scheduler to use instead.
    Jobs are drawn from the iterable only as workers are free, so that photos aren't all in memory at once. `work`
    must be importable by name. What `work` raises is raised here. A job of a pool here that takes longer than
    `limit_s` is ended; one in this process or on a cluster is not. A cluster's workers must say the same `identity`.

    Raises:
        OptionError: the scheduler's address can't be used.
        MissingExtraError: a scheduler was named and Dask isn't installed.
        OutputError: the scheduler can't be reached or is lost, or has no workers that can do the work.
    """
    if scheduler is not None:
        with cluster(scheduler) as found:
            same = SameCode(work=work, identity=identity(), own=identity)
            yield from _drain(found.executor, same, iter(jobs), 2 * found.size, [], found)
        return
    workers = workers or processors()
    if workers == 1:
        for job in jobs:
            yield Done(job=job, result=work(job))
        return
    timed = work if limit_s is None else Timed(work=work, limit_s=limit_s)
    yield from _pooled(timed, iter(jobs), workers, limit_s)


def _pooled(
    work: Callable[[Job], Result], jobs: Iterator[Job], workers: int, limit_s: float | None
) -> Iterator[Done[Job, Result]]:
    while True:
        suspects: list[Job] = []
        with _pool(workers) as pool:
            yield from _drain(pool, work, jobs, workers, suspects)
        if not suspects:
            return
        for job in suspects:  # one of them killed its worker; alone, each shows whether it was the one
            alone: list[Job] = []
            begun = time.monotonic()
            with _pool(1) as pool:
                yield from _drain(pool, work, iter([job]), 1, alone)
            if alone:
                too_long = limit_s is not None and time.monotonic() - begun >= limit_s
                yield Done(job=job, result=WorkerLoss(limit_s=limit_s if too_long else None))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timed(Generic[Job, Result]):
    """Work whose process ends where one job takes too long: a clock outside the interpreter, which may hang, too."""

    work: Callable[[Job], Result]
    limit_s: float

    def __call__(self, job: Job) -> Result:
        """Do the job, or end this process."""
        with Path(os.devnull).open("w") as nowhere:
            faulthandler.dump_traceback_later(self.limit_s, exit=True, file=nowhere)
            try:
                return self.work(job)
            finally:
                faulthandler.cancel_dump_traceback_later()


def _drain(
    pool: Executor,
    work: Callable[[Job], Result],
    jobs: Iterator[Job],
    window: int,
    suspects: list[Job],
    remote: Cluster | None = None,
) -> Iterator[Done[Job, Result]]:
    """Keep `window` jobs in the pool; when the pool breaks, leave what was in it in `suspects`.

    A cluster doesn't say when nobody works any more: it is looked at while nothing comes.
    """
    flying: dict[Future[Result], Job] = {}
    try:
        while True:
            for job in itertools.islice(jobs, window - len(flying)):
                try:
                    flying[pool.submit(work, job)] = job
                except BrokenProcessPool:
                    suspects.extend([*flying.values(), job])
                    return
            if not flying:
                return
            ready, _ = wait(flying, timeout=None if remote is None else _LOOK_S, return_when=FIRST_COMPLETED)
            for future in sorted(ready, key=Future.cancelled):  # first what came before a cluster went
                if remote is not None and future.cancelled():
                    remote.check(cancelled=True)
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    suspects.extend(flying.values())
                    return
                lost = type(error).__name__ == "KilledWorker"  # Dask's own; it has tried several workers by then
                yield Done(job=flying.pop(future), result=WorkerLoss() if lost else future.result())
            if remote is not None and not ready:
                remote.check()
    finally:
        for future in flying:
            future.cancel()


class _Held:
    """A setting of the whole process that several threads may want at once: the last to leave takes all back."""

    def __init__(self, setting: Callable[[], contextlib.AbstractContextManager[None]]) -> None:
        self._setting = setting
        self._lock = threading.Lock()
        self._users = 0
        self._made = contextlib.ExitStack()

    def __enter__(self) -> None:
        with self._lock:
            self._made.enter_context(self._setting())  # each time: a library may have been loaded since
            self._users += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                self._made.close()


@contextlib.contextmanager
def _variables() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in (*THREADS, _SAFE_PATH)}
    os.environ.update(dict.fromkeys(before, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _libraries() -> Iterator[None]:
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield
    finally:
        cv2.setNumThreads(before)


_VARIABLES, _LIBRARIES = _Held(_variables), _Held(_libraries)


@contextlib.contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool of spawned processes, each on one thread."""
    with _VARIABLES:  # read by the libraries as they load in the child
        pool = ProcessPoolExecutor(max_workers=workers, mp_context=get_context("spawn"), initializer=_start_worker)
        try:
            yield pool
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def processors() -> int:
    """Return how many processors this process may use: in a container, fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def one_thread_each() -> None:
    """Hold the arithmetic libraries that load from now on to one thread, here and in every process started from here.

    The processes are the parallelism; and sums that are split over threads differ in their last digits.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the main process's to answer, in one line
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker once the main process is gone: killed, that tells nobody, and whoever reads its output waits."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Hold the arithmetic to one thread for a while, whatever the machine and its variables say; decorates, too.

    A sum that is split over threads ends in other last digits, robust fits carry them on, and small faces tip. On one
    thread the same photos give the same bytes, in one process or in many.
    """
    with _LIBRARIES, threadpool_limits(limits=1, user_api="openmp"):  # OpenMP counts thread by thread
        yield
