"""What a killed run leaves behind: SIGKILL at random moments of its writing, then a look at everything in the folder.

python benchmarks/site/crash.py --check            60 kills while the sample is written
python benchmarks/site/crash.py --check --quick    six, of two of its stations

Each trial starts `asbuilt-bim report` (or `run`, from the cache) on the shipped sample in a process of its own, and
kills it once its run folder has appeared. The moments are spread evenly over the writing, and again over the part after
the run has been made current, which is short and the most delicate. Then `current.json` must name the old run or the
new one. That run must be whole, and so must every copy beside it. The next run must clear up and succeed.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.site.run_checks import Reference, broken_copies, current, digests_of, fault_of
from benchmarks.sites import SAMPLE, small_sample
from benchmarks.table import Line, line, options, report, told

TRIALS, QUICK_TRIALS = 50, 6
RECOVER_EVERY = (
    5  # a full run after every fifth; the trials between recover too, since each starts on what the last left
)


@dataclass(slots=True)
class Findings:
    """What was found in the folder after each kill."""

    where: Counter[str] = field(default_factory=Counter)
    pointing: list[bool] = field(default_factory=list)
    copies: list[bool] = field(default_factory=list)
    recovered: list[bool] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def start(command: tuple[str, ...]) -> subprocess.Popen[bytes]:
    """Start the program in a process of its own."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([sys.executable, "-m", "asbuilt_bim", *command], **quiet)  # type: ignore[call-overload,no-any-return]


def wait_for_folder(out: Path, process: subprocess.Popen[bytes], known: set[str], *, whole: bool) -> Path | None:
    """Wait until a run's folder appears, as it is begun or (`whole`) as it is done; None where the run ended first."""
    while process.poll() is None:
        for path in (out / "runs").iterdir():
            if path.name not in known and path.is_dir() and (path.suffix == ".part") != whole:
                return path
        time.sleep(0.0005)
    return None


def names(out: Path) -> set[str]:
    """Return what lies in `runs/`."""
    return {path.name for path in (out / "runs").iterdir()}


def uninterrupted(command: tuple[str, ...], out: Path) -> Reference:
    """Let a command run through twice, and time the second."""
    if start(command).wait() != 0:
        raise SystemExit(f"asbuilt-bim {' '.join(command)} fails without being killed")
    first = digests_of(current(out))
    process, known = start(command), names(out)
    wait_for_folder(out, process, known, whole=False)
    begun = time.perf_counter()
    wait_for_folder(out, process, known, whole=True)
    switched = time.perf_counter()
    process.wait()
    ended = time.perf_counter()
    second = digests_of(current(out))
    same = {name: digest for name, digest in second.items() if first.get(name) == digest}
    return Reference(
        command=command,
        names=frozenset(second),
        digests=same,
        writing_s=ended - begun,
        publishing_s=ended - switched,
    )


def kill_at(reference: Reference, out: Path, share: float, *, late: bool) -> bool:
    """Start the command and kill it at a share of its writing (`late`: of what follows); False where it had ended."""
    known = names(out)
    process = start(reference.command)
    if wait_for_folder(out, process, known, whole=late) is not None:
        time.sleep(share * (reference.publishing_s if late else reference.writing_s))
    ended = process.poll() is not None
    process.kill()
    process.wait()
    return not ended


def look(out: Path, before: Path, reference: Reference, old: Reference, findings: Findings) -> None:
    """Look at the folder after a kill: where it points, and whether all that it offers is whole."""
    try:
        now = current(out)
    except (OSError, ValueError, KeyError) as problem:
        findings.pointing.append(False)
        findings.faults.append(f"current.json: {problem}")
        return
    new = [path for path in (out / "runs").iterdir() if path.is_dir() and path.suffix != ".part"]
    fault = fault_of(now, old if now == before else reference)
    findings.where["the old run" if now == before else "the new run"] += 1
    findings.pointing.append(not fault)
    copies = broken_copies(out, [before, now, *new])
    findings.copies.append(not copies)
    findings.faults += [one for one in (fault, *copies) if one]


