"""The main job against the truth: target, areas, places, states, completion, on the sample and reporting seeds.

python benchmarks/site/site.py --check --json figures.json      the sample and eight ray-cast sites, some forty minutes
python benchmarks/site/site.py --quick                          the sample alone; lines with a small n are not judged
python benchmarks/site/site.py --quick --run FOLDER             the same of a run that lies in this output folder
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.sites import REPORTING_SEEDS, SAMPLE, SiteRun, generated_site, run_in, run_site
from benchmarks.table import LEAST_N, Line, line, options, quantiles, report, told, unjudged

VISIBLE = 0.5
EXPECTED_UNKNOWN = 0.1
ROUNDED = 0.0005
"""What the truth's shares are rounded by."""
MOST_OFF = {"over 80 %": (0.8, 1.0, 0.005), "25 to 80 %": (0.25, 0.8, 0.05)}
"""How far the best estimate may be off on average, by how much of an element was seen: from, to, limit."""


def visits(runs: list[SiteRun]) -> Iterator[tuple[SiteRun, dict[str, Any], dict[str, Any]]]:
    """Give each visit's run, truth and result."""
    for run in runs:
        for truth in run.truth["visits"]:
            yield run, truth, run.results[truth["date"]]


def target_lines(runs: list[SiteRun]) -> list[Line]:
    """Compare the target's distance (left camera to disc) at every station with the truth."""
    errors, missing = [], []
    for run, truth, result in visits(runs):
        measured = {station["name"]: station for station in result["stations"]}
        for station in truth["stations"]:
            found = measured.get(station["name"], {}).get("target_range_m")
            if found is None:
                missing.append(f"{run.name} {truth['date']} {station['name']}")
            else:
                errors.append(abs(found / station["disc"]["range_m"] - 1.0))
    worst = max(errors, default=1.0)
    n = len(errors) + len(missing)
    return [
        line("target distance, worst of all stations", f"{worst:.2%}", "<= 1 %", n, worst <= 0.01 and not missing),
        told("target distance, median", f"{np.median(errors):.3%}", len(errors)),
        told("stations without the target", f"{len(missing)} {', '.join(missing[:4])}".strip(), n),
    ]


def face_keys(run: SiteRun, result: dict[str, Any]) -> dict[str, int]:
    """Map the program's design face ids to the truth's face numbers: same element, plane and direction."""
    keys: dict[str, int] = {}
    truths = run.truth["faces"]
    for face in result["faces"]:
        if face["kind"] != "plane":
            continue
        origin, u, v = np.array(face["frame_m"])
        normal = np.cross(u, v)
        for number, truth in enumerate(truths):
            if truth["element"] != face["element"] or truth["kind"] != "plane":
                continue
            away = abs(normal @ (np.array(truth["origin_m"]) - origin))
            if normal @ np.array(truth["normal"]) > 0.999 and away < 0.01:
                keys[face["face_id"]] = number
    return keys


def face_errors(runs: list[SiteRun]) -> tuple[list[dict[str, Any]], Counter[str]]:
    """Return the area error of each planar face wholly in view, and what became of all such faces."""
    rows: list[dict[str, Any]] = []
    fate: Counter[str] = Counter()
    for run, truth, result in visits(runs):
        keys = face_keys(run, result)
        measured = {station["name"]: station["faces"] for station in result["stations"]}
        for station in truth["stations"]:
            whole = {f["face"]: f for f in station["faces"] if f["wholly_in_view"]}
            planar = {n: f for n, f in whole.items() if run.truth["faces"][n]["kind"] == "plane"}
            seen: set[int] = set()
            for record in measured.get(station["name"], []):
                numbers = {keys[i] for i in record["design_faces"] if i in keys}
                if not numbers or record["kind"] != "plane" or not record["whole"]:
                    continue
                fate["called whole"] += 1
                if not numbers <= planar.keys():
                    fate["called whole, wrongly"] += _falls_short(record, station, numbers)
                    continue
                seen |= numbers
                true_m2 = sum(planar[n]["built_area_m2"] for n in numbers)
                error = record["area_m2"] / true_m2 - 1.0
                sigma = np.hypot(record["area_sigma_calibration_m2"], record["area_sigma_image_m2"])
                rows.append({
                    "site": run.name, "date": truth["date"], "face": record["face_id"], "error": error,
                    "true_m2": true_m2, "narrow_px": min(planar[n]["narrow_px"] for n in numbers),
                    "pulls": (record["area_m2"] - true_m2) / sigma if sigma > 0 else float("inf"),
                })  # fmt: skip
            partial = {
                keys[i]
                for record in measured.get(station["name"], [])
                for i in record["design_faces"]
                if i in keys and not record["whole"]
            }
            for number in planar:
                fate["measured" if number in seen else "called partial" if number in partial else "not found"] += 1
    return rows, fate


