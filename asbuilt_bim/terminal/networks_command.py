"""`asbuilt-bim networks add`: the card of a published network, written beside the user's own file once it was tried."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asbuilt_bim.errors import NetworkError, OutputError
from asbuilt_bim.project.trial import try_network
from asbuilt_bim.storage.atomic_write import place_problem, replace_bytes, writing
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.vision.networks.added import card_of_file, card_text
from asbuilt_bim.vision.networks.card import read_card
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkMatcher, NetworkSegmenter, load
from asbuilt_bim.vision.networks.presets import preset_of


@dataclass(frozen=True, slots=True, kw_only=True)
class AddRequest:
    """The command line of `networks add`, as it was given."""

    preset: str
    file: Path
    non_commercial: bool = False
    replace: bool = False


def add_command(request: AddRequest, screen: Screen) -> int:
    """Write a network's card beside its file, once a picture of grey has gone through it.

    Raises:
        NetworkError: there is no such preset, its licence forbids paid work and nobody asked for that, or the file
            isn't that network.
        OutputError: a card is there already, or can't be written.
    """
    preset = preset_of(request.preset)
    if not preset.commercial and not request.non_commercial:
        raise NetworkError(
            f"networks add {request.preset}: its licence is {preset.licence}: not for paid work. If yours is none, "
            "pass --non-commercial"
        )
    if not request.file.is_file():
        raise NetworkError(f"network {request.file}: there is no such file; download it from {preset.source}")
    target = request.file.with_name(f"{request.preset}.yaml")
    if problem := place_problem(target):
        raise OutputError(problem)
    if target.exists() and not request.replace:
        raise OutputError(f"{target}: a card is there already; --replace writes over it")
    card = card_of_file(preset, request.file)
    before = target.read_bytes() if target.exists() else None
    with writing(target):
        replace_bytes(target, card_text(card).encode())
    try:
        _tried(target)
    except NetworkError:
        if before is None:
            target.unlink(missing_ok=True)
        else:
            replace_bytes(target, before)
        raise
    screen.say(f"{card.name} ({preset.licence}) works. Its card is {target}; in a project file:")
    screen.say(f"  networks: {{{card.task}: {target.name}}}")
    if card.task == "segment" and not card.finds_concrete:
        names = ", ".join(one.name for one in card.classes)
        screen.say(f"It knows no concrete: what it takes for {names} is left out, and people are blurred in pictures.")
    return 0


def _tried(path: Path) -> None:
    """Send a grey picture through a card's network, and read its answer as a run would.

    Raises:
        NetworkError: it isn't what its card says.
    """
    try_network(path)
    card = read_card(path)
    picture = np.full((card.input.height_px, card.input.width_px, 3), 128, dtype=np.uint8)
    if card.task == "segment":
        NetworkSegmenter(loaded=load(path, "segment")).sightings(picture)
    elif card.task == "depth":
        NetworkDepth(loaded=load(path, "depth")).estimate(picture)
    else:
        NetworkMatcher(loaded=load(path, "stereo")).raw(picture, picture)
