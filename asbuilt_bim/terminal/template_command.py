"""What `asbuilt-bim template` does: tables to fill in, beside the project file."""

from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.design_source import design_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.blank_tables import blank_tables
from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.storage.atomic_write import place_problem, replace_all, writing
from asbuilt_bim.terminal.screen import Screen


def template_command(path: Path, out: Path | None, screen: Screen, *, replace: bool, allow_outside: bool) -> int:
    """Write costs.csv, schedule.csv and observations.csv with every wall and column of a project's design.

    Raises:
        AsBuiltError: the project or its IFC can't be used, or a file is there already.
    """
    project = read_project(path, allow_outside=allow_outside)
    folder = out or project.folder
    design = design_of(project, Cache(folder=default_folder()))
    tables = {folder / name: data for name, data in blank_tables(design, project.csv).items()}
    for file in tables:
        if file.exists() and not replace:
            raise OutputError(f"{file}: is there already; name another folder with --out, or pass --replace")
        if file in project.sources:
            raise OutputError(f"{file}: the project reads it, so it isn't overwritten; name another folder with --out")
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for file in tables:
        if problem := place_problem(file):
            raise OutputError(problem)
    with writing(folder):
        replace_all(tables)
    for file in tables:
        screen.say(f"{file}")
    screen.say("Fill in what you need, then name the file in the project file: costs, schedule, observations.")
    return 0
