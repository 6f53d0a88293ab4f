"""The cache for a command: where nothing can be kept, that is said once."""

from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.storage.atomic_write import write_problem
from asbuilt_bim.terminal.screen import Screen


def open_cache(screen: Screen) -> Cache:
    """Return the user's cache; warn where it can't be written, for then every run measures all stations anew."""
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
    return Cache(folder=folder)
