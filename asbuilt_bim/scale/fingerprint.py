"""What the numbers were made with: versions of this program's code and of the libraries that do the arithmetic."""

from __future__ import annotations

import functools
import hashlib
from importlib import metadata
from pathlib import Path

from asbuilt_bim.version import __version__

LIBRARIES = ("numpy", "opencv-python-headless", "ifcopenshell", "onnxruntime", "shapely")
MEASURING = ("geometry", "camera", "vision", "measure")
"""The packages whose code decides what a station's measurement is."""


@functools.cache
def library_versions() -> dict[str, str]:
    """Return name -> version of the libraries that a result depends on."""
    versions = {}
    for name in LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = "unknown"
    return versions


@functools.cache
def measuring_code_digest() -> str:
    """Return a digest of this program's measuring code, so that a cached result of other code is never used."""
    root = Path(__file__).parent.parent
    digest = hashlib.sha256(__version__.encode())
    for package in MEASURING:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    for model in sorted((root / "models").glob("*.onnx")):
        digest.update(f"{model.name} {model.stat().st_size}".encode())
    return digest.hexdigest()
