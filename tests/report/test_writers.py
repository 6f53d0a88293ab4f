from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.errors import PluginError
from asbuilt_bim.report.writers import load_writers, run_writers, writers_of
from tests.example_package import example_package
from tests.report.sample_report import sample_report

__all__ = ["example_package"]


@pytest.mark.usefixtures("example_package")
def test_a_writer_of_another_package_writes_into_a_folder_of_its_own(tmp_path: Path) -> None:
    assert run_writers(load_writers(["example-markdown"]), sample_report(), tmp_path) == ()
    table = (tmp_path / "extra/example-markdown/storeys.md").read_text(encoding="utf-8")
    assert "| First floor | unknown |" in table
    again, missing = writers_of(tmp_path)
    assert ([one.name for one in again], missing) == (["example-markdown"], ())


@pytest.mark.usefixtures("example_package")
def test_a_writer_that_fails_loses_its_own_files_and_nothing_else(tmp_path: Path) -> None:
    (warning,) = run_writers(load_writers(["example-failing", "example-markdown"]), sample_report(), tmp_path)
    assert (
        "'example-failing' of asbuilt-bim-example 1.2.0 failed as a report writer (RuntimeError: the example fails"
        in warning
    )
    assert [p.name for p in (tmp_path / "extra").iterdir()] == ["example-markdown"]


@pytest.mark.usefixtures("example_package")
def test_a_broken_writer_is_refused_before_anything_is_measured() -> None:
    with pytest.raises(PluginError, match="example-broken"):
        load_writers(["example-markdown", "example-broken"])


def test_a_writer_that_was_uninstalled_since_is_named_and_left_out(tmp_path: Path) -> None:
    (tmp_path / "extra/example-markdown").mkdir(parents=True)
    found, (warning,) = writers_of(tmp_path)
    assert found == ()
    assert warning.startswith("extra/example-markdown is left out: no installed package offers")
