"""What a killed command leaves behind: SIGKILL at random moments of `run`, `report` and `strip`; and other bad luck.

python benchmarks/hold/kills.py --check            300 kills, a disk full at 20 points, and the rest
python benchmarks/hold/kills.py --check --quick    twelve kills, a disk full at 3 points

Each trial starts the real command on the sample's first stations, measured before, and kills it. For `run` and `report`
the moments are spread over the writing, and again over the part after the run has been made current, which is short and
the most delicate; one kill in five is at any moment of the command's life. Then `current.json` must name the old run or
the new one. That run must be whole, and so must every copy beside it. The next run must clear up and succeed. `strip`
leaves its target as it was, or whole. `adversity.py` has the full disk, the two runs at once and the clock.
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

from benchmarks.hold.adversity import adversities
from benchmarks.hold.run_checks import Reference, broken_copies, current, digests_of, fault_of
from benchmarks.sites import small_sample
from benchmarks.table import Line, line, options, report, told

TRIALS, QUICK_TRIALS = 300, 6
SHARES = {"report": 7 / 15, "run": 1 / 3, "strip": 1 / 5}
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
    started = time.perf_counter()
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
        whole_s=ended - started,
    )


def kill_at(reference: Reference, out: Path, share: float, part: str) -> bool:
    """Start the command and kill it at a share of its writing, of what is late, or of it all; False where it had ended.

    That part is "writing", "late" (once the run has been made current) or "any".
    """
    known = names(out)
    process = start(reference.command)
    if part == "any":
        time.sleep(share * reference.whole_s)
    elif wait_for_folder(out, process, known, whole=part == "late") is not None:
        time.sleep(share * (reference.publishing_s if part == "late" else reference.writing_s))
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
    """Kill a command so many times: half over its writing, three tenths after the switch, the rest at any moment."""
    shares = [(dice.random(), "any") for _ in range(count // 5)]
    early = (count - len(shares)) * 5 // 8
    late = count - len(shares) - early
    shares += [((i + dice.random()) / early, "writing") for i in range(early)]
    shares += [((i + dice.random()) / late, "late") for i in range(late)]
    dice.shuffle(shares)
    while shares:
        share, part = shares.pop()
        before = current(out)
        if not kill_at(reference, out, share, part):
            shares.append((dice.random() * share, part))  # it had ended: an earlier moment instead
            old = reference
            continue
        look(out, before, reference, old, seen)
        old = reference if current(out) != before else old
        if len(seen.pointing) % RECOVER_EVERY == 0 or not shares:
            print(f"  {len(seen.pointing)} kills, {len(seen.faults)} faults", file=sys.stderr, flush=True)
            recover(out, reference, seen)
            tidy(out)  # not before: a copy may still be of a run that was current earlier
            old = reference


def strips(source: Path, folder: Path, count: int, dice: random.Random) -> tuple[list[bool], int]:
    """Kill `strip` at any moment; return whether each left its target as it was or whole, and how many had come whole.

    Every second one replaces a file that is there, which then must stand until the whole new one does.
    """
    whole = folder / "whole.ifc"
    command = ("strip", str(source), "--out", str(whole))
    begun = time.perf_counter()
    if start(command).wait() != 0:
        raise SystemExit("strip fails without being killed")
    takes_s, after = time.perf_counter() - begun, whole.read_bytes()
    found, came = [], 0
    while len(found) < count:
        target = folder / f"plain-{len(found)}.ifc"
        before = b"what was there" if len(found) % 2 else b""
        if before:
            target.write_bytes(before)
        process = start(("strip", str(source), "--out", str(target), "--replace"))
        time.sleep(dice.random() * takes_s)
        ended = process.poll() is not None
        process.kill()
        process.wait()
        time.sleep(0.2)  # the process apart ends with its parent
        if ended:
            takes_s *= 0.95
            target.unlink(missing_ok=True)
            continue
        holds = target.read_bytes() if target.exists() else b""
        found.append(holds in (before, after))
        came += holds == after
    return found, came


def main() -> int:
    """Kill, look, recover, and print what was found."""
    parser = options(__doc__ or "")
    parser.add_argument("--seed", type=int, default=20260302)
    parser.add_argument("--kills", type=int, default=0, help="so many instead of 300")
    args = parser.parse_args()
    seen, dice = Findings(), random.Random(args.seed)
    total = args.kills or (QUICK_TRIALS if args.quick else TRIALS)
    counts = {name: round(total * share) for name, share in SHARES.items()}
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-kills-") as scratch:
        out = Path(scratch) / "out"
        os.environ.setdefault("ASBUILT_BIM_CACHE", str(Path(scratch) / "cache"))
        site = small_sample(Path(scratch))
        run = ("run", str(site / "project.yaml"), "--out", str(out), "--workers", "1", "--quiet")
        if start(run).wait() != 0:
            raise SystemExit("the sample doesn't run")
        again = uninterrupted(("report", str(out)), out)
        trials(again, out, counts["report"], again, dice, seen)
        afresh = uninterrupted(run, out)
        trials(afresh, out, counts["run"], afresh, dice, seen)
        stripped, came = strips(next(out.glob("*.asbuilt.ifc")), Path(scratch), counts["strip"], dice)
        others = adversities(site, Path(scratch), 1 if args.quick else 20, dice)
    for fault in seen.faults:
        print(f"  fault: {fault}")
    kills, least = len(seen.pointing), counts["report"] + counts["run"]
    lines = [
        _all("current.json names a whole run", seen.pointing, least),
        _all("every copy beside it is whole", seen.copies, least),
        _all("the next run clears up and succeeds", seen.recovered, kills // RECOVER_EVERY),
        _all("strip: the target is as it was, or whole", stripped, counts["strip"]),
        *others,
        told("writing, uninterrupted", f"{again.writing_s:.2f} s", 1),
        told("strip: had come whole", str(came), len(stripped)),
        *(told(f"left pointing at {name}", str(count), kills) for name, count in sorted(seen.where.items())),
    ]
    title = f"Killed at {kills + len(stripped)} random moments (seed {args.seed}), and other bad luck"
    return report(title, lines, args)


def _all(what: str, held: list[bool], least: int) -> Line:
    return line(what, f"{sum(held)} of {len(held)}", "all", len(held), all(held), least)


if __name__ == "__main__":
    sys.exit(main())
