"""What each rule of measuring faces buys: every one switched off alone, on twins, against the truth.

python benchmarks/faces/rules.py --json figures.json          the development scenes, half an hour
python benchmarks/faces/rules.py --only stout bars            the rules whose name holds one of these words
python benchmarks/faces/rules.py --together stout tabs        these off all at once: one may do another's work
python benchmarks/faces/rules.py --quick                      one scene and three rules

A rule that calls no more faces whole, no fewer falsely, and makes no area truer on many scenes buys nothing. Most were
made for one case that few scenes have, so what a rule changes is looked at before it goes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry import grow
from asbuilt_bim.measure import finish, station_faces
from asbuilt_bim.measure.outline import contour, edges, face_cost, fit, steps, straight
from asbuilt_bim.measure.planes import face_hypotheses
from asbuilt_bim.measure.round import circle
from asbuilt_bim.vision.scene import geometric, sky
from asbuilt_bim.vision.scene import read as scene_read
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.faces import twins
from benchmarks.faces.border_truth import crowded_twin, true_depth_m, true_faces
from benchmarks.faces.ends import SIGMAS, Row, holds_all, is_short, judged_rows
from benchmarks.faces.fit_ends import SEEDS
from benchmarks.faces.twins import TwinPair, read_twin
from benchmarks.table import options, report, told


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A rule by where it stands, and what stands there in its place; `reads`: the scene is read anew without it."""

    name: str
    module: Any
    attribute: str
    instead: Any
    reads: bool = False


def _first(one: Any, *_: Any) -> Any:
    """Return what a rule was given, as it was."""
    return one


def _last(*given: Any) -> Any:
    return given[-1]


def _no_covariance(*_: Any) -> Any:
    return np.zeros((3, 3))


def _none(*_: Any) -> list[Any]:
    return []


def _never(*_: Any) -> bool:
    return False


def _nowhere(given: Any, *_: Any) -> Any:
    """Return that no pixel is meant."""
    return np.zeros(np.shape(given)[-2:], dtype=bool)


RULES = (
    Rule(name="stout", module=straight, attribute="_stout", instead=_first),
    Rule(name="bridged", module=straight, attribute="bridged", instead=_first),
    Rule(name="openings", module=straight, attribute="_openings", instead=lambda own, *_: np.zeros_like(own)),
    Rule(name="one top of a pour", module=face_hypotheses, attribute="shared_ends", instead=lambda *_: None),
    Rule(name="second border of narrow faces", module=face_hypotheses, attribute="NARROW_PX", instead=0),
    Rule(name="touches", module=station_faces, attribute="_touches", instead=_none),
    Rule(name="what lies is no face", module=station_faces, attribute="lies", instead=_never),
    Rule(name="footed", module=scene_read, attribute="footed", instead=_first, reads=True),
    Rule(name="cut seams", module=scene_read, attribute="_cut_seams", instead=lambda *_: None, reads=True),
    Rule(name="flat if flatter", module=scene_read, attribute="flat_if_flatter", instead=_first, reads=True),
    Rule(name="bars", module=twins, attribute="without_bars", instead=_first, reads=True),
    Rule(name="down to the mask's foot", module=face_hypotheses, attribute="_down_to", instead=_first),
    Rule(name="refined inside the outline", module=station_faces, attribute="refine_inside", instead=_last),
    Rule(name="what depth contradicts", module=station_faces, attribute="contradiction", instead=_no_covariance),
    Rule(name="halves of a face", module=face_hypotheses, attribute="as_halves_agree", instead=_first),
    Rule(name="rows and columns bridged", module=steps, attribute="_bridged", instead=_first),
    Rule(name="explained by straight sides", module=straight, attribute="_explains", instead=lambda *_: True),
    Rule(name="unknown speaks for open", module=straight, attribute="_unknown_speaks_for_open", instead=lambda *_: 0.0),
    Rule(name="strange colours", module=face_cost, attribute="_strangeness", instead=_nowhere),
    Rule(name="gaps seen through", module=fit, attribute="_seen_through", instead=lambda *_: True),
    Rule(name="sides where planes cross", module=fit, attribute="_crossing", instead=lambda *_: None),
    Rule(name="sides merged", module=contour, attribute="_merged", instead=_first),
    Rule(name="ambiguous edges", module=edges, attribute="_ambiguity_px", instead=lambda *_: 0.0),
    Rule(name="sides open", module=finish, attribute="_side_sigma_px", instead=lambda edge, _: edge.sigma_px),
    Rule(name="silhouettes", module=circle, attribute="_touching", instead=lambda *_: None),
    Rule(name="lateral ends", module=circle, attribute="_lateral_ends", instead=lambda *_: [None, None]),
    Rule(name="concrete's colour", module=geometric, attribute="_concrete_score", instead=lambda *_: 1.0),
    Rule(name="crumbs", module=scene_read, attribute="_without_crumbs", instead=_first, reads=True),
    Rule(name="pieces joined", module=grow, attribute="_joined", instead=_first, reads=True),
    Rule(name="sky of its colour", module=sky, attribute="_of_its_colour", instead=_nowhere, reads=True),
    Rule(name="sky between bars", module=sky, attribute="_of_the_colour_beside", instead=_nowhere, reads=True),
)  # fmt: skip
NO_RULE = "all rules"


