"""Files that a project names and that aren't there: all of them at once, before anything takes time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.plugins import PREFIX
from asbuilt_bim.project.read import Project


def refuse_missing(project: Project) -> None:
    """Check that every file of a project is there, but for the photos: a missing photo costs its station alone.

    Raises:
        ProjectError: with every file that is missing, by its key.
    """
    missing = [f"  {key}: {project.relative(path)}" for key, path in _files(project) if not path.exists()]
    if missing:
        count = "a file isn't" if len(missing) == 1 else f"{len(missing)} files aren't"
        raise ProjectError(
            "\n".join([f"{project.path}: {count} there; copy them there, or correct the paths:", *missing])
        )


def _files(project: Project) -> Iterator[tuple[str, Path]]:
    several = len(project.ifc) > 1
    yield from ((f"ifc[{i}]" if several else "ifc", path) for i, path in enumerate(project.ifc))
    rig = project.rig
    for key, path in (
        ("rig.file", rig.file),
        ("rig.file_right", rig.file_right),
        ("rig.control_points.file", rig.control_points),
        ("markers.survey", project.survey),
        ("schedule", project.schedule),
    ):
        if path is not None:
            yield key, path
    yield from ((f"history[{i}]", path) for i, path in enumerate(project.history))
    networks = project.networks
    for key, named in (("segment", networks.segment), ("depth", networks.depth), ("stereo", networks.stereo)):
        if named and not named.startswith(PREFIX):
            yield f"networks.{key}", Path(named)
