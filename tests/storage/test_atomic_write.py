from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import pytest

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output.measurement import check_place
from asbuilt_bim.storage.atomic_write import place_problem, replace_all, replace_bytes


def test_files_are_replaced_together_and_nothing_is_left_beside(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    one.write_bytes(b"old")
    replace_all({one: b"new", other: b"more"})
    assert (one.read_bytes(), other.read_bytes()) == (b"new", b"more")
    assert sorted(tmp_path.iterdir()) == [one, other]


@pytest.mark.skipif(os.name == "nt", reason="no umask there")
@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_file_has_the_rights_that_the_umask_leaves(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        replace_bytes(tmp_path / "one", b"new")
    finally:
        os.umask(before)
    assert (tmp_path / "one").stat().st_mode & 0o777 == mode


def test_a_disk_that_fills_up_at_the_second_file_leaves_the_first_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []

    def full(handle: int) -> None:
        calls.append(handle)
        if len(calls) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")

    one, other = tmp_path / "one", tmp_path / "other"
    one.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        replace_all({one: b"new", other: b"more"})
    assert one.read_bytes() == b"old" and list(tmp_path.iterdir()) == [one]


def test_a_place_without_the_right_to_write_is_told_before_anything_is_made_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert place_problem(tmp_path / "new.yaml") == ""
    check_place(tmp_path / "none" / "yet")
    assert list(tmp_path.iterdir()) == []

    def refuse(dir: Path) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(dir / "tmp0123"))

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    told = f"{tmp_path / 'new.yaml'}: can't be written (Read-only file system); name another place"
    assert place_problem(tmp_path / "new.yaml") == told
    assert place_problem(tmp_path / "none" / "new.ifc", folder=False).endswith(
        "(Read-only file system); name another place"
    )
    with pytest.raises(OutputError, match=r"yet: can't be written \(Read-only file system\)"):
        check_place(tmp_path / "none" / "yet")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name here")
def test_what_is_no_file_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for place in (tmp_path / "folder", pipe):
        with pytest.raises(OSError, match=r"directory|ordinary"):
            replace_all({tmp_path / "good": b"", place: b""})
        with pytest.raises(OSError, match=r"directory|ordinary"):
            replace_bytes(place, b"")
    assert not (tmp_path / "good").exists() and pipe.is_fifo()
