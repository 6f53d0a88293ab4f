"""One loaded network: arrays in, checked arrays out, within a bound of memory."""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.card import ROLES, NetworkCard
from asbuilt_bim.vision.networks.geometry_input import CHANNELS
from asbuilt_bim.vision.networks.onnx_file import check_onnx_file
from asbuilt_bim.vision.networks.runtime import new_session, onnxruntime

MAX_MEMORY_BYTES = 2_000_000_000
"""What all networks of a process may take together; two stations at a time fit an ordinary office computer."""
MAX_OUTPUT_VALUES = 200_000_000
RUN_S = 40.0
"""Processor time for one picture: ten times what a large network takes."""
LATE_S = 8.0 * RUN_S
"""The same on the clock, where other work may hold it up."""
_KINDS: dict[str, type[np.generic]] = {
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(uint8)": np.uint8,
}
_NUMBERS = {"tensor(float)", "tensor(float16)", "tensor(double)", "tensor(int64)", "tensor(int32)", "tensor(uint8)",
            "tensor(bool)"}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """A network ready to run on this process's processor, one thread."""

    path: Path
    name: str
    session: onnxruntime.InferenceSession
    inputs: tuple[str, ...]
    kinds: tuple[type[np.generic], ...]
    outputs: Mapping[str, str]  # role -> the output's name

    def run(self, pictures: tuple[NDArray[np.float32], ...]) -> dict[str, NDArray[np.float64]]:
        """Run on one array an input; return the outputs by role, finite, as float64.

        Raises:
            NetworkError: it failed, took too much memory, or answered with NaN or too much.
        """
        feeds = {name: p.astype(kind) for name, p, kind in zip(self.inputs, pictures, self.kinds, strict=True)}
        options = onnxruntime.RunOptions()
        end = threading.Timer(LATE_S, setattr, (options, "terminate", True))  # of a loop that the picture sets
        end.daemon = True
        end.start()
        try:
            answers = self.session.run(list(self.outputs.values()), feeds, options)
        except Exception as problem:  # onnxruntime raises a dozen types of its own
            late = f"took more than {LATE_S:.0f} s for one picture; export it without loops"
            raise NetworkError(f"network {self.path}: {late if options.terminate else _reason(problem)}") from problem
        finally:
            end.cancel()
        checked: dict[str, NDArray[np.float64]] = {}
        for role, answer in zip(self.outputs, answers, strict=True):
            array = np.asarray(answer)
            if array.size > MAX_OUTPUT_VALUES:
                raise NetworkError(
                    f"network {self.path}: output {role} has {array.size} values, limit {MAX_OUTPUT_VALUES}"
                )
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise NetworkError(
                    f"network {self.path}: output {role} holds NaN or infinity; export it again, in float32"
                )
            checked[role] = array.astype(np.float64)
        return checked


def open_network(card: NetworkCard, path: Path) -> Network:
    """Load a card's ONNX file and check that it fits the card.

    Raises:
        NetworkError: the file is damaged or hostile, or inputs and outputs aren't those of the card.
    """
    check_onnx_file(path)
    bounded = _bound_memory()
    try:
        session = new_session(path, env_allocators=bounded)
    except Exception as problem:  # see above
        raise NetworkError(f"network {path}: {_reason(problem)}") from problem
    wanted = 2 if card.task == "stereo" or card.geometry is not None else 1
    given = session.get_inputs()
    if len(given) != wanted:
        raise NetworkError(f"network {path}: has {len(given)} inputs, its card wants {wanted}")
    if card.geometry is not None:
        given = _geometry_last(path, given, card.geometry.input)
    for one in given:
        channels = CHANNELS if card.geometry is not None and one is given[-1] else 3
        _check_input(path, one.name, one.type, list(one.shape), card, channels)
    return Network(
        path=path, name=card.name, session=session, inputs=tuple(one.name for one in given),
        kinds=tuple(_KINDS[one.type] for one in given), outputs=_outputs(path, session, card),
    )  # fmt: skip


