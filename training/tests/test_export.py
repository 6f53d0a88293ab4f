"""What is exported answers as the trained network does, is read by the package, and can be learned on again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import onnx  # noqa: E402
from asbuilt_bim.vision.networks.kinds import NetworkDepth, load  # noqa: E402
from onnx import numpy_helper  # noqa: E402

from asbuilt_training.export import CLASSES, write_depth, write_segmenter  # noqa: E402
from asbuilt_training.folded import RelativeDepth, Segmenter, folded, read_segmenter, rounded  # noqa: E402
from asbuilt_training.half_size import store_in_half  # noqa: E402
from asbuilt_training.model import ConcreteNet  # noqa: E402
from asbuilt_training.model_card import model_card  # noqa: E402


def _net() -> ConcreteNet:
    """Return a network whose batch norms are no identities."""
    torch.manual_seed(0)
    net = ConcreteNet()
    for module in net.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.uniform_(-0.2, 0.2)
            module.running_var.uniform_(0.7, 1.4)
    return net.eval()


def test_folding_changes_no_answer() -> None:
    net = _net()
    image, geometry = torch.randn(1, 3, 64, 96), torch.randn(1, 5, 64, 96)
    with torch.no_grad():
        for one, other in zip(net(image, geometry), folded(net)(image, geometry), strict=True):
            assert torch.allclose(one, other, atol=1e-3)


def test_both_files_are_written_small_and_come_back(tmp_path: Path) -> None:
    whole = folded(_net())
    write_segmenter(Segmenter(whole), tmp_path, "concrete", CLASSES)  # checks the answers itself
    write_depth(RelativeDepth(whole), tmp_path)
    weights = sum(parameter.numel() for parameter in Segmenter(whole).parameters())
    assert (tmp_path / "concrete.onnx").stat().st_size < 2.5 * weights  # 16 bits a weight, and the graph
    again = read_segmenter(tmp_path / "concrete.onnx").eval()
    image, geometry = torch.randn(1, 3, 64, 96), torch.randn(1, 5, 64, 96)
    with torch.no_grad():
        for one, other in zip(again(image, geometry), rounded(Segmenter(whole))(image, geometry), strict=True):
            assert torch.equal(one, other)
    with pytest.raises(ValueError, match="another network"):
        read_segmenter(tmp_path / "depth.onnx")


def test_weights_that_16_bits_cannot_hold_are_not_stored_in_them(tmp_path: Path) -> None:
    whole = folded(_net())
    write_segmenter(Segmenter(whole), tmp_path, "concrete", CLASSES)
    model = onnx.load(tmp_path / "concrete.onnx")
    wide = next(one for one in model.graph.initializer if one.name == "logits.out.weight")
    wide.CopyFrom(numpy_helper.from_array(np.full(numpy_helper.to_array(wide).shape, 0.1, np.float32), wide.name))
    onnx.save(model, tmp_path / "wide.onnx")
    with pytest.raises(ValueError, match=r"logits.out.weight holds numbers that 16 bits can't"):
        store_in_half(tmp_path / "wide.onnx")


def test_the_package_reads_the_cards(tmp_path: Path) -> None:
    whole = folded(_net())
    write_segmenter(Segmenter(whole), tmp_path, "concrete", CLASSES)
    write_depth(RelativeDepth(whole), tmp_path)
    assert load(tmp_path / "concrete.yaml", "segment").card.layout == "centres"
    photo = np.full((480, 640, 3), 128, dtype=np.uint8)
    depth = NetworkDepth(loaded=load(tmp_path / "depth.yaml", "depth")).estimate(photo)
    assert depth.shape == (480, 640) and np.isfinite(depth).all()


def test_the_model_card_says_what_the_record_says() -> None:
    iou = {name: 0.5 for name in ("wall", "column", "slab or beam", "formwork", "other")}
    learned = {"pictures": 12, "sources": {"yards": 12}}
    one = {"pictures": 30, "iou": iou, "concrete_iou": 0.81, "abs_rel": 0.07, "delta": 0.96}
    figures = {"with geometry": one, "without geometry": one, "learned_from": learned}
    plan = {"rate": 0.002, "decay": 0.02, "seed": 5}
    text = model_card(plan=plan, figures=figures, curves=[{"minutes": "75.1", "step": "6000"}], parameters=2_800_000)
    assert "12 (12 by yards)" in text and "0.810" in text and "96.0 %" in text and "$" not in text
    assert np.all([word in text for word in ("Apache-2.0", "6000 steps", "Limits")])
