from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.errors import PluginError
from asbuilt_bim.storage.plugins import PluginGroup, find, installed
from tests.example_package import example_package, install_example

__all__ = ["example_package"]


@pytest.mark.usefixtures("example_package")
def test_a_plugin_is_found_by_its_name_and_told_by_its_package_and_version() -> None:
    found = find(PluginGroup.SEGMENTERS, "plugin:example-halves")
    assert found.identity == "asbuilt-bim-example 1.2.0: example-halves"
    assert type(found.made).__name__ == "Halves"
    assert find(PluginGroup.DEPTH_NETWORKS, "example-rows").package == "asbuilt-bim-example"


@pytest.mark.usefixtures("example_package")
def test_listing_plugins_imports_none_of_them() -> None:
    assert "example-broken" in installed(PluginGroup.REPORT_WRITERS)


@pytest.mark.usefixtures("example_package")
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("example-broken", r"asbuilt-bim-example 1\.2\.0.*can't be loaded \(ModuleNotFoundError.*mend or update"),
        ("example-idle", r"gives an object of type Idle, which has no method write\(\)"),
        ("example-markdwn", r"no installed package offers.*example-failing.*install its package"),
    ],
)
def test_a_broken_or_missing_plugin_is_named_and_refused(name: str, says: str) -> None:
    with pytest.raises(PluginError, match=says):
        find(PluginGroup.REPORT_WRITERS, name)


def test_a_name_that_two_packages_offer_is_refused(
    example_package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = install_example(tmp_path / "other")
    info = next(other.glob("*.dist-info"))
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: another-package\nVersion: 1.0\n")
    info.rename(other / "another_package-1.0.dist-info")
    monkeypatch.syspath_prepend(str(other))
    with pytest.raises(PluginError, match="another-package and asbuilt-bim-example; uninstall one"):
        find(PluginGroup.REPORT_WRITERS, "example-markdown")