def _falls_short(record: dict[str, Any], station: dict[str, Any], numbers: set[int]) -> bool:
    """Say whether a face that is partly hidden has an area short of what stands by over 3 % and 3 sigma."""
    built_m2 = sum(face["built_area_m2"] for face in station["faces"] if face["face"] in numbers)
    lacking_m2 = built_m2 - record["area_m2"]
    sigma_m2 = np.hypot(record["area_sigma_calibration_m2"], record["area_sigma_image_m2"])
    return bool(lacking_m2 > max(0.03 * built_m2, 3.0 * sigma_m2))


def area_lines(runs: list[SiteRun]) -> tuple[list[Line], list[dict[str, Any]]]:
    """Judge the areas of planar faces wholly in view."""
    rows, fate = face_errors(runs)
    wrongly, called = fate.pop("called whole, wrongly", 0), fate.pop("called whole", 0)
    errors = np.sort([abs(row["error"]) for row in rows])
    n = len(errors)
    median = float(np.median(errors)) if n else 1.0
    worst_but_two = float(errors[-3]) if n > 2 else 1.0
    one_sigma = float(np.mean([abs(row["pulls"]) <= 1.0 for row in rows])) if n else 0.0
    two_sigma = float(np.mean([abs(row["pulls"]) <= 2.0 for row in rows])) if n else 0.0
    lines = [
        line("area of planar faces wholly in view, median error", f"{median:.2%}", "<= 3 %", n, median <= 0.03),
        line("  the same, worst but two", f"{worst_but_two:.1%}", "<= 10 %", n, worst_but_two <= 0.10),
        told("  signed median", f"{np.median([r['error'] for r in rows]) if n else 0:+.2%}", n),
        told("  within one sigma / two sigma", f"{one_sigma:.0%} / {two_sigma:.0%}", n),
    ]
    lines.append(told("  called whole, yet hidden, over 3 % and 3 sigma short of what stands", str(wrongly), called))
    lines += [told(f"  faces wholly in view: {what}", str(count), sum(fate.values())) for what, count in fate.items()]
    return lines, rows


def place_lines(runs: list[SiteRun]) -> list[Line]:
    """Judge where measured faces are said to stand: off their design, and from plumb. These sites are built exactly."""
    surfaces = [face["surface"] for _, _, result in visits(runs) for face in result["faces"]]
    lines = []
    for what, value, sigma, unit in (
        ("offset from the design", "offset_m", "offset_sigma_m", "mm"), ("tilt", "tilt_rad", "tilt_sigma_rad", "mm/m"),
    ):  # fmt: skip
        known = [(abs(one[value]), one[sigma]) for one in surfaces if one[value] is not None and one[sigma]]
        off, sigmas = np.array(known).reshape(-1, 2).T
        within = [float(np.mean(off <= k * sigmas)) if len(off) else 0.0 for k in (1.0, 2.0)]
        lines.append(line(f"{what}, within two sigma", f"{within[1]:.1%}", ">= 95 %", len(off), within[1] >= 0.95))
        lines.append(told("  within one sigma", f"{within[0]:.0%}", len(off)))
        if len(off):
            sizes = f"{1e3 * np.median(off):.1f} and {1e3 * np.median(sigmas):.1f} {unit}"
            lines.append(told("  median error and median sigma", sizes, len(off)))
    return lines


def summary(rows: list[dict[str, Any]]) -> dict[str, object]:
    """Return what is recorded of the faces: the spread of their errors and pulls, by the width of the narrow side."""
    bins = {"60 px and more": (60.0, np.inf), "30 to 60 px": (30.0, 60.0), "under 30 px": (0.0, 30.0)}
    found: dict[str, object] = {}
    for name, (least, most) in bins.items():
        own = [row for row in rows if least <= row["narrow_px"] < most]
        found[name] = {key: quantiles(row[key] for row in own) for key in ("error", "pulls")}
    return {"spread": found}


def element_lines(runs: list[SiteRun]) -> list[Line]:
    """Judge states and completion of the elements, visit by visit.

    A cell counts as visible when half of one of its sides is (`half_visible_share`). That any 2 cm sample of it can be
    seen (`visible_share`) is reported beside it, and decides what counts as not observed.
    """
    right = wrong = unknown = unobserved = false_zero = slivers_right = slivers = 0
    gaps: list[float] = []
    confusion: Counter[str] = Counter()
    for _, truth, result in visits(runs):
        measured = {element["global_id"]: element for element in result["elements"]}
        for element in truth["elements"]:
            judged = measured[element["global_id"]]
            completion = judged["completion"]
            if element["visible_share"] < EXPECTED_UNKNOWN:  # what an earlier visit saw built stays built
                unobserved += 1
                false_zero += completion["best"] == 0.0 or judged["state"] == "not started"
            if element["half_visible_share"] > VISIBLE:
                right += judged["state"] == element["state"]
                unknown += judged["state"] == "unknown"
                wrong += judged["state"] != element["state"]
                confusion[f"{element['state']} called {judged['state']}"] += judged["state"] != element["state"]
            if element["visible_share"] > VISIBLE:
                slivers += 1
                slivers_right += judged["state"] == element["state"]
            if completion["coverage"] > 0.8 and completion["best"] is not None:
                gaps.append(abs(completion["best"] - element["completion"]))
    n = right + wrong
    share, lost = (right / n, unknown / n) if n else (0.0, 1.0)
    gap = float(np.mean(gaps)) if gaps else 1.0
    lines = [
        line("state right, elements over 50 % visible", f"{share:.1%}", ">= 95 %", n, share >= 0.95),
        line("  of these called unknown", f"{lost:.1%}", "<= 5 %", n, lost <= 0.05),
        told("  state right, cells seen by any sliver count", f"{slivers_right / max(slivers, 1):.1%}", slivers),
        line("completion, mean gap where coverage > 80 %", f"{gap * 100:.1f} points", "<= 5", len(gaps), gap <= 0.05),
        line("unobserved elements reported as 0 %", str(false_zero), "0", unobserved, false_zero == 0),
    ]
    return lines + [told(f"  {what}", str(count), n) for what, count in confusion.most_common() if count]


