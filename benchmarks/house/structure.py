"""How the house is built: modules and folders at the top, files in a folder, circles of imports, lines.

python benchmarks/house/structure.py --check                 this checkout
python benchmarks/house/structure.py --root OTHER_CHECKOUT   another one, of any age

Files are Python files (*.py). An import counts wherever it stands: inside a function and under TYPE_CHECKING, too.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project
from benchmarks.sites import ROOT
from benchmarks.table import Line, line, options, report, told

PACKAGE = "asbuilt_bim"
MOST_MODULES, MOST_FOLDERS, MOST_FILES = 8, 18, 25
SMALL_LINES = 80
WORDING = f"{PACKAGE}.report.wording"
Graph = dict[str, set[str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Module:
    """One file: its dotted name, its folder under the package, its lines and those of each of its functions."""

    name: str
    folder: str
    lines: int
    function_lines: tuple[int, ...]
    tree: ast.Module


def modules_of(package: Path) -> list[Module]:
    """Read every file of a package."""
    found = []
    for path in sorted(package.rglob("*.py")):
        inside = path.relative_to(package)
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        parts = [package.name, *inside.with_suffix("").parts]
        found.append(
            Module(
                name=".".join(parts[:-1] if parts[-1] == "__init__" else parts),
                folder=inside.parent.as_posix(),
                lines=text.count("\n"),
                function_lines=tuple((node.end_lineno or node.lineno) - node.lineno + 1 for node in functions),
                tree=tree,
            )
        )
    return found


def imports_of(module: Module, names: set[str]) -> Iterator[str]:
    """Give every module of the package that a file imports anywhere in it."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                if inner in names or node.module in names:
                    yield inner if inner in names else node.module


def graph_of(modules: list[Module]) -> Graph:
    """Return what each module imports."""
    names = {module.name for module in modules}
    return {module.name: set(imports_of(module, names)) - {module.name} for module in modules}


def circles(graph: Graph) -> list[list[str]]:
    """Return the sets of modules that import each other in a circle (Tarjan 1972)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in sorted(graph[name]):
            if other not in order:
                visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == order[name]:
            start = stack.index(name)
            found.append(sorted(stack[start:]))
            del stack[start:]

    for name in sorted(graph):
        if name not in order:
            visit(name)
    return [circle for circle in found if len(circle) > 1]


def small_with_one_importer(modules: list[Module], graph: Graph) -> list[str]:
    """Return the small modules that only one other module imports: they may merge into it."""
    importers = Counter(other for others in graph.values() for other in others)
    return [one.name for one in modules if one.lines < SMALL_LINES and importers[one.name] == 1]


def _holds_anything(folder: Path) -> bool:
    """Say whether a folder holds more than what Python left of modules that are gone."""
    return any(path.is_file() and "__pycache__" not in path.parts for path in folder.rglob("*"))


def spread(what: str, lines: list[int]) -> Line:
    """Tell the median and the 95th percentile of lines."""
    return told(what, f"{np.median(lines):.0f}, {np.percentile(lines, 95):.0f}", len(lines))


def judged(package: Path) -> tuple[list[Line], dict[str, list[str]]]:
    """Measure a package; return the table, and the names behind its figures."""
    modules = modules_of(package)
    graph = graph_of(modules)
    top = sorted(path.name for path in package.glob("*.py"))
    folders = sorted(path.name for path in package.iterdir() if path.is_dir() and _holds_anything(path))
    files = Counter(module.folder for module in modules)
    fullest, most = files.most_common(1)[0]
    round_about, small = circles(graph), small_with_one_importer(modules, graph)
    worded = sum(module.lines for module in modules if f"{module.name}.".startswith(f"{WORDING}."))
    whole, n = sum(module.lines for module in modules), len(modules)
    functions = [count for module in modules for count in module.function_lines]
    table = [
        line("modules at the top", str(len(top)), f"<= {MOST_MODULES}", n, len(top) <= MOST_MODULES),
        line("folders at the top", str(len(folders)), f"<= {MOST_FOLDERS}", n, len(folders) <= MOST_FOLDERS),
        line(f"files in the fullest folder ({fullest})", str(most), f"<= {MOST_FILES}", n, most <= MOST_FILES),
        line("circles of imports, hidden ones too", str(len(round_about)), "0", n, not round_about),
        told("  modules in them", str(sum(len(circle) for circle in round_about)), n),
        told(f"modules under {SMALL_LINES} lines with one importer", str(len(small)), n),
        told("lines", str(whole), n),
        told("  without wording", str(whole - worded), n),
        spread("lines of a file: median, 95th percentile", [module.lines for module in modules]),
        spread("lines of a function: median, 95th percentile", functions),
    ]
    return table, {
        "top": top,
        "folders": folders,
        "crowded": [f"{folder}: {count}" for folder, count in files.most_common() if count > MOST_FILES],
        "circles": [", ".join(circle) for circle in round_about],
        "small_with_one_importer": small,
    }


def main() -> int:
    """Measure and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--root", type=Path, default=ROOT, help="the checkout to measure")
    args = parser.parse_args()
    table, names = judged(args.root / PACKAGE)
    for circle in names["circles"]:
        print(f"  circle: {circle}")
    return report(f"The house, {args.root.resolve()}", table, args, dict(names))


if __name__ == "__main__":
    sys.exit(main())
