"""`issues-2.1.bcf` and `issues-3.0.bcf`: what a person has to look at, for any viewer that reads BCF."""

import io
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from asbuilt_bim.bim.file_names import file_names
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.bcf.markup import (
    SNAPSHOT,
    VIEWPOINT,
    Version,
    extensions_xml,
    markup_xml,
    version_xml,
    viewpoint_xml,
)
from asbuilt_bim.report.bcf.snapshots import snapshots_of
from asbuilt_bim.report.bcf.topics import Topic, all_topics
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.storage.atomic_write import writing

FILES: Mapping[Version, str] = {"2.1": "issues-2.1.bcf", "3.0": "issues-3.0.bcf"}
_ALWAYS = (1980, 1, 1, 0, 0, 0)  # the same result makes the same file


def write_issues(
    report: ProgressReport, earlier: Sequence[ProgressReport], pictures: Mapping[str, bytes], folder: Path
) -> tuple[Path, ...]:
    """Write both files into `folder` and return their paths; `pictures` maps a station's name to its picture.

    Raises:
        OutputError: a file can't be written, or a picture can't be decoded.
    """
    topics = all_topics(report, earlier)
    snapshots = snapshots_of(report, topics, pictures)
    written = []
    for version, name in FILES.items():
        path = folder / name
        data = issues_bytes(report, topics, snapshots, version)
        with writing(path):
            path.write_bytes(data)
        written.append(path)
    return tuple(written)


def issues_bytes(
    report: ProgressReport, topics: Sequence[Topic], snapshots: Mapping[str, bytes], version: Version
) -> bytes:
    """Return one file's bytes; `snapshots` maps a topic's GUID to its picture as PNG."""
    colours = {element.global_id: STATE_COLOURS[element.shown_state] for element in report.elements}
    ifc_names = file_names(report.provenance.ifc_name) if report.provenance else ()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        _put(archive, "bcf.version", version_xml(version))
        if version == "3.0":
            _put(archive, "extensions.xml", extensions_xml())
        for topic in topics:
            snapshot = snapshots.get(topic.guid)
            looks = topic.camera is not None or bool(topic.elements)
            markup = markup_xml(topic, version, looks, looks and snapshot is not None, ifc_names)
            _put(archive, f"{topic.guid}/markup.bcf", markup)
            if looks:
                _put(archive, f"{topic.guid}/{VIEWPOINT}", viewpoint_xml(topic, version, colours))
            if looks and snapshot is not None:
                _put(archive, f"{topic.guid}/{SNAPSHOT}", snapshot, zipfile.ZIP_STORED)
    return out.getvalue()


def _put(archive: zipfile.ZipFile, name: str, data: bytes, how: int = zipfile.ZIP_DEFLATED) -> None:
    entry = zipfile.ZipInfo(name, _ALWAYS)
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, data, how)