@contextmanager
def without(rules: Sequence[Rule]) -> Iterator[None]:
    """Measure without these rules meanwhile."""
    with ExitStack() as stack:
        for rule in rules:
            stack.enter_context(patch.object(rule.module, rule.attribute, rule.instead))
        yield


def rows_of(seed: int, trials: dict[str, Sequence[Rule]]) -> dict[str, list[Row]]:
    """Measure a scene once with each trial's rules off, and hold every face against the truth."""
    twin = crowded_twin(seed)
    truth, depth_m = true_faces(twin), true_depth_m(twin, seed)
    depth = depth_map(twin.pair, SemiGlobalMatcher())
    read: Callable[[], twins.Read] = lambda: _read(twin, depth)  # noqa: E731
    usual, found = read(), dict[str, list[Row]]()
    for name, rules in trials.items():
        with without(rules):
            scene = read() if any(rule.reads for rule in rules) else usual
            faces = twins.measured(scene, true_masks=False).faces
        found[name] = judged_rows(twin, truth, depth_m, seed, faces)
    return found


def _read(twin: TwinPair, depth: DepthMap) -> twins.Read:
    with patch.object(twins, "depth_map", lambda *_: depth):  # it is the same for every rule
        return read_twin(twin)


def told_of(rows: list[Row]) -> str:
    """Return what the faces come to."""
    bodies = [row for row in rows if row["body"] >= 0]
    called, parts = [r for r in bodies if r["whole"]], [r for r in bodies if not r["whole"]]
    false = sum(not holds_all(r) and is_short(r) for r in called)
    errors = np.abs([r["area_m2"] / r["true_m2"] - 1.0 for r in called if holds_all(r)] or [1.0])
    over = sum(r["area_m2"] - r["seen_m2"] > SIGMAS * r["sigma_m2"] for r in parts)
    held = np.mean([min(r["held_m2"] / max(r["seen_m2"], 1e-9), 1.0) for r in parts] or [0.0])
    none = sum(r["body"] < 0 and r["share"] < 0.5 for r in rows)
    pulls = [abs(r["area_m2"] - r["true_m2"]) / r["sigma_m2"] for r in bodies if holds_all(r)]
    within = " and ".join(f"{np.mean([pull < most for pull in pulls] or [0.0]):.0%}" for most in (1.0, 2.0))
    return (
        f"{len(bodies)} faces, {len(called)} whole, {false} falsely; off {np.median(errors):.2%}, "
        f"{np.percentile(errors, 95):.2%}; whole within 1, 2 sigma {within}; parts hold {held:.1%}, {over} over; "
        f"{none} of no concrete"
    )


def main() -> int:
    """Measure the scenes and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", help="other scenes than those of development")
    parser.add_argument("--only", nargs="*", default=[], help="rules whose name holds one of these words")
    parser.add_argument("--together", nargs="*", default=[], help="these off all at once")
    args = parser.parse_args()
    chosen = [rule for rule in RULES if not args.only or any(word in rule.name for word in args.only)]
    trials: dict[str, Sequence[Rule]] = {NO_RULE: ()}
    if args.together:
        trials["without " + ", ".join(args.together)] = [
            rule for rule in RULES if any(word in rule.name for word in args.together)
        ]
    else:
        trials |= {f"without {rule.name}": [rule] for rule in (chosen[:3] if args.quick else chosen)}
    rows: dict[str, list[Row]] = {name: [] for name in trials}
    for seed in SEEDS[:1] if args.quick else args.seeds or SEEDS:
        for name, found in rows_of(seed, trials).items():
            rows[name] += found
        print(f"scene {seed}: {len(rows[NO_RULE])} faces so far", file=sys.stderr, flush=True)
    lines = [told(name, told_of(found), len(found)) for name, found in rows.items()]
    return report("What each rule of measuring faces buys", lines, args, {}, {"faces": rows})


if __name__ == "__main__":
    sys.exit(main())
