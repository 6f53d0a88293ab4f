"""Whole runs on real photo pairs: surveyed tags drawn in at known places, a design built on the truth.

python benchmarks/real/whole_runs.py --check --json figures.json     the scenes that are developed on
python benchmarks/real/whole_runs.py --scenes report                 those that are only reported: look at them once
python benchmarks/real/whole_runs.py --quick                         one scene
python benchmarks/real/whole_runs.py --pictures FOLDER               keeps the projects, the photos and the results

Each scene is a real pair with a known geometry. Elements of the design lie on surfaces that truly stand, or in free
space that one sees through. The photographs are not part of the project: ASBUILT_BIM_DATA names their folder. What is
absent is named and not judged. A scene in colour runs again in grey and in red-brown, and must say the same.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.real.whole_draw import draw
from benchmarks.real.whole_places import PLACES
from benchmarks.real.whole_project import write_project
from benchmarks.real.whole_scenes import Paint, read_scene, repainted
from benchmarks.real.whole_truth import Body, World, build_world
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told, unjudged

VISIBLE, DECIDED = 0.5, 0.8
LEAST_PLACES, LEAST_VISITS = 3, 8
BOUNDS_OFF = 0.02
"""What the truth of a completion may itself err by: where a stone wall ends is known to a hand's breadth."""
AGREE = 0.85
"""Share of the known points that have to say what the truth says; a scene that falls short is set up wrongly."""
QUICK = "electro"
PAINTS: tuple[Paint, ...] = ("grey", "red-brown")
"""Scenes in colour run again so: depth and design are the same, so the states must be."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visit:
    """One element in one run, with what is true of it; `found` is None where the run gave no result."""

    scene: str
    paint: Paint
    body: Body
    found: dict[str, Any] | None
    said: str = ""

    @property
    def state(self) -> str:
        """Return what is true."""
        share = self.body.completion
        return "complete" if share == 1.0 else "not started" if share == 0.0 else "part"

    @property
    def called(self) -> str:
        """Return what the program says."""
        return str(self.found["state"]) if self.found else "no result"

    @property
    def wrong(self) -> bool:
        """Say whether the program states what isn't so: another state, or bounds without the truth."""
        if self.found is None:
            return False
        bounds = self.found["completion"]
        outside = not bounds["lower"] - BOUNDS_OFF <= self.body.completion <= bounds["upper"] + BOUNDS_OFF
        return outside or self.called not in (self.state, "unknown")

    @property
    def told(self) -> str:
        """Return a row's figure: the state, the bounds, the coverage."""
        if self.found is None:
            return "no result"
        share = self.found["completion"]
        return f"{self.called}, {share['lower']:.0%} to {share['upper']:.0%}, seen {share['coverage']:.0%}"


def run_scene(name: str, folder: Path, paint: Paint = "as it is") -> list[Visit] | None:
    """Make a scene's project, run the program on it as a user would, and set its answers beside the truth."""
    scene = read_scene(name)
    if scene is None or (paint != "as it is" and not scene.in_colour):
        return None
    place = PLACES[name]
    world = build_world(repainted(scene, paint), place)
    _refuse_wrong_setup(world)
    project, names = write_project(folder, world, place, draw(world, place))
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)  # an earlier result would count as an earlier visit
    command = [
        sys.executable,
        "-m",
        "asbuilt_bim",
        "run",
        str(project),
        "--out",
        str(out),
        "--no-cache",
        "--workers",
        "1",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = " ".join(f"{done.stdout} {done.stderr}".split())
    (folder / "said.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    found: dict[str, dict[str, Any]] = {}
    if (out / "result.json").is_file():
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        found = {names[one["global_id"]]: one for one in result["elements"]}
    return [
        Visit(scene=name, paint=paint, body=body, found=found.get(element), said="" if found else said[-160:])
        for element, body in world.bodies.items()
    ]


def _refuse_wrong_setup(world: World) -> None:
    """Refuse elements of which the known points say something else than the truth that was written down."""
    for name, body in world.bodies.items():
        if body.agree < AGREE:
            raise SystemExit(
                f"{world.scene.name}, {name}: only {body.agree:.0%} of the known points agree with its truth"
            )


def lines_of(visits: list[Visit], told_too: list[Visit]) -> list[Line]:
    """Judge the runs; the rows of single elements only inform."""
    shown = [one for one in visits if one.body.visible > VISIBLE]
    decided = sum(one.called not in ("unknown", "no result") for one in shown)
    wrong = [one for one in visits + told_too if one.wrong]
    places = len({one.scene for one in visits})
    enough = places >= LEAST_PLACES
    share, runs = decided / len(shown) if shown else 0.0, len(visits) + len(told_too)
    plain = {(one.scene, one.body.element.name): one for one in visits}
    pairs = {paint: [(plain[one.scene, one.body.element.name], one) for one in told_too if one.paint == paint]
             for paint in PAINTS}  # fmt: skip
    lines = [
        line(f"elements called wrongly, {places} places", str(len(wrong)), "0", runs, enough and not wrong,
             LEAST_VISITS),
        line("elements over 50 % visible that are decided", f"{share:.0%}", f">= {DECIDED:.0%}", len(shown),
             share >= DECIDED and enough, LEAST_VISITS),
        *(_same_line(paint, both) for paint, both in pairs.items()),
    ]  # fmt: skip
    return lines + [_row(one) for one in visits + told_too]


def _same_line(paint: Paint, pairs: list[tuple[Visit, Visit]]) -> Line:
    differ = sum(one.called != other.called for one, other in pairs)
    return line(f"elements of another state in {paint} than as they are", str(differ), "0", len(pairs), not differ, 1)


def _row(visit: Visit) -> Line:
    paint = f" in {visit.paint}" if visit.paint in PAINTS else ""
    what = f"  {visit.scene}{paint}: {visit.body.element.name}, truly {visit.body.completion:.0%}"
    return told(what, f"{'WRONG ' if visit.wrong else ''}{visit.told}", 1)


def rows_of(visits: list[Visit]) -> list[dict[str, object]]:
    """Return every visit as a record."""
    return [
        {"scene": one.scene, "paint": one.paint, "element": one.body.element.name, "truth": one.body.completion,
         "visible": one.body.visible, "found": one.found, "wrong": one.wrong, "said": one.said}
        for one in visits
    ]  # fmt: skip


def main() -> int:
    """Run the scenes and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--scenes", default="develop", help="develop, report, all, or names with commas between")
    parser.add_argument("--pictures", type=Path, help="keep projects and results in this folder, outside the project")
    args = parser.parse_args()
    if absent(DATA / "stereo"):
        return 0
    roles = ("develop", "report") if args.scenes == "all" else tuple(args.scenes.split(","))
    names = [QUICK] if args.quick else [name for name, place in PLACES.items() if {place.role, name} & set(roles)]
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        folder = args.pictures or Path(scratch)
        visits: list[Visit] = []
        again: list[Visit] = []
        lines: list[Line] = []
        for name in names:
            print(f"{name} ...", file=sys.stderr)
            found = run_scene(name, folder / name)
            if found is None:
                lines.append(told(f"{name}: absent, not judged", "", 0))
                continue
            visits += found
            for paint in PAINTS:
                again += run_scene(name, folder / f"{name}_{paint}", paint) or []
    if not visits:
        print("none of the scenes is in the data folder; nothing was judged")
        return 0
    judged = lines_of(visits, again) + lines
    rows: dict[str, object] = {"visits": rows_of(visits + again)}
    return report("Whole runs on real pairs", unjudged(judged) if args.quick else judged, args, None, rows)


if __name__ == "__main__":
    sys.exit(main())
