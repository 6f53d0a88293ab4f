from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from asbuilt_bim.scale.fingerprint import MEASURING, READING, code_digest, program_digest
from tests.test_imports import PACKAGE, import_graph


def within(module: str, parts: tuple[str, ...]) -> bool:
    path = "/".join(module.split(".")[1:])
    return any(f"{path}.py" == name or f"{path}/".startswith(f"{name}/") for name in parts)


@pytest.mark.parametrize("parts", [MEASURING, READING], ids=["a measurement", "a design"])
def test_all_code_that_it_is_made_by_counts(parts: tuple[str, ...]) -> None:
    graph = import_graph(PACKAGE.parent, PACKAGE.name)
    seen = {module for module in graph if within(module, parts)}
    todo = list(seen)
    while todo:
        new = graph[todo.pop()] - seen
        seen |= new
        todo += new
    assert {module for module in seen if not within(module, parts)} <= {"asbuilt_bim", "asbuilt_bim.version"}


def moved(package: Path) -> None:
    (package / "measure/pair.py").rename(package / "measure/planes/pair.py")


def changed(package: Path) -> None:
    (package / "errors.py").write_text((package / "errors.py").read_text(encoding="utf-8") + "\n", encoding="utf-8")


def fitted_anew(package: Path) -> None:
    model = package / "measure/outline/ends.json"
    model.write_text(model.read_text(encoding="utf-8").replace("0.", "0.1", 1), encoding="utf-8")


def gone(package: Path) -> None:
    (package / "camera/rig.py").unlink()


@pytest.mark.parametrize("change", [moved, changed, fitted_anew, gone])
def test_a_file_moved_changed_or_gone_makes_every_kept_measurement_another_ones(
    change: Callable[[Path], None], tmp_path: Path
) -> None:
    package = tmp_path / "asbuilt_bim"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("*.onnx", "__pycache__"))
    before = code_digest(package)
    assert code_digest(package) == before
    change(package)
    assert code_digest(package) != before


def test_a_program_is_another_one_by_any_of_its_code_or_networks_and_the_same_in_a_wheel(tmp_path: Path) -> None:
    package = tmp_path / "asbuilt_bim"
    for name in ("cli.py", "report/page/write.py", "progress/states/pour.json", "models/depth.onnx"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text("0", encoding="utf-8")
        found = program_digest.__wrapped__(package)
        (package / name).write_text("1", encoding="utf-8")
        assert program_digest.__wrapped__(package) != found, name
    found = program_digest.__wrapped__(package)
    (package / "schemas").mkdir()
    (package / "schemas" / "result-1.json").write_text("{}", encoding="utf-8")
    assert program_digest.__wrapped__(package) == found


def test_a_clone_that_git_gave_other_line_ends_is_the_same_program(tmp_path: Path) -> None:
    package = tmp_path / "asbuilt_bim"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("*.onnx", "__pycache__"))
    before = code_digest(package), program_digest(package)
    for path in package.rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    program_digest.cache_clear()
    assert (code_digest(package), program_digest(package)) == before
