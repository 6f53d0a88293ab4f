from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from asbuilt_bim.durable import replace_all, replace_bytes


def test_files_are_replaced_together_and_nothing_is_left_beside(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    one.write_bytes(b"old")
    replace_all({one: b"new", other: b"more"})
    assert (one.read_bytes(), other.read_bytes()) == (b"new", b"more")
    assert sorted(tmp_path.iterdir()) == [one, other]


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
