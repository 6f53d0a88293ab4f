"""`measure.json`: what was measured of one photo pair, for other programs; held against `schemas/measure-1.json`."""

from datetime import UTC, datetime
from typing import Any

import numpy as np

from asbuilt_bim.errors import ResultError
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.measure.depth_source import depth_method
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement, dominating, seen
from asbuilt_bim.report.result.arrays_json import METRE_DECIMALS, PIXEL_DECIMALS
from asbuilt_bim.report.result.rejections import rejection_to_plain
from asbuilt_bim.storage.schemas import first_fault
from asbuilt_bim.version import __version__
from asbuilt_bim.vision.target.find import TargetSighting

FORMAT, VERSION = "asbuilt-bim/measure", 1


def measure_document(found: PairMeasurement, when: datetime, files: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a pair's measurement as plain JSON values; `files` are the others that were written beside it.

    Raises:
        ResultError: a number isn't finite, or the document doesn't fit its schema; an error of the program.
    """
    options, measurement = found.options, found.detail.measurement
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "program_version": __version__,
        "created": when.astimezone(UTC).isoformat(timespec="seconds"),
        "left": {"name": found.left_name, "digest": measurement.left_digest},
        "right": {"name": found.right_name, "digest": measurement.right_digest},
        "method": options.method,
        "depth": depth_method(options.method, options.depth),
        "inversion": options.inversion if found.detail.depth.method == "paper" else None,
        "scale": "baseline, checked by the target" if found.target is not None else "baseline, unchecked",
        "calibration_known": found.calibration_known,
        "camera": _camera(found),
        "target": _target(found.target) if found.target is not None else None,
        "faces": [_face(found, face) for face in found.faces],
        "rejections": [rejection_to_plain(rejection) for rejection in found.rejections],
        "seconds": {step: round(seconds, 4) for step, seconds in measurement.seconds.items()},
        "files": list(files),
    }
    if fault := first_fault("measure-1", document):
        raise ResultError(f"the measurement is not fit to be written: {fault}")
    return document


def _camera(found: PairMeasurement) -> dict[str, Any]:
    camera = found.detail.pair.camera
    return {
        "f_px": camera.f_px,
        "cx_px": camera.cx_px,
        "cy_px": camera.cy_px,
        "baseline_m": camera.baseline_m,
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "rectified_from_left": camera.rectified_from_left.tolist(),
    }


def _target(target: TargetSighting) -> dict[str, Any]:
    return {
        "left_px": _rounded(target.left_px, PIXEL_DECIMALS + 1),
        "right_px": _rounded(target.right_px, PIXEL_DECIMALS + 1),
        "disparity_px": target.disparity_px,
        "depth_m": target.depth_m,
        "depth_sigma_m": target.depth_sigma_m,
        "range_m": target.range_m,
        "diameter_m": target.diameter_m,
    }


def _face(found: PairMeasurement, face: MeasuredFace) -> dict[str, Any]:
    stated = found.options.method == "default"  # the published method states no uncertainty
    frame = face.frame
    outline_m = [face.frame.from_uv(ring) for ring in face.outline_uv_m]
    return {
        "id": face.face_id.rpartition("/")[2],
        "instance": face.instance + 1,
        "class": face.label,
        "score": face.score,
        "source": str(face.source),
        "segmenter": face.segmenter,
        "kind": "cylinder" if isinstance(frame, CylinderFrame) else "plane",
        "radius_m": frame.radius_m if isinstance(frame, CylinderFrame) else None,
        "width_m": face.width_m,
        "height_m": face.height_m,
        "area_m2": face.area_m2,
        "area_sigma_m2": face.area_sigma_m2 if stated else None,
        "area_sigma_calibration_m2": face.area_sigma_calibration_m2 if stated else None,
        "area_sigma_image_m2": face.area_sigma_image_m2 if stated else None,
        "sigma_from": dominating(face, calibration_known=found.calibration_known) if stated else None,
        "seen": seen(face, found.options.method),
        "flatness_rms_m": face.flatness_rms_m if stated else None,
        "distance_m": face.distance_m,
        "normal_left": None if isinstance(frame, CylinderFrame) else _rounded(frame.normal, 9),
        "outline_photo_px": [_rounded(ring, PIXEL_DECIMALS) for ring in found.photo_outline_px(face)],
        "outline_rectified_px": [_rounded(ring, PIXEL_DECIMALS) for ring in face.outline_px],
        "outline_uv_m": [_rounded(ring, METRE_DECIMALS) for ring in face.outline_uv_m],
        "outline_left_m": [_rounded(ring, METRE_DECIMALS) for ring in outline_m],
    }


def _rounded(values: FloatArray, decimals: int) -> Any:
    return (np.round(np.asarray(values, dtype=np.float64), decimals) + 0.0).tolist()
