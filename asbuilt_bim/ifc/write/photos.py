"""The photos as document references, tied to the elements that they decided something of."""

from __future__ import annotations

from collections.abc import Sequence

from asbuilt_bim.ifc.names import PHOTO
from asbuilt_bim.ifc.write.entities import Marker
from asbuilt_bim.progress.report import ProgressReport, StationRecord

_PLAIN = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/")
_LONGEST = 255  # an IfcLabel in IFC2X3


def write_photos(marker: Marker, reports: Sequence[ProgressReport]) -> None:
    """Add one IfcDocumentReference a station: the overlay beside the copy, and the left photo's path as identification.

    Paths are relative: the overlay's to the folder of the copy, the photo's to the project's. A visit carried over from
    an earlier run has no picture here, so no overlay.
    """
    for report in reports:
        seen: dict[str, list[str]] = {}
        for element in report.elements:
            if element.last_seen == report.visit_date:
                for name in element.stations:
                    seen.setdefault(name, []).append(element.global_id)
        for station in report.stations:
            things = [thing for key in seen.get(station.name, ()) if (thing := marker.find(key, "IfcProduct"))]
            if things:
                _refer(marker, station, things)


def _refer(marker: Marker, station: StationRecord, things: list[object]) -> None:
    day = station.day.isoformat()
    identification = "ItemReference" if marker.schema == "IFC2X3" else "Identification"
    location = uri(station.overlay) if station.picture else ""
    reference = marker.file.create_entity(
        "IfcDocumentReference",
        Location=location if 0 < len(location) <= _LONGEST else None,
        Name=f"{day} {station.name}"[:_LONGEST],
        **{identification: station.left_photo[-_LONGEST:] or None},
    )
    marker.rooted(
        "IfcRelAssociatesDocument",
        f"photo/{day}/{station.name}",
        Name=PHOTO,
        RelatedObjects=things,
        RelatingDocument=reference,
    )


def uri(path: str) -> str:
    """Return a relative path as a URI reference: what may not stand in one is escaped."""
    return "".join(chr(byte) if byte in _PLAIN else f"%{byte:02X}" for byte in path.encode())
