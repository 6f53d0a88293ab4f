"""What the numbers were made with: versions of this program's code and of the libraries that do the arithmetic."""

import functools
import hashlib
from importlib import metadata
from pathlib import Path

from asbuilt_bim.version import __version__

LIBRARIES = ("numpy", "opencv-python-headless", "simplejpeg", "ifcopenshell", "onnxruntime", "shapely")
MEASURING = ("errors.py", "codes.py", "scale/codec.py", "storage", "geometry", "camera", "vision", "measure")
"""The code that decides what a station's measurement is, and how it is kept."""
READING = (
    "errors.py", "codes.py", "scale/codec.py", "storage", "geometry", "bim",
    "ifc/geometry", "ifc/read", "ifc/identity.py", "ifc/names.py", "ifc/native_path.py", "ifc/units.py",
)  # fmt: skip
"""The code that decides what a design is, and how it is kept."""
KINDS = (".py", ".json", ".onnx", ".yaml")
"""Code, fitted numbers, networks and their cards."""
PACKED = {"schemas"}
"""What lies in the package of a wheel, and beside it in a clone: both are one program."""


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
    return code_digest(Path(__file__).parent.parent)


def measuring_identity() -> dict[str, str]:
    """Return what two machines must have alike to measure alike: versions by name, and a digest of the code."""
    return {"asbuilt-bim": __version__, "measuring code": measuring_code_digest()[:12], **library_versions()}


@functools.cache
def reading_code_digest() -> str:
    """Return a digest of this program's code that reads designs, so that a design read by other code is never used."""
    return code_digest(Path(__file__).parent.parent, READING)


@functools.cache
def program_digest(package: Path = Path(__file__).parent.parent) -> str:
    """Return a digest of a whole package, so that a result says that it differs from another program's for that."""
    return code_digest(package, tuple(sorted({part.name for part in package.iterdir()} - PACKED)))


def code_digest(package: Path, parts: tuple[str, ...] = MEASURING) -> str:
    """Return a digest of parts of the code in a package's folder: names and bytes of code, fitted numbers, networks.

    Git for Windows may check text out with other line ends: that is no other program.
    """
    digest = hashlib.sha256(__version__.encode())
    for name in parts:
        there = [package / name] if name.endswith(".py") else (package / name).rglob("*")
        for path in sorted(path for path in there if path.suffix in KINDS):
            digest.update(path.relative_to(package).as_posix().encode())
            digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()
