"""Files that a project names and that aren't there: all of them at once, before anything takes time."""

from __future__ import annotations

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.project.read import Project


def refuse_missing(project: Project) -> None:
    """Check that every file of a project is there, but for the photos: a missing photo costs its station alone.

    Raises:
        ProjectError: with every file that is missing, by its key.
    """
    missing = [f"  {key}: {project.relative(path)}" for key, path in project.missing.items()]
    if missing:
        count = "a file isn't" if len(missing) == 1 else f"{len(missing)} files aren't"
        raise ProjectError(
            "\n".join([f"{project.path}: {count} there; copy them there, or correct the paths:", *missing])
        )
