"""A reader in a process of its own, asked case by case: one that hangs is ended, one that died is replaced."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
from typing import Any

from benchmarks.sites import ONE_THREAD, ROOT

LIMIT_S = 60.0
START_S = 600.0


class Child:
    """Asks `child.py` for what comes of the cases of seeds; used as a context."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._answers: queue.Queue[str] = queue.Queue()

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def ask(self, seed: int, limit_s: float = LIMIT_S) -> dict[str, Any]:
        """Return what came of a seed's case: `told` is read, refused, or begins with crash, hang or died."""
        process = self._running()
        assert process.stdin is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # it died: its end is the answer
                process.stdin.write(f"{seed}\n")
                process.stdin.flush()
            answer = self._answers.get(timeout=limit_s)
        except queue.Empty:
            self._end()
            return {"seed": seed, "told": f"hang: no answer in {limit_s:.0f} s"}
        if answer:
            found: dict[str, Any] = json.loads(answer)
            return found
        code = process.wait()
        self._end()
        return {"seed": seed, "told": f"died: exit code {code}"}

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None:
            path = os.pathsep.join([str(ROOT), str(ROOT / "synthetic"), os.environ.get("PYTHONPATH", "")])
            self._process = subprocess.Popen(
                [sys.executable, "-m", "benchmarks.hold.child"], cwd=ROOT, text=True, encoding="utf-8",
                env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            self._answers = queue.Queue()
            self._reader = threading.Thread(target=_pass_on, args=(self._process, self._answers), daemon=True)
            self._reader.start()
            if self._answers.get(timeout=START_S) != "ready\n":
                raise RuntimeError("the reading process doesn't start: python -m benchmarks.hold.child")
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._reader.join()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    with contextlib.suppress(BrokenPipeError):
                        pipe.close()
            self._process = None


def _pass_on(process: subprocess.Popen[str], answers: queue.Queue[str]) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        answers.put(line)
    answers.put("")  # it ended
