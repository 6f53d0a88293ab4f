"""The sample on three real Dask workers on loopback: the same numbers; and what is told when they are lost.

python benchmarks/hold/cluster.py --check            six stations
python benchmarks/hold/cluster.py --check --quick    three

Needs `pip install distributed`. A run on the cluster must give the `result.json` of a run without it, but for
the time it was made; also when a worker is killed on the way. With all workers killed, the scheduler killed, no worker
there or one without this package, the command must end by itself: exit 1, and a message within half a minute. The next
run, without the cluster, must take up what was measured.
"""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.scale.codec import from_bytes
from benchmarks.hold.run_checks import current
from benchmarks.sites import ROOT, small_sample
from benchmarks.table import line, options, report, told

LIMIT_S = 30.0
START_S = 120.0
TIMES = ("created", "seconds")
Loss = Callable[["Machines"], None]


@dataclass(slots=True)
class Machines:
    """A scheduler and its workers, real processes on loopback."""

    stack: ExitStack
    scheduler: subprocess.Popen[bytes] = field(init=False)
    address: str = field(init=False)
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def __post_init__(self) -> None:
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        words = ["--host", "127.0.0.1", "--port", str(port), "--dashboard-address", ":0"]
        self.scheduler = self._start("dask_scheduler", *words)
        late = time.monotonic() + START_S
        while time.monotonic() < late:
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
                return
            time.sleep(0.2)
        raise SystemExit("the scheduler doesn't start")

    def add(self, count: int, *, package: bool = True) -> None:
        """Start workers and wait for them; without the package they can't import it."""
        from distributed import Client

        for _ in range(count):
            words = (self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
            self.workers.append(self._start("dask_worker", *words, package=package))
        with Client(self.address) as client:
            client.wait_for_workers(len(self.workers), timeout=START_S)

    def _hidden(self) -> Path:
        """Return a folder that hides the package, as though it weren't installed."""
        folder = Path(self.stack.enter_context(tempfile.TemporaryDirectory(prefix="asbuilt-bim-hidden-")))
        text = "raise ModuleNotFoundError(\"No module named 'asbuilt_bim'\", name='asbuilt_bim')\n"
        (folder / "asbuilt_bim.py").write_text(text, encoding="utf-8")
        return folder

    def _start(self, name: str, *words: str, package: bool = True) -> subprocess.Popen[bytes]:
        folders = [str(ROOT) if package else str(self._hidden())]
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", f"distributed.cli.{name}", *words], stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, cwd=tempfile.gettempdir(),
            env={**os.environ, "PYTHONPATH": os.pathsep.join(folders), "PYTHONSAFEPATH": "1"},
        )  # fmt: skip
        self.stack.callback(process.wait)
        self.stack.callback(process.kill)
        return process


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a run gave: its result without times, its words, and how long it took from a loss to its end."""

    code: int
    said: str
    result: dict[str, Any]
    after_s: float


def without_times(document: Any) -> Any:
    """Return a result without what tells the time."""
    if isinstance(document, dict):
        return {key: without_times(value) for key, value in document.items() if key not in TIMES}
    return [without_times(one) for one in document] if isinstance(document, list) else document


def run(site: Path, place: Path, machines: Machines | None, loss: Loss | None = None) -> Outcome:
    """Run the sample into `place` with a cache of its own; `loss` strikes once a station has been measured."""
    cache = place / "cache"
    words = ["run", str(site / "project.yaml"), "--out", str(place / "out"), "--workers", "1"]
    words += ["--scheduler", machines.address] if machines is not None else []
    process = subprocess.Popen(
        [sys.executable, "-m", "asbuilt_bim", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, "ASBUILT_BIM_CACHE": str(cache)}, encoding="utf-8",
    )  # fmt: skip
    if loss is not None and machines is not None:
        known = {path for path in cache.rglob("*") if path.is_file()}
        while process.poll() is None and not measured(cache) - known:
            time.sleep(0.1)
        loss(machines)
    begun = time.monotonic()
    said, _ = process.communicate()
    result = {}
    if process.returncode == 0:
        result = without_times(json.loads((current(place / "out") / "result.json").read_text(encoding="utf-8")))
    return Outcome(code=process.returncode, said=said, result=result, after_s=time.monotonic() - begun)


def measured(cache: Path) -> set[Path]:
    """Return the entries of a cache that hold a station, and not a rig or a design."""
    return {path for path in cache.glob("*/*.entry") if _station(path)}


@lru_cache
def _station(entry: Path) -> bool:
    try:
        return bool(from_bytes(entry.read_bytes()[32:], StationMeasurement))  # after its digest
    except Exception:  # whatever it is, it is no station
        return False


def kill_one(machines: Machines) -> None:
    """Kill a worker."""
    machines.workers[0].kill()


def kill_all(machines: Machines) -> None:
    """Kill every worker."""
    for worker in machines.workers:
        worker.kill()


def kill_scheduler(machines: Machines) -> None:
    """Kill the scheduler."""
    machines.scheduler.kill()


def on_cluster(site: Path, place: Path, workers: int, loss: Loss | None, *, package: bool = True) -> Outcome:
    """Run on a cluster of its own."""
    with ExitStack() as stack:
        machines = Machines(stack)
        if workers:
            machines.add(workers, package=package)
        return run(site, place, machines, loss)


def main() -> int:
    """Run, lose, and print what was told."""
    args = options(__doc__ or "").parse_args()
    if find_spec("distributed") is None:
        print("Dask isn't installed: pip install distributed; nothing was judged")
        return 0
    lines, faults = [], []
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-cluster-") as folder:
        scratch = Path(folder)
        site = small_sample(scratch, 3 if args.quick else 6)
        begun = time.monotonic()
        plain = run(site, scratch / "plain", None)
        lines.append(told("the run without a cluster", f"{time.monotonic() - begun:.0f} s", 1))
        for name, loss in (("three workers", None), ("one of three killed", kill_one)):
            found = on_cluster(site, scratch / name.replace(" ", "-"), 3, loss)
            same = found.code == 0 and found.result == plain.result
            faults += [] if same else [f"{name}: exit {found.code}: {found.said[-300:]}"]
            lines.append(line(f"{name}: the same result", "yes" if same else "no", "yes", 1, same, 1))
        for name, workers, loss, package in (
            ("all three killed", 3, kill_all, True),
            ("the scheduler killed", 3, kill_scheduler, True),
            ("no worker there", 0, None, True),
            ("workers without the package", 1, None, False),
        ):
            place = scratch / name.replace(" ", "-")
            found = on_cluster(site, place, workers, loss, package=package)
            plainly = found.code == 1 and "Traceback" not in found.said and re.search("worker|scheduler", found.said)
            holds = bool(plainly) and (loss is None or found.after_s <= LIMIT_S)
            faults += [] if holds else [f"{name}: exit {found.code}: {found.said[-300:]}"]
            lines.append(line(f"{name}: told", f"{found.after_s:.0f} s", f"{LIMIT_S:.0f} s", 1, holds, 1))
            if loss is not None:
                kept = len(measured(place / "cache"))
                again = run(site, place, None)
                took = re.search(r"(\d+) of \d+ stations were measured before", again.said)
                holds = again.result == plain.result and took is not None and int(took[1]) == kept > 0
                faults += [] if holds else [f"{name}, again, {kept} kept: exit {again.code}: {again.said[-600:]}"]
                lines.append(line("  the next run takes up what was measured", str(kept), "all", 1, holds, 1))
    for fault in faults:
        print(f"  fault: {fault}")
    return report("Three Dask workers on loopback, and what becomes of a run that loses them", lines, args)


if __name__ == "__main__":
    sys.exit(main())
