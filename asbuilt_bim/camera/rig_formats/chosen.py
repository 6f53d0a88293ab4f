"""Which two of a file's cameras are the rig: those that were named, or the only two with the photos' size."""

from collections.abc import Mapping

from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.errors import RigError

MOST_CAMERAS = 40


def chosen_pair(sizes: Mapping[str, tuple[int, int]], where: str, foreign: Foreign) -> tuple[str, str]:
    """Return the names of the left and the right camera, of the cameras' sizes by name in the file's order.

    Raises: RigError where fewer than two are there, or where it is open which.
    """
    names = list(sizes)
    shown = ", ".join(f"{name[:20]} ({w}x{h})" for name, (w, h) in list(sizes.items())[:10])
    if not 2 <= len(names) <= MOST_CAMERAS:
        raise RigError(f"{where}: holds {shown or 'no camera'}; a stereo rig has a left and a right camera")
    if foreign.cameras:
        if len(foreign.cameras) != 2 or len(set(foreign.cameras)) != 2 or not set(foreign.cameras) <= set(names):
            raise RigError(
                f"{where}: rig.cameras says {', '.join(foreign.cameras)[:60]}, and it holds {shown}; name two of "
                "these, left first"
            )
        return foreign.cameras[0], foreign.cameras[1]
    wanted = foreign.size_px or foreign.photo_px
    if len(names) > 2 and wanted is not None:
        names = [name for name in names if sizes[name] == wanted]
    if len(names) != 2:
        raise RigError(
            f"{where}: holds {shown}; say which two are the rig, left first: rig.cameras: [{next(iter(sizes))[:20]}, "
            f"{list(sizes)[1][:20]}], or --rig-cameras {next(iter(sizes))[:20]},{list(sizes)[1][:20]}"
        )
    return names[0], names[1]
