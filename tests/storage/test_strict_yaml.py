from __future__ import annotations

import time
from pathlib import Path

import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.storage.strict_yaml import MAX_BYTES, parse_yaml, read_yaml


def written(tmp_path: Path, data: str | bytes) -> Path:
    path = tmp_path / "project.yaml"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def test_plain_values_and_the_line_of_each_key_are_read(tmp_path: Path) -> None:
    document = read_yaml(written(tmp_path, "name: Süd\nvisits:\n  - date: 2026-03-02\n    stations: [{name: A}]\n"))
    assert document.value["name"] == "Süd"  # type: ignore[index]
    assert document.lines["visits[0].date"] == 3
    assert document.lines["visits[0].stations[0].name"] == 4


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: 2\na: 3\n", "line 3: the key 'a' stands twice (first in line 1)"),
        ("a:\n  b: 1\n  b: 2\n", "line 3: the key 'b' stands twice"),
        (
            "a: !!python/object/apply:os.system ['true']\n",
            "line 1: the tag !!python/object/apply:os.system isn't allowed",
        ),
        ("a: !mine 3\n", "the tag !mine isn't allowed"),
        ("a: &x [1]\nb: *x\n", "line 2: aliases"),
        ("a: [1, 2\n", "line 2"),
        ("? [1, 2]\n: 3\n", "a key must be plain text"),
        ("", "is empty"),
        ("a: 1\n---\nb: 2\n", "line 2"),
        ("[" * 20000, "nested too deep"),
    ],
)
def test_what_is_no_plain_yaml_is_refused_by_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ProjectError) as caught:
        read_yaml(written(tmp_path, text))
    assert says in str(caught.value)
    assert "project.yaml" in str(caught.value)


def test_an_alias_bomb_is_refused_at_once(tmp_path: Path) -> None:
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
    with pytest.raises(ProjectError, match="aliases"):
        read_yaml(written(tmp_path, "\n".join(rows)))


def test_a_list_longer_than_any_of_a_project_is_refused_before_it_is_read_on(tmp_path: Path) -> None:
    text = f"name: Site\nhistory: [{', '.join(['a'] * 266_000)}]"
    assert len(text) < MAX_BYTES
    begun = time.process_time()
    with pytest.raises(ProjectError, match="line 2: more than 100,000 values"):
        read_yaml(written(tmp_path, text))
    assert time.process_time() - begun < 20.0


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"PK\x03\x04rest", "is a workbook or a zip archive, no YAML file; name the .yaml file"),
        (b"a: 1\nname: S\xfcd\n", "line 2 is no UTF-8 text; save it as UTF-8: in Excel as CSV UTF-8, in Notepad"),
        (b"a: 1\nb: \x00\n", r"line 2: holds a character that no text has \(U\+0000\)"),
        (b"# " + b"x" * MAX_BYTES, "larger than"),
    ],
)
def test_what_is_no_text_file_of_a_project_is_refused(tmp_path: Path, data: bytes, says: str) -> None:
    with pytest.raises(ProjectError, match=says):
        read_yaml(written(tmp_path, data))


def test_a_file_saved_by_an_old_editor_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    assert read_yaml(written(tmp_path, b"\xef\xbb\xbfa: 1\n")).value == {"a": 1}
    assert read_yaml(written(tmp_path, "a: ü\n".encode("utf-16"))).value == {"a": "ü"}


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(ProjectError, match="no such file"):
        read_yaml(tmp_path / "none.yaml")
    with pytest.raises(ProjectError, match="is a folder"):
        read_yaml(tmp_path)


def test_a_file_whose_ending_windows_hides_is_named(tmp_path: Path) -> None:
    (tmp_path / "project.yaml.txt").write_text("a: 1\n", encoding="utf-8")
    with pytest.raises(ProjectError, match=r"no such file \(project\.yaml\.txt lies there, .* take the \.txt away\)"):
        read_yaml(tmp_path / "project.yaml")
    (tmp_path / "project.yaml.txt").rename(tmp_path / "projekt.yaml")
    with pytest.raises(ProjectError, match=r"no such file \(projekt\.yaml lies there: is it that\?\)"):
        read_yaml(tmp_path / "project.yaml")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: 2\n c: 3\n", r"line 3 \(c: 3\): mapping values are not allowed here; check how it is indented"),
        ("name: Site: north\n", r"line 1 \(name: Site: north\): .* colons, quotes and brackets"),
        (
            "v:\n  - s:\n      - n: 1\n     - n: 2\n",
            r"line 4 \(- n: 2\): .*in what begins in line 2; check how it is in",
        ),
        (
            "a:\n\tb: 2\n",
            r"line 2 \(b: 2\): found character '\\t'.*; a tab stands at the beginning of line 2: put blanks",
        ),
        ("a: 1\nifc:\u00a0x.ifc\nb: 2\n", "line 3 .*; a no-break space stands in line 2: type a blank in its place"),
        ("a: 1\nname:Site\nb: 2\n", "line 3 .*; put a blank behind the colon in line 2"),
        ("a: [1, 2\nb: 3\n", r"line 2 \(b: 3\): expected ',' or ']', but got ':', in what begins in line 1"),
        ('a: "x\nb: 3\n', "line 3: found unexpected end of stream, in what begins in line 1"),
        ("a: 1\nb 2\nc: 3\n", "could not find expected ':', in what begins in line 2"),
        ("a: @x\n", r"line 1 \(a: @x\): found character '@' that cannot start"),
        (
            'a: "C:\\photos"\n',
            r"line 1 \(a: .C:.photos.\): found unknown escape character 'p'.*; in quotation .* write / for",
        ),
        ("a: 1\n---\nb: 2\n", r"line 2 \(---\): .*another document"),
        ("x: 1\ndate: 2026-02-30\n", "line 2: 2026-02-30 is no day of the calendar"),
        ("date: 2026-03-02 25:00:00\n", "line 1: .* is no day of the calendar"),
    ],
)
def test_a_slip_of_the_pen_is_named_by_its_line_and_what_stands_there(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ProjectError, match=says):
        parse_yaml(text, tmp_path / "project.yaml")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: 010\n", "line 2: 010 is another number to YAML; write it plainly, or in quotes as text"),
        ("a: 12:30\n", "line 1: 12:30 is another number to YAML"),
        ("a: -1:30.5\n", "line 1: -1:30.5 is another number to YAML"),
        ("a: 1\nb: !!bool maybe\n", "line 2: maybe is no true or false"),
        ("a: !!int ''\n", "line 1: an empty value is no whole number"),
        ("a: !!float ''\n", "line 1: an empty value is no number"),
        ("a: !!timestamp x\n", "line 1: x is no day of the calendar"),
        ("a: 2026-02-30\n", "line 1: 2026-02-30 is no day of the calendar"),
        ("a: 1\n<<: {b: 1}\n", "line 2: merging (<<) isn't read here: write the keys out"),
        ('a: "G\\ud800"\n', "line 1: holds half a character"),
        ('"G\\ud800": 1\n', "line 1: holds half a character"),
        ("ISO-10303-21;\nHEADER;\n", "is an IFC file"),
    ],
)
def test_what_yaml_itself_stumbles_over_is_refused_by_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ProjectError) as caught:
        read_yaml(written(tmp_path, text))
    assert says in str(caught.value)