def recover(out: Path, reference: Reference, findings: Findings) -> None:
    """Run the command through: it must succeed, leave nothing half, and bring every copy up to date."""
    code = start(reference.command).wait()
    left = [path.name for path in out.rglob("*.part")]
    stale = broken_copies(out, [current(out)])
    fault = fault_of(current(out), reference)
    findings.recovered.append(code == 0 and not left and not stale and not fault)
    findings.faults += [f"after recovery: {one}" for one in (*left, *stale, fault) if one]


def tidy(out: Path) -> None:
    """Take old runs away, as anyone may: sixty of them fill a disk."""
    kept = current(out)
    for run in (out / "runs").iterdir():
        if run.is_dir() and run != kept and run.suffix != ".part":
            shutil.rmtree(run)


def trials(reference: Reference, out: Path, count: int, old: Reference, dice: random.Random, seen: Findings) -> None:
    """Kill a command so many times: two thirds over the whole of its writing, one third after the switch."""
    early = count * 2 // 3
    shares = [((i + dice.random()) / early, False) for i in range(early)]
    shares += [((i + dice.random()) / (count - early), True) for i in range(count - early)]
    dice.shuffle(shares)
    while shares:
        share, late = shares.pop()
        before = current(out)
        if not kill_at(reference, out, share, late=late):
            shares.append((dice.random() * share, late))  # it had ended: an earlier moment instead
            old = reference
            continue
        look(out, before, reference, old, seen)
        old = reference if current(out) != before else old
        if len(seen.pointing) % RECOVER_EVERY == 0 or not shares:
            recover(out, reference, seen)
            tidy(out)  # not before: a copy may still be of a run that was current earlier
            old = reference


def main() -> int:
    """Kill, look, recover, and print what was found."""
    parser = options(__doc__ or "")
    parser.add_argument("--seed", type=int, default=20260302)
    args = parser.parse_args()
    seen, dice = Findings(), random.Random(args.seed)
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-crash-") as scratch:
        out = Path(scratch) / "out"
        os.environ.setdefault("ASBUILT_BIM_CACHE", str(Path(scratch) / "cache"))
        site = small_sample(Path(scratch)) if args.quick else SAMPLE
        run = ("run", str(site / "project.yaml"), "--out", str(out), "--workers", "1", "--quiet")
        if start(run).wait() != 0:
            raise SystemExit("the sample doesn't run")
        again = uninterrupted(("report", str(out)), out)
        trials(again, out, QUICK_TRIALS if args.quick else TRIALS, again, dice, seen)
        if not args.quick:
            afresh = uninterrupted(run, out)
            trials(afresh, out, TRIALS // 5, afresh, dice, seen)
    for fault in seen.faults:
        print(f"  fault: {fault}")
    kills, least = len(seen.pointing), QUICK_TRIALS if args.quick else TRIALS
    lines: list[Line] = [
        line(
            "current.json names a whole run",
            f"{sum(seen.pointing)} of {kills}",
            "all",
            kills,
            all(seen.pointing),
            least,
        ),
        line("every copy beside it is whole", f"{sum(seen.copies)} of {kills}", "all", kills, all(seen.copies), least),
        line(
            "the next run clears up and succeeds",
            f"{sum(seen.recovered)} of {len(seen.recovered)}",
            "all",
            len(seen.recovered),
            all(seen.recovered),
            kills // RECOVER_EVERY,
        ),
        told("writing, uninterrupted", f"{again.writing_s:.2f} s", 1),
        *(told(f"left pointing at {name}", str(count), kills) for name, count in sorted(seen.where.items())),
    ]
    return report(f"Killed at {kills} random moments of writing (seed {args.seed})", lines, args)


if __name__ == "__main__":
    sys.exit(main())
