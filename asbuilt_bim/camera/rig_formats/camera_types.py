"""Stereo cameras that people buy, by what their files are called and say, and how far apart the makers set the eyes."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from asbuilt_bim.camera.rig_formats.plain_text import Plain


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraType:
    """A type of camera with its nominal baselines: several where a name stands for several models."""

    name: str
    pattern: re.Pattern[str]
    baselines_m: tuple[float, ...]

    def nearest_m(self, baseline_m: float) -> float:
        """Return the nominal baseline that is nearest to one that was read."""
        return min(self.baselines_m, key=lambda nominal: abs(baseline_m - nominal))


def _type(name: str, pattern: str, *baselines_m: float) -> CameraType:
    return CameraType(name=name, pattern=re.compile(rf"(?<![a-z0-9]){pattern}(?![a-z0-9])"), baselines_m=baselines_m)


STEREOLABS = _type("ZED", r"sn\d{3,9}", 0.120, 0.063, 0.050)
TYPES = (
    _type("ZED Mini", r"(?:zed[ _-]?mini|zed[ _-]?m)", 0.063),
    _type("ZED X Mini", r"zed[ _-]?x[ _-]?m(?:ini)?", 0.050),
    _type("ZED", r"zed(?:[ _-]?(?:2i?|x))?", 0.120),
    _type("RealSense D435", r"d43[05][if]?", 0.050),
    _type("RealSense D415", r"d415", 0.055),
    _type("RealSense D455", r"d45[567]f?", 0.095),
    _type("RealSense T265", r"t26[15]", 0.064),
    _type("OAK-D", r"oak[ _-]?d(?:[ _-]?(?:lite|pro|s2|w|pro[ _-]?w))?", 0.075),
    STEREOLABS,
)
"""The makers' data sheets. More special names come first; SN and digits are what Stereolabs calls its files."""
_KEYS = ("camera_name", "boardName", "productName", "camera_id", "name", "model")


def type_of(names: Sequence[str], documents: Sequence[Plain]) -> CameraType | None:
    """Return the type that files' names, or the names in them, say; None where they say none."""
    said = [str(doc[key])[:200] for doc in documents if isinstance(doc, Mapping) for key in _KEYS if key in doc]
    text = " ".join([*names, *said]).lower().replace("_", " ")
    return next((one for one in TYPES if one.pattern.search(text)), None)


def serial_of(name: str) -> str:
    """Return the serial number that a file's name holds, "" for none: SN and digits, or eight digits and more."""
    found = re.search(
        r"(?<![a-z0-9])(sn\d{3,9}|\d{8,14})(?![a-z0-9])", name.lower().replace("_", " ").replace("-", " ")
    )
    return found[1] if found else ""
