"""Which depth map the areas come from: stereo, the published one, or stereo with its holes filled by a network."""

from typing import Literal

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.vision.stereo.depth import DepthMap, DepthMethod, RelativeDepth
from asbuilt_bim.vision.stereo.depth_fused import fused_depth
from asbuilt_bim.vision.stereo.depth_paper import Inversion, paper_depth
from asbuilt_bim.vision.target.find import TargetSighting

Method = Literal["default", "paper"]

NAME_A_NETWORK = "name a relative-depth network by its card (networks: {depth: card.yaml}, --depth-network card.yaml)"


def depth_method(method: Method, depth: DepthMethod | None) -> DepthMethod:
    """Return which depth map a method takes: the one that is asked for, else its own.

    Raises:
        ValueError: the default method is asked to measure on the published map, which has no sigma.
    """
    if method == "default" and depth == "paper":
        raise ValueError("depth: paper goes with method: paper only; the default method takes stereo or fused")
    return depth or ("paper" if method == "paper" else "stereo")


def missing_network(method: Method, depth: DepthMethod | None, network: object | None) -> str:
    """Return why the depth map asked for can't be made, "" where it can: two of the three need a network."""
    wanted = depth_method(method, depth)
    if network is not None or wanted == "stereo":
        return ""
    remedy = f"{NAME_A_NETWORK}, or take stereo for its depth (depth: stereo, --depth stereo)"
    asked = "method: paper" if method == "paper" and depth is None else f"depth: {wanted}"
    return f"{asked} needs a network that gives relative depth, and none is named; {remedy}"


def area_depth(
    pair: RectifiedPair,
    stereo: DepthMap,
    target: TargetSighting | None,
    network: RelativeDepth | None,
    wanted: DepthMethod,
    inversion: Inversion,
) -> DepthMap | Rejection:
    """Return the depth map that the areas come from, or why there is none. Never another one than was asked for."""
    station = about(SubjectKind.STATION, pair.name)
    if wanted == "stereo":
        return stereo
    if network is None:
        return rejected(Reason.DEPTH_WITHOUT_NETWORK, station, depth=wanted)
    try:
        if wanted == "fused":
            return fused_depth(pair, stereo, network, target)
        if target is None:
            return rejected(Reason.DEPTH_WITHOUT_TARGET, station)
        return paper_depth(pair, network, target, inversion)
    except ValueError as problem:
        return rejected(Reason.DEPTH_FAILED, station, depth=wanted, detail=str(problem))
