"""The networks that come with the program: one that finds walls and columns, one for relative depth."""

from importlib import resources
from pathlib import Path

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.card import Task

BUNDLED = "bundled"
"""What stands for a network's card, in project files and on the command line, to take the one that is shipped."""
_CARDS: dict[Task, str] = {"segment": "concrete.yaml", "depth": "depth.yaml"}


def bundled_card(task: Task) -> Path:
    """Return the card of the shipped network for a task.

    Raises:
        NetworkError: none is shipped for this task, or the installation lacks it.
    """
    if task not in _CARDS:
        raise NetworkError(f"no network for {task} is shipped, only for {' and '.join(_CARDS)}; name a card")
    path = models_folder() / _CARDS[task]
    if not path.is_file():
        raise NetworkError(f"the shipped network for {task} isn't installed ({path}); install asbuilt-bim again")
    return path


def models_folder() -> Path:
    """Return where the shipped networks lie."""
    return Path(str(resources.files("asbuilt_bim") / "models"))
