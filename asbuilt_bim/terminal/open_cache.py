"""The cache for a command: where nothing can be kept, or believed, that is said once."""

import tempfile
from pathlib import Path

from asbuilt_bim.scale.cache import Cache, default_folder, owner_only
from asbuilt_bim.storage.atomic_write import write_problem
from asbuilt_bim.terminal.screen import Screen


def open_cache(screen: Screen) -> Cache:
    """Return the user's cache; warn where every run will measure all stations anew.

    That is where it can't be written, or where all files look as if others might write them: on some network disks.
    """
    folder = default_folder()
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            problem = write_problem(folder)
        except OSError as error:
            problem = error
        if problem is not None:
            reason = "it is a file" if folder.is_file() else problem.strerror or problem
            screen.warn(
                f"cache {folder}: can't be written ({reason}), so every run measures all anew; set ASBUILT_BIM_CACHE "
                "to a folder that you may write, or to off"
            )
        elif not _keeps_owner(folder):
            screen.warn(
                f"cache {folder}: its disk shows every file as one that others may write, so none is believed and "
                "every run measures all anew; set ASBUILT_BIM_CACHE to a folder on a disk of this computer, or to off"
            )
    return Cache(folder=folder)


def _keeps_owner(folder: Path) -> bool:
    with tempfile.NamedTemporaryFile(dir=folder) as probe:
        return owner_only(Path(probe.name).stat())
