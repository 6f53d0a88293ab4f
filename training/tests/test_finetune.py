"""A user's labels are read with care, and the shipped segmenter learns from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

torch = pytest.importorskip("torch")

from asbuilt_bim.errors import MaskError  # noqa: E402

from asbuilt_training.__main__ import main  # noqa: E402
from asbuilt_training.export import CLASSES, write_segmenter  # noqa: E402
from asbuilt_training.finetune import split  # noqa: E402
from asbuilt_training.folded import Segmenter, folded, read_segmenter  # noqa: E402
from asbuilt_training.model import ConcreteNet  # noqa: E402
from asbuilt_training.own_labels import read_labels  # noqa: E402


def _document() -> dict[str, Any]:
    return {
        "images": [{"id": 4, "file_name": "visits/a.png", "width": 160, "height": 120}],
        "categories": [{"id": 1, "name": "Wall"}, {"id": 2, "name": "column"}, {"id": 7, "name": "formwork"}],
        "annotations": [
            {"image_id": 4, "category_id": 1, "segmentation": [[10.0, 20.0, 60.0, 20.0, 60.0, 100.0, 10.0, 100.0]]},
            {"image_id": 4, "category_id": 7, "segmentation": [[100.0, 20.0, 120.0, 20.0, 120.0, 60.0]]},
        ],
    }


def _written(folder: Path, document: Any) -> Path:
    (folder / "visits").mkdir(exist_ok=True)
    picture = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    cv2.imwrite(str(folder / "visits" / "a.png"), picture)
    (folder / "labels.json").write_text(json.dumps(document), encoding="utf-8")
    return folder / "labels.json"


def test_labels_become_classes_and_things_where_they_were_drawn(tmp_path: Path) -> None:
    labels = read_labels(_written(tmp_path, _document()), tmp_path)
    assert labels.classes == ((1, "Wall", "wall"), (2, "column", "column"), (3, "formwork", "other"))
    kind = labels.pictures[0].kind
    assert np.count_nonzero(kind == 1) == pytest.approx(50 * 80, rel=0.05)
    assert kind[60, 30] == 1 and kind[30, 110] == 3 and kind[60, 30] and labels.pictures[0].instance[60, 30] == 1
    assert labels.pictures[0].instance[30, 110] == 0


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda d: d["images"][0].update(file_name="../../etc/passwd"), "leaves the folder"),
        (lambda d: d["images"][0].update(width=999), "labels are of another photo"),
        (lambda d: d["categories"].clear(), "none is named wall"),
        (lambda d: d["annotations"][0].update(category_id=[1]), "none of the file's categories"),
        (lambda d: d["annotations"][0].update(segmentation={"counts": "aa", "size": [1, 1]}), "export polygons"),
        (lambda d: d["annotations"][0].update(segmentation=[[0, 0, 1, float("nan"), 5, 5]]), "NaN is not a number"),
        (lambda d: d.update(annotations=[]), "nothing to learn"),
        (lambda d: d.update(images="many"), "must be a list"),
    ],
)
def test_damaged_labels_are_refused_by_name(tmp_path: Path, change: Any, what: str) -> None:
    document = _document()
    change(document)
    with pytest.raises(MaskError, match=what):
        read_labels(_written(tmp_path, document), tmp_path)


def test_deeply_nested_and_empty_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "labels.json"
    for text in ("", "[" * 100_000, "[]"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(MaskError):
            read_labels(path, tmp_path)


def test_every_fifth_photo_is_kept_back(tmp_path: Path) -> None:
    one = read_labels(_written(tmp_path, _document()), tmp_path).pictures[0]
    learned, judged = split((one,) * 11)
    assert (len(learned), len(judged)) == (9, 2)
    assert [len(part) for part in split((one,) * 4)] == [4, 4]


def test_two_steps_give_a_network_of_the_users_classes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    torch.manual_seed(0)
    net = ConcreteNet()
    for module in net.modules():
        if isinstance(module, torch.nn.BatchNorm2d):  # the exporter writes tensors that are equal only once
            module.running_mean.uniform_(-0.2, 0.2)
    write_segmenter(Segmenter(folded(net.eval())), tmp_path, "concrete", CLASSES)
    labels, out = _written(tmp_path, _document()), tmp_path / "out"
    given = ["finetune", "--labels", str(labels), "--photos", str(tmp_path), "--out", str(out), "--steps", "2"]
    assert main([*given, "--start", str(tmp_path / "concrete.onnx")]) == 0
    assert read_segmenter(out / "own.onnx").logits.out.out_channels == 4
    assert "formwork" in (out / "own.yaml").read_text(encoding="utf-8")
    assert main([*given, "--start", str(tmp_path / "concrete.onnx")]) == 1
    assert "there already" in capsys.readouterr().err
