"""The XML of BCF 2.1 and 3.0: a topic's markup and its viewpoint. Text is escaped by the writer, never pasted."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from datetime import date
from typing import Literal

from asbuilt_bim.report.bcf.camera import Camera
from asbuilt_bim.report.bcf.topics import CLOSED, OPEN, Topic, guid_of
from asbuilt_bim.report.wording.issue_words import IssueKind
from asbuilt_bim.report.wording.values import plain
from asbuilt_bim.report.xml_file import add

Version = Literal["2.1", "3.0"]
VIEWPOINT, SNAPSHOT = "viewpoint.bcfv", "snapshot.png"
AUTHOR = "asbuilt-bim"
_FOV_21_DEG = 45.0, 60.0
"""What BCF 2.1 lets a field of view be; viewers of 3.0 get the camera's own."""


def version_xml(version: Version) -> bytes:
    """Return `bcf.version`."""
    root = ET.Element("Version", {"VersionId": version})
    if version == "2.1":
        add(root, "DetailedVersion", version)
    return _document(root)


def extensions_xml() -> bytes:
    """Return the extensions that BCF 3.0 demands: the kinds and states of topics that stand in the file."""
    root = ET.Element("Extensions")
    for group, name, values in (
        ("TopicTypes", "TopicType", [str(kind) for kind in IssueKind]),
        ("TopicStatuses", "TopicStatus", [OPEN, CLOSED]),
        ("Users", "User", [AUTHOR]),
    ):
        inside = ET.SubElement(root, group)
        for value in values:
            add(inside, name, value)
    return _document(root)


def markup_xml(
    topic: Topic, version: Version, has_viewpoint: bool, has_snapshot: bool, ifc_names: Sequence[str]
) -> bytes:
    """Return `markup.bcf` of a topic."""
    root = ET.Element("Markup")
    header = ET.SubElement(root, "Header") if ifc_names else root
    files = ET.SubElement(header, "Files") if ifc_names and version == "3.0" else header
    for name in ifc_names:
        add(ET.SubElement(files, "File"), "Filename", plain(name))
    about = {"Guid": topic.guid, "TopicType": str(topic.kind), "TopicStatus": topic.status}
    inside = ET.SubElement(root, "Topic", about)
    add(inside, "Title", plain(topic.title))
    add(inside, "CreationDate", _moment(topic.created))
    add(inside, "CreationAuthor", AUTHOR)
    add(inside, "ModifiedDate", _moment(topic.visit))
    add(inside, "ModifiedAuthor", AUTHOR)
    if topic.due is not None:
        add(inside, "DueDate", _moment(topic.due))
    add(inside, "Description", plain(topic.text))
    if has_viewpoint:
        guid = {"Guid": guid_of(topic.guid, "viewpoint")}
        if version == "3.0":
            view = ET.SubElement(ET.SubElement(inside, "Viewpoints"), "ViewPoint", guid)
        else:
            view = ET.SubElement(root, "Viewpoints", guid)
        add(view, "Viewpoint", VIEWPOINT)
        if has_snapshot:
            add(view, "Snapshot", SNAPSHOT)
    return _document(root)


def viewpoint_xml(topic: Topic, version: Version, colours: Mapping[str, str]) -> bytes:
    """Return the viewpoint of a topic: its elements selected and coloured (GlobalId -> "#rrggbb"), and its camera."""
    root = ET.Element("VisualizationInfo", {"Guid": guid_of(topic.guid, "viewpoint")})
    components = ET.SubElement(root, "Components")
    if topic.elements:
        selection = ET.SubElement(components, "Selection")
        for element in topic.elements:
            ET.SubElement(selection, "Component", {"IfcGuid": element})
    ET.SubElement(components, "Visibility", {"DefaultVisibility": "true"})
    coloured = [element for element in topic.elements if element in colours]
    if coloured:
        colouring = ET.SubElement(components, "Coloring")
        for element in coloured:
            colour = ET.SubElement(colouring, "Color", {"Color": colours[element].removeprefix("#").upper()})
            inside = ET.SubElement(colour, "Components") if version == "3.0" else colour
            ET.SubElement(inside, "Component", {"IfcGuid": element})
    if topic.camera is not None:
        _add_camera(root, topic.camera, version)
    return _document(root)


def _add_camera(root: ET.Element, camera: Camera, version: Version) -> None:
    view = ET.SubElement(root, "PerspectiveCamera")
    vectors = {
        "CameraViewPoint": camera.place_m,
        "CameraDirection": camera.direction,
        "CameraUpVector": camera.up,
    }
    for name, vector in vectors.items():
        point = ET.SubElement(view, name)
        for axis, value in zip("XYZ", vector, strict=True):
            add(point, axis, repr(float(value)))
    low, high = _FOV_21_DEG
    field = camera.field_of_view_deg if version == "3.0" else min(max(camera.field_of_view_deg, low), high)
    add(view, "FieldOfView", repr(float(field)))
    if version == "3.0":
        add(view, "AspectRatio", repr(float(camera.aspect)))


def _moment(day: date) -> str:
    return f"{day.isoformat()}T00:00:00Z"


def _document(root: ET.Element) -> bytes:
    ET.indent(root, " ")
    document: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return document
