"""Bad luck that is no kill: a disk that fills up, two runs at once, a place that can't be written, a clock set back."""

from __future__ import annotations

import contextlib
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks.hold.run_checks import broken_copies, current, digests_of
from benchmarks.table import Line, line, told

BACK_DAYS = 400
_BACK = """
import sys, time
from datetime import UTC, datetime, timedelta
from pathlib import Path
back = timedelta(days={days})
now = time.time
time.time = lambda: now() - back.total_seconds()
from asbuilt_bim.terminal.commands import RunRequest, run_command
from asbuilt_bim.terminal.screen import Screen
request = RunRequest(project=Path(sys.argv[1]), out=Path(sys.argv[2]), workers=1, quiet=True)
sys.exit(run_command(request, Screen(quiet=True), datetime.now(UTC) - back))
"""


def adversities(site: Path, scratch: Path, points: int, dice: random.Random) -> list[Line]:
    """Return a line for each sort of bad luck; those that need the right to mount are left out without it."""
    lines = [_two_at_once(site, scratch, min(3, points)), _clock_back(site, scratch)]
    with contextlib.suppress(PermissionError):
        return [*lines, _full_disk(site, scratch, points, dice), _read_only(site, scratch)]
    return [*lines, told("a full disk, a read-only one: not tried, mounting isn't allowed here", "", 0)]


def _run(site: Path, out: Path) -> subprocess.Popen[str]:
    words = ["run", str(site / "project.yaml"), "--out", str(out), "--workers", "1", "--quiet"]
    command = [sys.executable, "-m", "asbuilt_bim", *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def _whole(out: Path) -> bool:
    """Say whether a folder points at a whole run, with nothing half beside it."""
    run = current(out)
    return (run / "result.json").is_file() and not broken_copies(out, [run]) and not list(out.rglob("*.part"))


@contextlib.contextmanager
def _disk(folder: Path, size: int) -> Iterator[Path]:
    """Give a disk of so many bytes; what it holds is gone afterwards.

    Raises:
        PermissionError: mounting isn't allowed here.
    """
    folder.mkdir(exist_ok=True)
    options = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    if sys.platform != "linux" or subprocess.run(options, capture_output=True, check=False).returncode != 0:
        raise PermissionError("mount")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def _full_disk(site: Path, scratch: Path, points: int, dice: random.Random) -> Line:
    """Run onto a disk that holds a whole run and has room for a part of the next."""
    first = scratch / "roomy"
    if _run(site, first).wait() != 0:
        raise SystemExit("the sample doesn't run")
    needs = sum(path.stat().st_size for path in current(first).rglob("*") if path.is_file())
    held = []
    for number in range(points):
        with _disk(scratch / "disk", 8 * needs) as disk:
            out = disk / "out"
            shutil.copytree(first, out, symlinks=True)
            before = digests_of(current(out))
            room = int((number + dice.random()) / points * needs)
            free = shutil.disk_usage(disk).free
            with (disk / "ballast").open("wb") as ballast:
                ballast.write(bytes(max(0, free - room)))
            process = _run(site, out)
            _, said = process.communicate()
            named = "disk is full" in said or "No space left" in said
            told_so = process.returncode == 1 and "Traceback" not in said and named
            held.append(told_so and digests_of(current(out)) == before and not list(out.rglob("*.part")))
    return line("disk full: told, and the old run stands", f"{sum(held)} of {points}", "all", points, all(held), points)


def _read_only(site: Path, scratch: Path) -> Line:
    """Run into a folder that can't be written, with a whole run in it: told in a line, and all as it was."""
    with _disk(scratch / "disk", 100_000_000) as disk:
        out = disk / "out"
        shutil.copytree(scratch / "roomy", out)
        before = digests_of(out)
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        process = _run(site, out)
        _, said = process.communicate()
        held = process.returncode == 1 and "Traceback" not in said and digests_of(out) == before
    return line("read-only: told, and all as it was", "yes" if held else "no", "yes", 1, held, 1)


def _two_at_once(site: Path, scratch: Path, times: int) -> Line:
    """Start two runs into one folder: one may be refused, both may succeed, and what stands is whole."""
    out, held = scratch / "shared", []
    for _ in range(times):
        both = [_run(site, out), _run(site, out)]
        said = [process.communicate()[1] for process in both]
        codes = sorted(process.returncode for process in both)
        plain = not any("Traceback" in text for text in said)
        held.append(plain and codes in ([0, 0], [0, 1]) and _whole(out))
    return line("two runs at once: what stands is whole", f"{sum(held)} of {times}", "all", times, all(held), times)


def _clock_back(site: Path, scratch: Path) -> Line:
    """Run again with the clock set back: the later run is the current one, and the earlier isn't lost."""
    out = scratch / "clock"
    if _run(site, out).wait() != 0:
        raise SystemExit("the sample doesn't run")
    first = current(out)
    before = digests_of(first)
    command = [sys.executable, "-c", _BACK.format(days=BACK_DAYS), str(site / "project.yaml"), str(out)]
    code = subprocess.run(command, check=False, env=os.environ.copy()).returncode
    held = code == 0 and current(out) != first and _whole(out) and digests_of(first) == before
    held = held and _run(site, out).wait() == 0 and _whole(out)
    return line(f"clock {BACK_DAYS} days back: nothing lost", "yes" if held else "no", "yes", 1, held, 1)
