"""`faces.csv` and the terminal's rows: one line a measured face."""

import csv
import io

from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement, dominating, seen
from asbuilt_bim.report.csv import safe_cell
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.of_faces import source_text

COLUMNS = (
    "face", "instance", "class", "kind", "width_m", "height_m", "area_m2", "area_sigma_m2",
    "area_sigma_calibration_m2", "area_sigma_image_m2", "sigma_from", "seen", "flatness_rms_m", "distance_m", "source",
)  # fmt: skip
HEADINGS = ("Face", "Class", "Kind", "Width", "Height", "Area", "Sigma from", "Seen", "Flatness", "Distance")


def faces_csv(found: PairMeasurement) -> bytes:
    """Return the faces as CSV (UTF-8 with its mark, so that spreadsheets read it); cells without a number are empty."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow(COLUMNS)
    stated = found.options.method == "default"
    for face in found.faces:
        sigmas = (face.area_sigma_m2, face.area_sigma_calibration_m2, face.area_sigma_image_m2)
        table.writerow([
            face.face_id.rpartition("/")[2], face.instance + 1, face.label, kind(face), f"{face.width_m:.4f}",
            f"{face.height_m:.4f}", f"{face.area_m2:.5f}", *(f"{s:.5f}" if stated else "" for s in sigmas),
            dominating(face, calibration_known=found.calibration_known) if stated else "",
            seen(face, found.options.method),
            f"{face.flatness_rms_m:.5f}" if stated else "", f"{face.distance_m:.3f}",
            safe_cell(source_text(face.source, face.segmenter)),
        ])  # fmt: skip
    return ("\ufeff" + text.getvalue()).encode("utf-8", "replace")


def kind(face: MeasuredFace) -> str:
    """Return `plane` or `cylinder`."""
    return "cylinder" if isinstance(face.frame, CylinderFrame) else "plane"


def face_rows(found: PairMeasurement) -> list[tuple[str, ...]]:
    """Return what people read of each face, a text a heading; no tilt: one pair doesn't know the true vertical."""
    stated = found.options.method == "default"
    rows: list[tuple[str, ...]] = []
    for face in found.faces:
        round_ = isinstance(face.frame, CylinderFrame)
        rows.append((
            face.face_id.rpartition("/")[2], f"{face.label} {face.instance + 1}", kind(face),
            f"{'⌀ ' if round_ else ''}{wording.length(face.width_m)}", wording.length(face.height_m),
            wording.area(face.area_m2, face.area_sigma_m2 if stated else None),
            dominating(face, calibration_known=found.calibration_known) if stated else "not stated",
            seen(face, found.options.method),
            f"{face.flatness_rms_m * 1000.0:.1f} mm" if stated else "–", f"{face.distance_m:.2f} m",
        ))  # fmt: skip
    return rows
