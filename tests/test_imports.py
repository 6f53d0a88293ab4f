"""Imports run one way, and third parties stay where DESIGN.md puts them."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import asbuilt_bim

PACKAGE = Path(asbuilt_bim.__file__).parent
RANK = {
    **dict.fromkeys(["codes", "version"], -1),
    "errors": 0,
    **dict.fromkeys(["storage", "geometry", "scale"], 1),
    **dict.fromkeys(["camera", "bim"], 2),
    **dict.fromkeys(["vision", "schedule"], 3),
    "measure": 4,
    "register": 5,
    "match": 6,
    "progress": 7,
    **dict.fromkeys(["report", "ifc", "project"], 8),
    "flow": 9,
    **dict.fromkeys(["api", "ifcpatch_recipes"], 10),
    "terminal": 11,
    "cli": 12,
    **dict.fromkeys(["__init__", "__main__"], 13),
}
"""Each part knows those below it; parts of one rank don't know each other."""
STRANGERS = [("vision", "bim"), ("measure", "bim"), ("measure", "schedule"), ("ifc", "camera"), ("ifc", "vision")]
PURE = ["geometry", "camera", "bim", "vision", "register", "match", "progress", "report"]
"""Parts that never ask for the time; measure takes its clock as an argument."""
CONFINED = {
    "ifcopenshell": ["ifc/"],
    "onnxruntime": ["vision/networks/runtime.py"],
    "shapely": ["geometry/polygon.py", "bim/exposure.py"],
    "xlsxwriter": ["report/workbook/"],
    "jinja2": ["report/page/"],
    "pyarrow": ["report/flat/parquet.py"],
    "jsonschema_rs": ["storage/schemas.py"],
    "click": ["cli.py", "terminal/"],
    "rich": ["terminal/"],
    "yaml": ["storage/", "camera/rig_formats/"],
    "simplejpeg": ["camera/photo/jpeg/decode.py"],
    "distributed": ["scale/cluster.py"],
    "pickle": ["scale/apart.py"],  # between two processes of one run; never a file
    "scipy": ["geometry/"],
    "cattrs": ["scale/codec.py", "report/result/", "storage/structure.py"],
}
DOORS = {
    "schedule": "schedule.read",
    "report.schedule": "report.schedule.write",
    "report.fill": "report.fill.write",
    "report.flat": "report.flat.write",
    "camera.photo.jpeg": "camera.photo.jpeg.damage",
    "ifc.write.colours": "ifc.write.colours",
}
"""Formats and details that the rest can be read without: each room is entered by one module."""
NEVER = {
    "trimesh",
    "matplotlib",
    "PIL",
    "pandas",
    "asbuilt_synthetic",
    "requests",
    "urllib",
    "socket",
}
ROOT = Path(__file__).parent.parent
HOUSES = [
    (ROOT, "asbuilt_bim"),
    (ROOT / "synthetic", "asbuilt_synthetic"),
    (ROOT / "training", "asbuilt_training"),
]


@cache
def modules() -> tuple[Path, ...]:
    return tuple(sorted(PACKAGE.rglob("*.py")))


@cache
def parsed(path: Path) -> tuple[tuple[ast.Import | ast.ImportFrom, ...], str | None]:
    """Every import anywhere in a file, and the file's docstring; parsing is what costs time."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return tuple(n for n in ast.walk(tree) if isinstance(n, (ast.Import, ast.ImportFrom))), ast.get_docstring(tree)


@cache
def imported(path: Path) -> tuple[str, ...]:
    """Every module that a file imports anywhere in it, type checking included."""
    names: list[str] = []
    for node in parsed(path)[0]:
        if isinstance(node, ast.Import):
            names += (alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: a relative import"
            names.append(node.module or "")
    return tuple(names)


def part(dotted: str) -> str:
    names = dotted.split(".")
    return names[1] if len(names) > 1 else ""


def import_graph(root: Path, package: str) -> dict[str, set[str]]:
    """Return module -> modules of its own package that it imports, wherever in the file."""
    files = {".".join(p.relative_to(root).with_suffix("").parts): p for p in (root / package).rglob("*.py")}
    graph: dict[str, set[str]] = {}
    for name, path in files.items():
        graph[name] = set()
        for node in parsed(path)[0]:
            if isinstance(node, ast.ImportFrom):
                both = {f"{node.module}.{alias.name}" for alias in node.names} | {str(node.module)}
                graph[name] |= (both & files.keys()) - {name}
    return graph


def own_part(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", modules(), ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_run_one_way(path: Path) -> None:
    here = own_part(path)
    known = {part(name) for name in imported(path) if name.split(".")[0] == "asbuilt_bim"} - {"", here}
    assert not known - RANK.keys(), f"{here} knows {known - RANK.keys()}, which have no rank"
    above = {other for other in known if RANK[other] >= RANK[here]}
    assert not above, f"{here} may not know {above}: they stand above it, or beside it"
    for one, other in STRANGERS:
        assert here != one or other not in known, f"{one} may not know {other}"


@pytest.mark.parametrize(("root", "package"), HOUSES, ids=[package for _, package in HOUSES])
def test_no_modules_import_one_another_in_a_circle_hidden_ones_counted(root: Path, package: str) -> None:
    graph = import_graph(root, package)
    sorter = graphlib.TopologicalSorter(graph)
    try:
        sorter.prepare()
    except graphlib.CycleError as circle:
        pytest.fail(f"a circle: {' -> '.join(circle.args[1])}")


@pytest.mark.parametrize("path", modules(), ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_no_import_is_for_type_checking_only(path: Path) -> None:
    assert "TYPE_CHECKING" not in path.read_text(encoding="utf-8"), "type the module above, or move what both need"


@pytest.mark.parametrize("path", modules(), ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_third_parties_stay_where_they_belong(path: Path) -> None:
    relative = path.relative_to(PACKAGE).as_posix()
    for name in imported(path):
        top = name.split(".")[0]
        assert top not in NEVER, f"{relative} imports {name}"
        homes = CONFINED.get(top)
        assert homes is None or any(relative.startswith(home) for home in homes), f"{relative} imports {name}"


@pytest.mark.parametrize(("room", "door"), DOORS.items())
def test_a_room_with_a_door_is_entered_by_it_alone(room: str, door: str) -> None:
    inside = (PACKAGE / room.replace(".", "/")).with_suffix("")
    outside = [path for path in modules() if not path.is_relative_to(inside) and path != inside.with_suffix(".py")]
    entered = {name for path in outside for name in imported(path) if f"{name}.".startswith(f"asbuilt_bim.{room}.")}
    assert entered == {f"asbuilt_bim.{door}"}


def test_every_part_of_the_house_has_a_rank() -> None:
    parts = {own_part(path) for path in modules()}
    assert parts == RANK.keys()


def test_no_file_reads_the_clock_or_rolls_dice_inside_the_flow() -> None:
    for path in modules():
        if own_part(path) in PURE:
            tops = {name.split(".")[0] for name in imported(path)}
            assert not tops & {"time", "random"}, path


def test_importing_the_package_is_light() -> None:
    code = (
        "import asbuilt_bim, sys; print(sorted({'cv2', 'numpy', 'ifcopenshell', 'rich', 'click'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_module_is_documented_and_exports_what_it_says() -> None:
    for path in modules():
        assert path.stat().st_size == 0 or parsed(path)[1], f"{path} has no docstring"
    for name in asbuilt_bim.__all__:
        assert getattr(asbuilt_bim, name) is not None, name
