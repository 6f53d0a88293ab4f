"""Reading real IFC files: each is read or refused by name, in time and memory, and areas agree with other ways.

ASBUILT_BIM_DATA=../shared/data python benchmarks/ifc/read.py --json figures.json
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.read.design import inspect_file
from asbuilt_bim.report.wording.notes import note_words
from benchmarks.ifc.rounds import peak_mb
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, quantiles, report, told

FILES = DATA / "ifc"
QUICK_BYTES = 300_000
LONG_S = 900
TOGETHER_BYTES = 1_000_000
"""Smaller files share a process, which starts longer than they take; their memory is then that of the largest yet."""
_MARK = "found: "
SIZES_M: dict[str, tuple[float, float, float]] = {  # read off the file's own profile and depth, by its own unit
    "ifc43/models/building-elements/wall-extrusion/wall-extruded-solid.ifc": (5.0, 0.27, 2.0),
    "ifc43/models/tessellated-shape/column-straight-rectangle-tessellation/"
    "column-straight-rectangle-tessellation.ifc": (0.2032, 0.2032, 3.048),  # 8 x 8 inches, 10 feet
    "geometry/building_element_configuration_wall.ifc": (3.0, 0.3, 2.0),
    "units/Revit(2014,Wall(Base_Constraint('Level 1'),Top_Constriant('Level 2'))--IFCExporter(2_9_0,CV_2_0).ifc": (
        3.048, 0.2032, 3.048,
    ),
    "units/Vectorworks(2014,Wall(Bot_Bound('Design Layer-1'),Top_Bound('Design Layer-1)))--"
    "Vectorworks(2014,CV_2_0).ifc": (3.048, 0.1524, 2.4384),
}  # fmt: skip


def examine(path: Path) -> dict[str, object]:
    """Inspect one file in this process and return what it gave."""
    start, cpu = time.perf_counter(), time.process_time()
    found: dict[str, object] = {}
    try:
        inspection = inspect_file(path)
        found["refused"] = inspection.refusal
        found["facts"] = {
            "schema": inspection.facts.schema,
            "units": list(inspection.facts.units),
            "in_file": sum(count for _, count in inspection.facts.kinds),
            "tasks": inspection.facts.tasks,
            "crs": inspection.facts.georeference.crs if inspection.facts.georeference else "",
        }
        if inspection.design is not None:
            found |= _design(inspection.design, path)
    except DesignError as error:
        found["refused"] = str(error)
    except Exception as error:  # what this benchmark is there to find
        found["crashed"] = f"{type(error).__name__}: {error}"[:300]
    found |= {
        "seconds": round(time.perf_counter() - start, 2),
        "cpu_s": round(time.process_time() - cpu, 2),
        "peak_mb": round(peak_mb()),
    }
    return found


def _design(design: BimModel, path: Path) -> dict[str, object]:
    lateral = [
        (sum(face.area_m2 for face in element.faces), _lateral_m2(element.vertices_m, element.triangles))
        for element in design.elements
    ]
    apart = [abs(ours - other) / other for ours, other in lateral if other > 0.01]
    return {
        "storeys": len(design.storeys),
        "elements": dict(Counter(element.kind for element in design.elements)),
        "round_faces": sum(hasattr(f.frame, "radius_m") for e in design.elements for f in e.faces),
        "exposed_m2": round(sum(element.exposed_area_m2 for element in design.elements), 3),
        "over": sum(f.exposed_area_m2 > f.area_m2 + 1e-6 for e in design.elements for f in e.faces),
        "apart": [round(float(value), 6) for value in apart],
        "sizes": [[e.length_m, e.thickness_m, e.height_m] for e in design.elements[:1]],
        "qto": _qto(design),
        "notes": [note_words(note) for note in design.notes],
    }


def _lateral_m2(vertices_m: np.ndarray, triangles: np.ndarray) -> float:
    """Return the area of a mesh's upright triangles, added one by one: no faces, no unions, no lateral surfaces."""
    a, b, c = (vertices_m[triangles[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    upright = np.abs(across[:, 2]) < 0.2 * length
    return float(length[upright].sum() / 2.0)


def _qto(design: BimModel) -> list[float]:
    """Return our net volume over the file's own, for the elements that state one."""
    pairs = [(e.volume_m3, e.qto["NetVolume"]) for e in design.elements if e.qto.get("NetVolume", 0.0) > 0.0]
    return [round(ours / own, 5) for ours, own in pairs]


def run(paths: list[Path]) -> list[dict[str, object]]:
    """Examine files in a process of their own; a crash of a library costs only the file that it happens in."""
    found: list[dict[str, object]] = []
    while len(found) < len(paths):
        rest = [str(path) for path in paths[len(found) :]]
        try:
            done = subprocess.run(
                [sys.executable, __file__, "--these", *rest],
                capture_output=True, text=True, timeout=LONG_S, check=False,
            )  # fmt: skip
            output, why = done.stdout, f"exit code {done.returncode}: {done.stderr[-200:]}"
        except subprocess.TimeoutExpired as stopped:
            output, why = (stopped.stdout or b"").decode(), f"took more than {LONG_S} s"
        answers = [json.loads(text[len(_MARK) :]) for text in output.splitlines() if text.startswith(_MARK)]
        found += answers if len(answers) == len(rest) else [*answers, {"crashed": why}]
    return found


def main() -> int:
    """Read every file and print what came of it."""
    if sys.argv[1:2] == ["--these"]:
        for name in sys.argv[2:]:
            print(_MARK + json.dumps(examine(Path(name))), flush=True)
        return 0
    parser = options(__doc__ or "")
    parser.add_argument("--below-mb", type=float, default=1e6, help="leave larger files out")
    args = parser.parse_args()
    if absent(FILES):
        return 0
    paths = sorted(FILES.rglob("*.ifc"), key=lambda path: path.stat().st_size)
    most = min(QUICK_BYTES if args.quick else 1e12, args.below_mb * 1e6)
    paths = [path for path in paths if path.stat().st_size < most]
    small = [path for path in paths if path.stat().st_size < TOGETHER_BYTES]
    found: dict[str, dict[str, object]] = {}
    for batch in [small, *([path] for path in paths[len(small) :])]:
        for path, one in zip(batch, run(batch), strict=True):
            name = path.relative_to(FILES).as_posix()
            found[name] = one
            print(f"  {name}: {_said(one)}", flush=True)
    return report("Reading real IFC files", _lines(found), args, summary(found), {"files": found})


def summary(found: dict[str, dict[str, Any]]) -> dict[str, object]:
    """Return what is recorded of the files: why they were refused, and the spread of areas, volumes and costs."""
    refused = [one["refused"].partition(": ")[2].partition(" (Ifc")[0] for one in found.values() if one.get("refused")]
    read = [one for one in found.values() if "elements" in one]
    kinds: Counter[str] = Counter()
    for one in read:
        kinds.update(one["elements"])
    return {
        "schemas": dict(Counter(one["facts"]["schema"] for one in found.values() if "facts" in one)),
        "refused": dict(Counter(refused)),
        "crashed": {name: one["crashed"] for name, one in found.items() if one.get("crashed")},
        "elements": dict(kinds),
        "spread": {
            "lateral_area_apart": quantiles(value for one in read for value in one["apart"]),
            "net_volume_over_own": quantiles(value for one in read for value in one["qto"]),
            "cpu_s": quantiles(one["cpu_s"] for one in found.values() if "cpu_s" in one),
            "peak_mb": quantiles(one["peak_mb"] for one in found.values() if "peak_mb" in one),
        },
    }


def _said(one: dict[str, object]) -> str:
    if one.get("crashed"):
        return f"CRASHED {one['crashed']}"
    what = f"refused: {str(one['refused'])[-110:]}" if one.get("refused") else f"{one['elements']}"
    return f"{one['seconds']} s, {one['peak_mb']} MB, {what}"


def _lines(found: dict[str, dict[str, object]]) -> list[Line]:
    read = {name: one for name, one in found.items() if "elements" in one}
    refused = [one for one in found.values() if one.get("refused")]
    worded = [one for one in refused if ";" in str(one["refused"])]
    crashed = [name for name, one in found.items() if one.get("crashed")]
    apart = np.array([value for one in read.values() for value in one["apart"]])  # type: ignore[attr-defined]
    over = sum(int(str(one["over"])) for one in read.values())
    ratios = np.array([value for one in read.values() for value in one["qto"]])  # type: ignore[attr-defined]
    sizes = [
        float(np.abs(np.array(read[name]["sizes"][0]) - size).max())  # type: ignore[index]
        for name, size in SIZES_M.items()
        if name in read
    ]
    lines = [
        line("files that end in a crash", f"{len(crashed)} of {len(found)}", "0", len(found), not crashed),
        line("refusals that say what to do", f"{len(worded)} of {len(refused)}", "all", len(refused),
             worded == refused),
        told("files read", f"{len(read)}", len(found)),
        line("lateral area against triangles added up, within 1 %", _share(apart < 0.01), "99 %", len(apart),
             bool(len(apart)) and bool(np.mean(apart < 0.01) >= 0.99)),
        line("faces that expose more than they have", f"{over}", "0", len(apart), over == 0),
        line("sizes of elements of known size (mm, feet, inches)", f"{max(sizes, default=0.0) * 1000.0:.2f} mm",
             "1 mm", len(sizes), max(sizes, default=1.0) < 0.001, least_n=min(len(SIZES_M), 5)),
        told("net volume against the file's own, median", f"{np.median(ratios):.4f}" if len(ratios) else "-",
             len(ratios)),
        told("the same within 2 %", _share(np.abs(ratios - 1.0) < 0.02), len(ratios)),
    ]  # fmt: skip
    for name, one in sorted(read.items(), key=lambda item: -float(str(item[1]["cpu_s"])))[:3]:
        lines.append(told(f"  {name[-48:]}", f"{one['cpu_s']} s CPU, {one['peak_mb']} MB", 1))
    return lines


def _share(good: np.ndarray) -> str:
    return f"{np.mean(good):.1%}" if len(good) else "-"


if __name__ == "__main__":
    sys.exit(main())
