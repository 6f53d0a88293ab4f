"""Work in a process of its own may crash, run on or eat memory: the caller hears of it and goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from asbuilt_bim.errors import DesignError, OptionError
from asbuilt_bim.scale import apart
from asbuilt_bim.scale.apart import LIMITS_VARIABLE, Ended, Limits, memory_of, run_apart

ROOMY = Limits(seconds=60.0, memory_bytes=4e9)
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals and memory are told otherwise there")


def twice(number: int) -> tuple[int, int]:
    print("a library's chatter")  # noqa: T201
    return os.getpid(), 2 * number


def turned(data: bytes) -> bytes:
    time.sleep(0.5)
    return data[::-1]


def refuse(name: str) -> None:
    raise DesignError(f"{name}: no design")


def crash(number: int) -> None:
    os.kill(os.getpid(), number)


def run_on() -> None:
    while True:
        pass


def sleep_on() -> None:
    time.sleep(600.0)


def eat_memory() -> None:
    held = []
    while True:
        held.append(bytearray(20_000_000))


def tell_and_sleep(path: str) -> None:
    Path(path).write_text(str(os.getpid()))
    time.sleep(60.0)


def test_work_apart_is_done_in_another_process_and_its_prints_are_no_answer() -> None:
    process, number = run_apart(twice, 21, limits=ROOMY)  # type: ignore[misc]
    assert number == 42
    assert process != os.getpid()


def test_work_and_answers_larger_than_any_pipe_come_through_whole() -> None:
    data = bytes(range(256)) * 20_000
    assert run_apart(turned, data, limits=ROOMY) == data[::-1]


def test_what_work_apart_raises_is_raised_here_as_it_was() -> None:
    with pytest.raises(DesignError, match=r"^a\.ifc: no design$"):
        run_apart(refuse, "a.ifc", limits=ROOMY)


@POSIX
def test_a_crash_apart_is_told_and_harms_nobody() -> None:
    ended = run_apart(crash, int(signal.SIGSEGV), limits=ROOMY)
    assert isinstance(ended, Ended)
    assert (ended.why, ended.detail) == ("died", "SIGSEGV")


@POSIX
def test_work_that_runs_on_is_ended_by_the_processors_clock() -> None:
    ended = run_apart(run_on, limits=Limits(seconds=1.0, memory_bytes=4e9))
    assert ended == Ended(why="time", detail="more than 1 s of processor time")


def test_work_that_waits_for_ever_is_ended_by_the_clock_on_the_wall(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "PATIENCE", 1.0)
    ended = run_apart(sleep_on, limits=Limits(seconds=2.0, memory_bytes=4e9))
    assert ended == Ended(why="time", detail="more than 2 s")


@POSIX
def test_work_that_eats_memory_is_ended_within_its_limit() -> None:
    ended = run_apart(eat_memory, limits=Limits(seconds=60.0, memory_bytes=5e8))
    assert ended == Ended(why="memory", detail="more than 0.5 GB of memory")


@POSIX
def test_the_memory_of_a_process_is_known() -> None:
    assert 1e6 < memory_of(os.getpid()) < 1e11


def test_limits_are_raised_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMITS_VARIABLE, "4")
    assert Limits(seconds=2.0, memory_bytes=3.0).raised() == Limits(seconds=8.0, memory_bytes=12.0)


@pytest.mark.parametrize("said", ["0", "many", "nan", "inf", "-1"])
def test_a_factor_that_is_none_is_named(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMITS_VARIABLE, said)
    with pytest.raises(OptionError, match=f"{LIMITS_VARIABLE}: '{said}' is no factor"):
        ROOMY.raised()


@pytest.mark.skipif(sys.platform != "linux", reason="only there the system ends a child with its parent at once")
def test_work_apart_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    note = tmp_path / "pid"
    script = (
        "from tests.scale.test_apart import ROOMY, tell_and_sleep; from asbuilt_bim.scale.apart import run_apart; "
        f"run_apart(tell_and_sleep, {str(note)!r}, limits=ROOMY)"
    )
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen([sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": paths}) as parent:
        late = time.monotonic() + 30.0
        while not (note.exists() and note.read_text()) and time.monotonic() < late:
            time.sleep(0.05)
        child = int(note.read_text())
        parent.kill()
    while Path(f"/proc/{child}").exists() and time.monotonic() < late:
        time.sleep(0.05)
    assert not Path(f"/proc/{child}").exists()


def test_a_script_without_a_guard_can_work_apart(tmp_path: Path) -> None:
    script = tmp_path / "plain.py"
    script.write_text(
        "from asbuilt_bim.scale.apart import Limits, run_apart\n"
        "from math import sqrt\n"
        "print(run_apart(sqrt, 9.0, limits=Limits(seconds=60.0, memory_bytes=4e9)))\n"
    )
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    told = subprocess.run(
        [sys.executable, str(script)], env={**os.environ, "PYTHONPATH": paths}, capture_output=True, check=True
    )
    assert told.stdout.split() == [b"3.0"]
