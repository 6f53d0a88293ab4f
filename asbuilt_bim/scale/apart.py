"""Work on other people's files in a process of its own: it may crash, run on or eat memory, and is then ended.

A library in C++ that a file leads astray takes its whole process along. Here that is a child that nobody misses.
"""

import contextlib
import ctypes
import math
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

from asbuilt_bim.errors import AsBuiltError, OptionError
from asbuilt_bim.scale.executor import THREADS, one_thread

Result = TypeVar("Result")

LIMITS_VARIABLE = "ASBUILT_BIM_LIMITS"
"""A factor on every limit, for what is large and honest."""
PATIENCE = 8.0
"""Other work may hold a child up by so much on the clock before it counts as stuck."""
_LOOK_S = 0.1
_KEPT_WORDS = 300
_CHILD = "from asbuilt_bim.scale.apart import answer_parent; answer_parent()"
_PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a child may take: seconds of processor time (on the clock `PATIENCE` times as many), bytes of memory."""

    seconds: float
    memory_bytes: float

    def raised(self) -> "Limits":
        """Return the limits times the factor that the environment gives.

        Raises:
            OptionError: the variable holds no number of 1 or more.
        """
        said = os.environ.get(LIMITS_VARIABLE, "").strip() or "1"
        try:
            factor = float(said)
        except ValueError:
            factor = 0.0
        if not 1.0 <= factor <= 1e6:
            raise OptionError(f"{LIMITS_VARIABLE}: {said!r} is no factor; give a number of 1 or more, such as 4")
        return Limits(seconds=self.seconds * factor, memory_bytes=self.memory_bytes * factor)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """Stands for the result of work whose process ended before it had answered."""

    why: Literal["died", "time", "memory"]
    detail: str


def run_apart(
    work: Callable[..., Result], *arguments: Any, limits: Limits, meanwhile: Callable[[], None] | None = None
) -> Result | Ended:
    """Return what `work(*arguments)` returns in a process of its own, or how that ended. What it raises is raised here.

    `work` must be importable by name; arguments and result must pickle. The caller's main module isn't imported again,
    so scripts need no guard. Where the interpreter can't be started anew, the work is done in this process. `meanwhile`
    is called again and again until the answer is there.
    """
    if not sys.executable:
        return work(*arguments)
    folders = [str(Path(folder or ".").absolute()) for folder in sys.path]
    with tempfile.TemporaryFile() as job:  # a pipe that is full would hold up the watch
        pickle.dump((limits.seconds, work, arguments), job)
        job.seek(0)
        with subprocess.Popen(
            [sys.executable, "-P", "-c", _CHILD],  # -P: the folder that it is started in holds no modules of ours
            stdin=job,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": os.pathsep.join(folders)},
        ) as child:
            try:
                ended = _watched(child, limits, meanwhile)
            finally:
                child.kill()
    if isinstance(ended, Ended):
        return ended
    done, answer = pickle.loads(ended)
    if not done:
        raise answer
    return cast(Result, answer)


def _watched(child: subprocess.Popen[bytes], limits: Limits, meanwhile: Callable[[], None] | None) -> bytes | Ended:
    """Wait for the child's answer, looking at its memory and at the clock."""
    late = time.monotonic() + PATIENCE * limits.seconds
    while True:
        try:
            answer, said = child.communicate(timeout=_LOOK_S)
            break
        except subprocess.TimeoutExpired:
            if meanwhile is not None:
                meanwhile()
        if time.monotonic() > late:
            return Ended(why="time", detail=f"more than {PATIENCE * limits.seconds:.0f} s")
        if memory_of(child.pid) > limits.memory_bytes:
            return Ended(why="memory", detail=f"more than {limits.memory_bytes / 1e9:.1f} GB of memory")
    if child.returncode == 0 and answer:
        return answer
    code = child.returncode
    if hasattr(signal, "SIGXCPU") and code == -signal.SIGXCPU:
        return Ended(why="time", detail=f"more than {limits.seconds:.0f} s of processor time")
    if sys.platform != "win32" and code == -signal.SIGKILL:  # nobody here sent it: the system, for want of memory
        return Ended(why="memory", detail="more memory than there is")
    words = " ".join(said.decode("utf-8", "replace").split())[-_KEPT_WORDS:]
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"exit code {code}"
    return Ended(why="died", detail=f"{name}: {words}" if words else name)


def memory_of(process: int) -> float:
    """Return the bytes of memory that a process holds; 0 where the system doesn't tell, and only time is limited."""
    try:
        if sys.platform == "linux":
            pages = Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1]
            return float(pages) * os.sysconf("SC_PAGE_SIZE")
        if sys.platform == "win32":
            return 0.0
        told = subprocess.run(["ps", "-o", "rss=", "-p", str(process)], capture_output=True, check=False)
        return float(told.stdout or 0.0) * 1024.0
    except (OSError, IndexError, ValueError):
        return 0.0


def answer_parent() -> None:
    """Do the one job that comes on standard input, and answer on standard output. The child's whole life."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    seconds, work, arguments = pickle.load(sys.stdin.buffer)
    _end_alone(seconds)
    answer: tuple[bool, object]
    try:
        with one_thread():
            answer = (True, work(*arguments))
    except BaseException as problem:
        answer = (False, _portable(problem))
    with answers:
        pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)


def _portable(problem: BaseException) -> BaseException:
    """Return an exception as it can cross to the parent, with where it arose if the fault is the program's own."""
    if not isinstance(problem, AsBuiltError):
        problem.add_note("In a process apart:\n" + "".join(traceback.format_exception(problem)))
    try:
        pickle.loads(pickle.dumps(problem))
    except Exception:  # an exception of a library's own making may not survive
        return RuntimeError(f"{type(problem).__name__}: {problem}")
    return problem


def _end_alone(seconds: float) -> None:
    """See that the system ends this process where the parent no longer can: with it, or by the processor's clock."""
    with contextlib.suppress(OSError, AttributeError):
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if sys.platform != "win32":
        import resource

        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), resource.RLIM_INFINITY))
