"""The networks and plugins that a project names: checked before anything is measured, opened again in each worker."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import cast

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.measure.station import Models
from asbuilt_bim.project.trial import try_network
from asbuilt_bim.scale.fingerprint import measuring_identity
from asbuilt_bim.storage.plugins import PREFIX, PluginGroup, find
from asbuilt_bim.vision.masks.segment import Segmenter
from asbuilt_bim.vision.networks.bundled import BUNDLED, bundled_card
from asbuilt_bim.vision.networks.card import Task, read_card
from asbuilt_bim.vision.networks.files import Stamp, network_digest, network_stamp
from asbuilt_bim.vision.networks.interface_check import CheckedDepth, CheckedSegmenter
from asbuilt_bim.vision.stereo.depth import RelativeDepth


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkChoice:
    """What stands under `networks` in a project file: a card's absolute path, `bundled`, `plugin:NAME`, "" for none.

    `bundled` stays so: a worker on another machine has the shipped network in another place.
    """

    segment: str = ""
    depth: str = ""
    stereo: str = ""


NONE = NetworkChoice()
Stamps = tuple[Stamp, ...]
_GROUPS = {"segment": PluginGroup.SEGMENTERS, "depth": PluginGroup.DEPTH_NETWORKS}


def identities(choice: NetworkChoice) -> dict[str, str]:
    """Return name -> digest (of a network with its card) or version (of a plugin) of all that is chosen.

    Raises:
        NetworkError: a card or its network can't be used.
        PluginError: a plugin can't be found or made.
    """
    if choice == NONE:
        return {}
    try_networks(choice)
    load_models(choice)  # opens all of them: errors come before a station is measured
    return dict(_named(choice, _stamps(choice)))


def identity_with(choice: NetworkChoice) -> dict[str, str]:
    """Return what two machines must have alike to measure alike: code and libraries, and what is chosen.

    Raises:
        NetworkError: a card or its network can't be used.
        PluginError: a plugin can't be found or made.
    """
    named = _named(choice, _stamps(choice))
    shown = {name: one if name.startswith(PREFIX) else one[:12] for name, one in named.items()}
    return measuring_identity() | {f"the network {name}": one for name, one in shown.items()}


@lru_cache(maxsize=2)
def _named(choice: NetworkChoice, stamps: Stamps) -> dict[str, str]:
    named: dict[str, str] = {}
    for task, chosen in _chosen(choice):
        if chosen.startswith(PREFIX):
            named[chosen] = find(_GROUPS[task], chosen).identity
        else:
            card = _card(chosen, task)
            name = read_card(card).name
            if name in named:
                raise NetworkError(
                    f"network card {card}: another card of the project has the name {name}, too; rename one"
                )
            named[name] = network_digest(card)
    return named


def _chosen(choice: NetworkChoice) -> list[tuple[Task, str]]:
    tasks: list[tuple[Task, str]] = [("segment", choice.segment), ("depth", choice.depth), ("stereo", choice.stereo)]
    return [(task, chosen) for task, chosen in tasks if chosen]


def _card(chosen: str, task: Task) -> Path:
    return bundled_card(task) if chosen == BUNDLED else Path(chosen)


def _cards(choice: NetworkChoice) -> list[Path]:
    return [_card(chosen, task) for task, chosen in _chosen(choice) if not chosen.startswith(PREFIX)]


def _stamps(choice: NetworkChoice) -> Stamps:
    return tuple(network_stamp(card) for card in _cards(choice))


def people_sought(choice: NetworkChoice) -> bool:
    """Say whether a network that is chosen looks for people, so that they are blurred.

    Raises:
        NetworkError: its card can't be read.
    """
    if not choice.segment or choice.segment.startswith(PREFIX):
        return False
    return any(one.blur for one in read_card(_card(choice.segment, "segment")).classes)


def names_plugin(choice: NetworkChoice) -> bool:
    """Say whether a plugin is chosen: code of others, which may never come to an end."""
    return any(chosen.startswith(PREFIX) for _, chosen in _chosen(choice))


def try_networks(choice: NetworkChoice) -> None:
    """See that each network that is chosen comes to an end, before any is opened in this process.

    Raises:
        NetworkError: one can't be read, crashed, took too long or too much memory.
    """
    for card in _cards(choice):
        try_network(card)


def load_models(choice: NetworkChoice) -> Models:
    """Open what a project has chosen, once a process unless a network's file changes.

    Raises:
        NetworkError: a card or its network can't be used.
        PluginError: a plugin can't be found or made.
    """
    if choice == NONE:
        return Models()
    return _opened(choice, _stamps(choice))


@lru_cache(maxsize=2)
def _opened(choice: NetworkChoice, stamps: Stamps) -> Models:
    from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkMatcher, NetworkSegmenter, load

    segmenter: Segmenter | None = None
    if choice.segment.startswith(PREFIX):
        plugin = find(PluginGroup.SEGMENTERS, choice.segment)
        segmenter = CheckedSegmenter(name=plugin.name, who=plugin.who, inner=cast(Segmenter, plugin.made))
    elif choice.segment:
        segmenter = NetworkSegmenter(loaded=load(_card(choice.segment, "segment"), "segment"))
    depth: RelativeDepth | None = None
    if choice.depth.startswith(PREFIX):
        plugin = find(PluginGroup.DEPTH_NETWORKS, choice.depth)
        depth = CheckedDepth(name=plugin.name, who=plugin.who, inner=cast(RelativeDepth, plugin.made))
    elif choice.depth:
        depth = NetworkDepth(loaded=load(_card(choice.depth, "depth"), "depth"))
    matcher = NetworkMatcher(loaded=load(_card(choice.stereo, "stereo"), "stereo")) if choice.stereo else None
    return Models(opinion=segmenter, relative_depth=depth, matcher=matcher)
