"""All that a network is made of: its card, its ONNX file, and the data that lie beside that."""

import hashlib
from functools import lru_cache
from pathlib import Path

from asbuilt_bim.vision.networks.card import model_path, read_card
from asbuilt_bim.vision.networks.onnx_file import data_files

Stamp = tuple[tuple[str, int, int], ...]


def network_stamp(card_path: Path) -> Stamp:
    """Return path, time of change and bytes of each file of a network: what is kept in a process goes by it.

    Raises:
        NetworkError: the card can't be used, or its ONNX file is none.
    """
    files = ((path, path.stat()) for path in _files(card_path))
    return tuple((str(path), stat.st_mtime_ns, stat.st_size) for path, stat in files)


def network_digest(card_path: Path) -> str:
    """Return the SHA-256 of a network's files together.

    Raises:
        NetworkError: the card can't be used, or its ONNX file is none.
    """
    return _digest(network_stamp(card_path))


@lru_cache(maxsize=6)
def _digest(stamp: Stamp) -> str:
    card, *others = (Path(path) for path, _, _ in stamp)
    digest = hashlib.sha256(card.read_bytes())
    for path in others:
        with path.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def _files(card_path: Path) -> tuple[Path, ...]:
    card_path = card_path.resolve()
    model = model_path(read_card(card_path), card_path)
    return card_path, model, *data_files(model)
