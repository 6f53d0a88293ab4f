"""An .ifczip is read like the model in it, and one that is no model or a bomb is refused by what it is."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.read import archive
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import write_asbuilt
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on


@pytest.fixture
def model(tmp_path: Path) -> Path:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    return builder.write(tmp_path / "plain.ifc")


def _zipped(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in members.items():
            packed.writestr(name.replace("__dot__", "."), data)
    return path


def test_a_zipped_model_reads_like_itself_and_keeps_the_archives_digest(model: Path, tmp_path: Path) -> None:
    path = tmp_path / "Entwurf größer.ifczip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.write(model, "folder/modèle.IFC")
        packed.writestr("__MACOSX/folder/._modèle.IFC", b"resource fork")
        packed.writestr("folder/read me.txt", b"hello")
    zipped, plain = read_design(path), read_design(model)
    assert [e.global_id for e in zipped.elements] == [e.global_id for e in plain.elements]
    assert zipped.file_name == path.name and zipped.file_digest != plain.file_digest


def test_a_zipped_model_gets_a_plain_copy_with_the_result(model: Path, tmp_path: Path) -> None:
    path = _zipped(tmp_path / "model.ifczip", a__dot__ifc=model.read_bytes())
    design = read_design(path)
    target = tmp_path / "model.asbuilt.ifc"
    write_asbuilt(path, report_on(design, {"W": 0.5}), target)
    assert b"AsBuilt_Progress" in target.read_bytes()


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        ({}, "holds no .ifc"),
        ({"readme__dot__txt": b"x"}, "holds no .ifc .1 other"),
        ({"a__dot__ifcXML": b"<ifcXML/>"}, "ifcXML, which can't be read"),
        ({"a__dot__ifc": b"", "b__dot__txt": b""}, "is empty"),
        ({"a__dot__ifc": b"ISO-10303-21;", "b__dot__ifc": b"ISO-10303-21;"}, r"2 models \(a.ifc, b.ifc\)"),
        ({"xl/workbook__dot__xml": b"<workbook/>"}, "is an Excel workbook, .*save a plan as CSV"),
        ({"a__dot__ifc": b"PK\x03\x04"}, "archive within another"),
        ({"a__dot__ifc": b"ISO-10303-21;\nHEADER;\n"}, "cut short"),
    ],
)
def test_an_archive_without_one_whole_model_is_refused(
    members: dict[str, bytes], expected: str, tmp_path: Path
) -> None:
    with pytest.raises(DesignError, match=expected) as caught:
        read_design(_zipped(tmp_path / "bad.ifczip", **members))
    assert "bad.ifczip" in str(caught.value) and "model.ifc:" not in str(caught.value)


def test_an_encrypted_archive_asks_for_one_without_a_password(model: Path, tmp_path: Path) -> None:
    path = _zipped(tmp_path / "secret.ifczip", a__dot__ifc=model.read_bytes())
    data = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):  # the general purpose flags of both headers
        data[data.index(mark) + at] |= 1
    path.write_bytes(bytes(data))
    with pytest.raises(DesignError, match="encrypted; pack it without a password"):
        read_design(path)


def test_an_archive_with_a_wrong_byte_is_damaged(model: Path, tmp_path: Path) -> None:
    path = _zipped(tmp_path / "torn.ifczip", a__dot__ifc=model.read_bytes())
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(DesignError, match="the archive is damaged"):
        read_design(path)
    path.write_bytes(bytes(data[: len(data) // 2]))
    with pytest.raises(DesignError, match="the archive is damaged"):
        read_design(path)


def test_a_bomb_is_refused_by_its_ratio_and_by_its_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bomb = _zipped(tmp_path / "bomb.ifczip", a__dot__ifc=b"ISO-10303-21;" + b"\0" * 20_000_000)
    with pytest.raises(DesignError, match=r"grows \d+ times .limit 100"):
        read_design(bomb)
    monkeypatch.setattr(archive, "MAX_BYTES", 1000)
    large = _zipped(tmp_path / "large.ifczip", a__dot__ifc=b"ISO-10303-21;" + bytes(range(256)) * 8)
    with pytest.raises(DesignError, match="MB exceeds"):
        read_design(large)


def test_what_comes_out_is_counted_whatever_the_archive_declares(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _zipped(tmp_path / "liar.ifczip", a__dot__ifc=b"ISO-10303-21;" + bytes(range(256)) * 8)
    real = zipfile.ZipFile.infolist

    def small(self: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
        monkeypatch.setattr(archive, "MAX_BYTES", 1000)
        return real(self)

    monkeypatch.setattr(zipfile.ZipFile, "infolist", small)
    monkeypatch.setattr(archive, "_only_model", lambda path, members: members[0])
    with pytest.raises(DesignError, match="MB exceeds"):
        read_design(path)


def test_an_archive_whose_directory_points_before_its_beginning_is_refused(tmp_path: Path) -> None:
    path = _zipped(tmp_path / "bad.ifczip", a__dot__ifc=b"ISO-10303-21;" * 40)
    data = bytearray(path.read_bytes())
    end = data.rindex(b"PK\x05\x06")
    data[end + 16 : end + 20] = (len(data) * 2).to_bytes(4, "little")  # where the directory begins
    data[end + 12 : end + 16] = (len(data)).to_bytes(4, "little")  # and its length
    path.write_bytes(bytes(data))
    with pytest.raises(DesignError, match=r"bad\.ifczip: (can.t be unpacked|the archive is damaged)"):
        read_design(path)
