"""Whoever names a device or a pipe is told so: reading one may never end."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.camera.photo.read import read_photo
from asbuilt_bim.camera.rig_formats.text import read_document
from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.schedule.read import read_schedule
from asbuilt_bim.storage.strict_yaml import read_yaml
from asbuilt_bim.vision.masks.file import read_masks

READERS: dict[str, Callable[[Path], object]] = {
    "ifc": open_ifc,
    "photo": read_photo,
    "rig": read_document,
    "control points": read_control_points,
    "survey": lambda path: read_survey(path, 0.25, 0.002),
    "schedule": read_schedule,
    "masks": lambda path: read_masks(path, (160, 120)),
    "yaml": read_yaml,
    "result": read_result,
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("kind", READERS)
def test_a_device_and_a_pipe_are_refused_by_name_before_anything_is_read(kind: str, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (Path("/dev/zero"), pipe):
        with pytest.raises(AsBuiltError, match="it is a device or a pipe, no file") as caught:
            READERS[kind](path)
        assert str(path) in str(caught.value)


@pytest.mark.parametrize("kind", READERS)
def test_a_folder_is_named_as_one(kind: str, tmp_path: Path) -> None:
    with pytest.raises(AsBuiltError, match="is a folder; name the"):
        READERS[kind](tmp_path)


@pytest.mark.parametrize("kind", READERS)
def test_a_name_that_no_file_can_have_is_refused_in_words(kind: str) -> None:
    with pytest.raises(AsBuiltError, match=r"null (byte|character)"):
        READERS[kind](Path("a\0b"))


def test_a_file_that_another_program_holds_is_told_to_be_closed_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def held(path: Path, mode: str) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    (tmp_path / "plan.csv").write_text("name,start,finish\n", encoding="utf-8")
    monkeypatch.setattr(Path, "open", held)
    with pytest.raises(AsBuiltError, match=r"denied.; close it in other programs, or give yourself the right"):
        read_schedule(tmp_path / "plan.csv")
