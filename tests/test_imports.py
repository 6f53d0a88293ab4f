"""Imports run one way, and third parties stay where DESIGN.md puts them."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import asbuilt_bim

PACKAGE = Path(asbuilt_bim.__file__).parent
LEVEL = {
    **dict.fromkeys(["errors", "version", "schemas_dir", "structure", "plugins"], 0),
    **dict.fromkeys(["durable", "regular_file", "strict_json", "strict_yaml", "yaml_words"], 0),
    "geometry": 1,
    "camera": 2,
    "bim": 2,
    "vision": 3,
    "measure": 4,
    "register": 5,
    "match": 6,
    "progress": 7,
    "report": 8,
}
BESIDE = {  # what stands beside the flow, and all that it may know of
    "scale": {"errors", "scale"},
    "schedule": {"errors", "regular_file", "bim", "schedule"},
    "ifc": {"errors", "version", "durable", "regular_file", "geometry", "bim", "progress", "ifc"},
    "project": {
        "errors",
        "regular_file",
        "strict_yaml",
        "structure",
        "plugins",
        "options",
        "instruments",
        "camera",
        "vision",
        "measure",
        "project",
    },
}
STRANGERS = [("camera", "bim"), ("bim", "camera"), ("vision", "bim"), ("measure", "bim"), ("vision", "match")]
CONFINED = {
    "ifcopenshell": ["ifc/"],
    "onnxruntime": ["vision/networks"],
    "shapely": ["geometry/polygon.py", "bim/exposure.py"],
    "xlsxwriter": ["report/"],
    "jinja2": ["report/"],
    "jsonschema": ["report/", "camera/rig_file.py"],
    "click": ["cli.py", "terminal/parameters.py"],
    "rich": ["terminal/"],
    "yaml": ["strict_yaml.py", "yaml_words.py", "camera/"],
    "distributed": ["scale/executor.py"],
    "cattrs": ["scale/codec.py", "report/"],
}
NEVER = {
    "scipy",
    "trimesh",
    "matplotlib",
    "PIL",
    "pandas",
    "asbuilt_synthetic",
    "pickle",
    "requests",
    "urllib",
    "socket",
}
ATTRIBUTES_OF_TIME = {"time", "random"}


def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py"))


def imported(path: Path) -> Iterator[str]:
    """Every module that a file imports anywhere in it, type checking included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            yield node.module or ""


def part(dotted: str) -> str:
    names = dotted.split(".")
    return names[1] if len(names) > 1 else ""


def own_part(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", modules(), ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_run_one_way(path: Path) -> None:
    here = own_part(path)
    known = {part(name) for name in imported(path) if name.split(".")[0] == "asbuilt_bim"} - {""}
    if here in BESIDE:
        assert known <= BESIDE[here], f"{here} may not know {known - BESIDE[here]}"
    if here in LEVEL:
        unranked = known - LEVEL.keys()
        assert not unranked, f"{here} stands inside the flow and may not know {unranked}"
        above = {other for other in known if LEVEL[other] > LEVEL[here]}
        assert not above, f"{here} may not know {above}: they stand above it"
    for one, other in STRANGERS:
        assert here != one or other not in known, f"{one} and {other} don't know each other"
    assert here == "cli" or "cli" not in known or path.name == "__main__.py"


@pytest.mark.parametrize("path", modules(), ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_third_parties_stay_where_they_belong(path: Path) -> None:
    relative = path.relative_to(PACKAGE).as_posix()
    for name in imported(path):
        top = name.split(".")[0]
        assert top not in NEVER, f"{relative} imports {name}"
        homes = CONFINED.get(top)
        assert homes is None or any(relative.startswith(home) for home in homes), f"{relative} imports {name}"


def test_the_rules_cover_the_whole_house() -> None:
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()}
    assert rooms - {"terminal", "output"} <= LEVEL.keys() | BESIDE.keys()


def test_no_file_reads_the_clock_or_rolls_dice_inside_the_flow() -> None:
    for path in modules():
        if own_part(path) in LEVEL and own_part(path) != "measure":  # measure takes its clock as an argument
            tops = {name.split(".")[0] for name in imported(path)}
            assert not tops & ATTRIBUTES_OF_TIME, path


def test_importing_the_package_is_light() -> None:
    code = (
        "import asbuilt_bim, sys; print(sorted({'cv2', 'numpy', 'ifcopenshell', 'rich', 'click'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_module_is_documented_and_exports_what_it_says() -> None:
    for path in modules():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assert path.stat().st_size == 0 or ast.get_docstring(tree), f"{path} has no docstring"
    for name in asbuilt_bim.__all__:
        assert getattr(asbuilt_bim, name) is not None, name
