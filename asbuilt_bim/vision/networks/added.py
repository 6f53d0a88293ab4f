"""The card of a published network, made from its preset and the user's own ONNX file."""

from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.storage.strict_yaml import yaml_text
from asbuilt_bim.vision.networks.card import NetworkCard
from asbuilt_bim.vision.networks.onnx_file import check_onnx_file
from asbuilt_bim.vision.networks.presets import Preset
from asbuilt_bim.vision.networks.runtime import new_session

HEADER = "# yaml-language-server: $schema=https://asbuilt-bim.org/schemas/network-1.json\n"
_SIDES = 16, 4096


def card_text(card: NetworkCard) -> str:
    """Return a card as YAML, without what has its usual value."""
    plain: dict[str, object] = {
        "format": card.format, "version": card.version, "name": card.name, "file": card.file, "layout": card.layout,
        "input": {
            "width_px": card.input.width_px, "height_px": card.input.height_px, "divide": card.input.divide,
            "mean": list(card.input.mean), "std": list(card.input.std),
        },
        "outputs": dict(card.outputs), "licence": card.licence, "source": card.source,
    }  # fmt: skip
    if card.classes:
        plain["classes"] = [
            {"id": one.id, "name": one.name, "label": one.label, **({"blur": True} if one.blur else {})}
            for one in card.classes
        ]
    return HEADER + yaml_text(plain)


def card_of_file(preset: Preset, path: Path) -> NetworkCard:
    """Return the card of a file, its input's size taken from the file where the file says it.

    Raises:
        NetworkError: it is no ONNX file, or hasn't the inputs and outputs that this network is published with.
    """
    check_onnx_file(path)
    try:
        session = new_session(path)
    except Exception as problem:  # onnxruntime raises a dozen types of its own
        raise NetworkError(f"network {path}: can't be loaded: {' '.join(str(problem).split())[:200]}") from problem
    inputs = {one.name: list(one.shape) for one in session.get_inputs()}
    outputs = [one.name for one in session.get_outputs()]
    _refuse(preset, path, inputs, outputs)
    shape = inputs[preset.inputs[0]]
    if len(shape) != 4 or (isinstance(shape[1], int) and shape[1] != 3):
        raise NetworkError(
            f"network {path}: input {preset.inputs[0]} has the shape {shape}, {preset.title} takes (1, 3, h, w)"
        )
    width, height = (
        side if isinstance(side, int) else usual
        for side, usual in zip((shape[3], shape[2]), preset.size_px, strict=True)
    )
    if not all(_SIDES[0] <= side <= _SIDES[1] for side in (width, height)):
        raise NetworkError(f"network {path}: input of {width} x {height} px, limit {_SIDES[0]} to {_SIDES[1]}")
    return preset.card(path.name, (width, height))


def _refuse(preset: Preset, path: Path, inputs: dict[str, list[object]], outputs: Sequence[str]) -> None:
    for what, wanted, there in (
        ("input", preset.inputs, list(inputs)),
        ("output", tuple(preset.outputs.values()), outputs),
    ):
        missing = [name for name in wanted if name not in there]
        if missing or (what == "input" and len(there) != len(wanted)):
            raise NetworkError(
                f"network {path}: {preset.title} has the {what}s {', '.join(wanted)}, this file has "
                f"{', '.join(there)[:200]}; take another export of it, or write its card by hand (docs/networks.md)"
            )