def bounds_lines(runs: list[SiteRun]) -> list[Line]:
    """Judge what is said of ALL elements: certain states, bounds, and the best estimate by what was seen."""
    pairs = [
        (element, next(one for one in result["elements"] if one["global_id"] == element["global_id"]))
        for _, truth, result in visits(runs)
        for element in truth["elements"]
    ]
    wrong = sum(b["state"] not in ("unknown", a["state"]) for a, b in pairs)
    said = [(a["completion"], b["completion"]) for a, b in pairs]
    inside = float(np.mean([b["lower"] - ROUNDED <= a <= b["upper"] + ROUNDED for a, b in said]))
    width = float(np.mean([b["upper"] - b["lower"] for _, b in said]))
    n = len(pairs)
    lines = [
        line("all elements, in a wrong state", f"{wrong}", "<= 0.7 %", n, wrong <= 0.007 * n),
        line("all elements, truth within the bounds", f"{inside:.1%}", ">= 97 %", n, inside >= 0.97),
        told("  mean width of the bounds", f"{100 * width:.1f} points", n),
    ]
    for what, (least, most, limit) in MOST_OFF.items():
        off = [abs(b["best"] - a) for a, b in said if b["best"] is not None and least < b["coverage"] <= most]
        mean = float(np.mean(off)) if off else 1.0
        name = f"best estimate, mean error where {what} was seen"
        lines.append(line(name, f"{100 * mean:.2f} points", f"<= {100 * limit:g}", len(off), mean <= limit))
    return lines


def storey_lines(runs: list[SiteRun]) -> list[Line]:
    """Ask whether each storey's true completion lies within the bounds that the program gives."""
    inside, n, outside = 0, 0, []
    for run, truth, result in visits(runs):
        completions = {storey["name"]: storey["completion"] for storey in result["storeys"]}
        for storey in truth["storeys"]:
            n += 1
            bounds = completions[storey["name"]]
            if bounds["lower"] <= storey["completion_by_area"] <= bounds["upper"]:
                inside += 1
            else:
                outside.append(
                    f"{run.name} {truth['date']} {storey['name']}: {storey['completion_by_area']:.3f} not in "
                    f"{bounds['lower']:.3f}..{bounds['upper']:.3f}"
                )
    lines = [line("storeys whose true completion lies within the bounds", f"{inside} of {n}", "all", n, inside == n)]
    return lines + [told(f"  {text}", "", 1) for text in outside]


def main() -> int:
    """Run the sites and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", help="other seeds than the reporting ones (for development)")
    parser.add_argument("--no-sample", action="store_true", help="leave the shipped sample out")
    parser.add_argument("--run", type=Path, metavar="FOLDER", help="the sample's run that lies there, not a new one")
    parser.add_argument("--workers", type=int, default=None)
    args = parser.parse_args()
    seeds = () if args.quick else tuple(args.seeds) if args.seeds is not None else REPORTING_SEEDS
    runs = [] if args.no_sample or args.run else [run_site(SAMPLE, "sample", args.workers)]
    runs += [run_in(args.run, SAMPLE, "sample", 0.0)] if args.run else []
    for seed in seeds:
        print(f"seed {seed} ...", file=sys.stderr)
        runs.append(run_site(generated_site(seed), f"seed {seed}", args.workers))
    areas, rows = area_lines(runs)
    bounds = unjudged(bounds_lines(runs)) if args.quick else bounds_lines(runs)  # aims for many sites: shares and means
    lines = [*target_lines(runs), *areas, *element_lines(runs), *bounds, *storey_lines(runs), *place_lines(runs)]
    lines += [told(f"seconds, {run.name}", f"{run.seconds:.0f}", 1) for run in runs if run.seconds]
    if args.quick:  # one site has too few cases to judge by: its figures are shown, only the wrong ones count
        lines = unjudged(lines, LEAST_N)
    worst = sorted(rows, key=lambda row: -abs(row["error"]))[:10]
    for row in worst:
        print(f"  {row['site']} {row['date']} {row['face']:>8}: {row['error']:+.1%} of {row['true_m2']:.2f} m2, "
              f"narrow side {row['narrow_px']:.0f} px, {row['pulls']:+.1f} sigma")  # fmt: skip
    return report("The main job against the truth", lines, args, summary(rows), {"faces": rows})


if __name__ == "__main__":
    sys.exit(main())
