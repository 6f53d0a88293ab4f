"""The networks and plugins that a project names: checked before anything is measured, opened again in each worker."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import cast

from asbuilt_bim.measure.station import Models
from asbuilt_bim.project.trial import try_network
from asbuilt_bim.storage.plugins import PREFIX, PluginGroup, find
from asbuilt_bim.vision.masks.segment import Segmenter
from asbuilt_bim.vision.networks.interface_check import CheckedDepth, CheckedSegmenter
from asbuilt_bim.vision.stereo.depth import RelativeDepth


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkChoice:
    """What stands under `networks` in a project file: a card's absolute path, `plugin:NAME`, or "" for none."""

    segment: str = ""
    depth: str = ""
    stereo: str = ""


NONE = NetworkChoice()


def identities(choice: NetworkChoice) -> dict[str, str]:
    """Return name -> digest (of a network with its card) or version (of a plugin) of all that is chosen.

    Raises:
        NetworkError: a card or its network can't be used.
        PluginError: a plugin can't be found or made.
    """
    if choice == NONE:
        return {}
    from asbuilt_bim.vision.networks.card import read_card
    from asbuilt_bim.vision.networks.files import network_digest

    try_networks(choice)
    load_models(choice)  # opens all of them: errors come before a station is measured
    named: dict[str, str] = {}
    for chosen, group in (
        (choice.segment, PluginGroup.SEGMENTERS),
        (choice.depth, PluginGroup.DEPTH_NETWORKS),
        (choice.stereo, None),
    ):
        if chosen.startswith(PREFIX) and group is not None:
            named[chosen] = find(group, chosen).identity
        elif chosen:
            named[read_card(Path(chosen)).name] = network_digest(Path(chosen))
    return named


def people_sought(choice: NetworkChoice) -> bool:
    """Say whether a network that is chosen looks for people, so that they are blurred.

    Raises:
        NetworkError: its card can't be read.
    """
    if not choice.segment or choice.segment.startswith(PREFIX):
        return False
    from asbuilt_bim.vision.networks.card import read_card

    return any(one.blur for one in read_card(Path(choice.segment)).classes)


def try_networks(choice: NetworkChoice) -> None:
    """See that each network that is chosen comes to an end, before any is opened in this process.

    Raises:
        NetworkError: one can't be read, crashed, took too long or too much memory.
    """
    for chosen in (choice.segment, choice.depth, choice.stereo):
        if chosen and not chosen.startswith(PREFIX):
            try_network(Path(chosen))


def load_models(choice: NetworkChoice) -> Models:
    """Open what a project has chosen, once a process unless a network's file changes.

    Raises:
        NetworkError: a card or its network can't be used.
        PluginError: a plugin can't be found or made.
    """
    if choice == NONE:
        return Models()
    from asbuilt_bim.vision.networks.files import network_stamp

    cards = [chosen for chosen in (choice.segment, choice.depth, choice.stereo) if not chosen.startswith(PREFIX)]
    return _opened(choice, tuple(network_stamp(Path(card)) for card in cards if card))


@lru_cache(maxsize=2)
def _opened(choice: NetworkChoice, stamps: tuple[object, ...]) -> Models:
    from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkMatcher, NetworkSegmenter, load

    segmenter: Segmenter | None = None
    if choice.segment.startswith(PREFIX):
        plugin = find(PluginGroup.SEGMENTERS, choice.segment)
        segmenter = CheckedSegmenter(name=plugin.name, who=plugin.who, inner=cast(Segmenter, plugin.made))
    elif choice.segment:
        segmenter = NetworkSegmenter(loaded=load(Path(choice.segment), "segment"))
    depth: RelativeDepth | None = None
    if choice.depth.startswith(PREFIX):
        plugin = find(PluginGroup.DEPTH_NETWORKS, choice.depth)
        depth = CheckedDepth(name=plugin.name, who=plugin.who, inner=cast(RelativeDepth, plugin.made))
    elif choice.depth:
        depth = NetworkDepth(loaded=load(Path(choice.depth), "depth"))
    matcher = NetworkMatcher(loaded=load(Path(choice.stereo), "stereo")) if choice.stereo else None
    return Models(opinion=segmenter, relative_depth=depth, matcher=matcher)