def _geometry_last(path: Path, given: list[onnxruntime.NodeArg], name: str) -> list[onnxruntime.NodeArg]:
    """Return a network's inputs, the one of this name the last."""
    names = [one.name for one in given]
    if name not in names:
        raise NetworkError(
            f"network {path}: has no input {name} for geometry, it has {', '.join(names)}; correct the card"
        )
    return sorted(given, key=lambda one: one.name == name)


def _check_input(
    path: Path, name: str, kind: str, shape: list[int | str | None], card: NetworkCard, channels: int
) -> None:
    if kind not in _KINDS:
        raise NetworkError(f"network {path}: input {name} takes {kind}, not one of {', '.join(_KINDS)}")
    given = card.input
    if kind == "tensor(uint8)" and (given.divide, *given.mean, *given.std) != (1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0):
        raise NetworkError(
            f"network {path}: input {name} takes whole numbers from 0 to 255, and the card makes others of the photo; "
            "set input.divide: 1 in the card, and leave out mean and std"
        )
    w, h = card.input.width_px, card.input.height_px
    asked = {"nchw": (1, channels, h, w), "nhwc": (1, h, w, 3), "chw": (3, h, w)}[card.input.order]
    fits = len(shape) == len(asked) and all(not isinstance(s, int) or s == a for s, a in zip(shape, asked, strict=True))
    if not fits:
        raise NetworkError(
            f"network {path}: input {name} has shape {shape}, the card says {list(asked)}; correct the card"
        )


def _outputs(path: Path, session: onnxruntime.InferenceSession, card: NetworkCard) -> dict[str, str]:
    there = {one.name: one.type for one in session.get_outputs()}
    roles = ROLES[card.layout]
    if card.outputs:
        chosen = {role: card.outputs[role] for role in roles}
    elif set(roles) <= there.keys():
        chosen = {role: role for role in roles}
    else:
        chosen = dict(zip(roles, there, strict=False))
    if missing := [name for name in chosen.values() if name not in there]:
        raise NetworkError(
            f"network {path}: the card names the outputs {', '.join(missing)}, the file has {', '.join(there)}; "
            "correct outputs in the card"
        )
    if len(chosen) < len(roles):
        raise NetworkError(
            f"network {path}: the layout {card.layout} wants {', '.join(roles)}, the file gives {', '.join(there)}; "
            "name them under outputs in the card"
        )
    for role, name in chosen.items():
        if there[name] not in _NUMBERS:
            raise NetworkError(f"network {path}: output {name} ({role}) is {there[name]}, no array of numbers")
    return chosen


@cache
def _bound_memory() -> bool:
    """Hold all sessions of this process to one bounded arena; say whether this build of onnxruntime can."""
    place = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    try:
        bound = onnxruntime.OrtArenaCfg({"max_mem": MAX_MEMORY_BYTES})
        onnxruntime.create_and_register_allocator(place, bound)
    except Exception:  # another part of this process has registered one already: its bound holds
        return False
    return True


def _reason(problem: Exception) -> str:
    """Return onnxruntime's message in one line, with what to do where it is known."""
    text = " ".join(str(problem).split())
    if "smaller than requested bytes" in text or "bad_alloc" in text or "Failed to allocate" in text:
        return f"wants more than {MAX_MEMORY_BYTES / 1e9:.0f} GB of memory; use a smaller network or input size"
    if "is not a registered function/op" in text or "custom" in text.lower():
        return "uses operators that plain ONNX doesn't have; export it without custom operators"
    if "Unsupported model IR version" in text or "opset" in text.lower():
        return f"is of a newer ONNX than onnxruntime {onnxruntime.__version__} reads; export it with a lower opset"
    return f"can't be run: {text.rsplit(' : ', 1)[-1][:200]}"
