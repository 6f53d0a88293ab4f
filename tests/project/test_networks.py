"""Networks that a project names: checked first, part of the cache's key, used by the stations, named in the result."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import NetworkError, OutputError, PluginError, ProjectError
from asbuilt_bim.flow import measure_visit
from asbuilt_bim.flow.measure_visit import StationJob, Workplace, measure_job
from asbuilt_bim.measure.station import StationMeasurement, measure_station
from asbuilt_bim.project.networks import NetworkChoice, identities, load_models
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.apart import Limits
from asbuilt_bim.scale.cluster import SameCode
from asbuilt_bim.scale.executor import WorkerLoss
from asbuilt_bim.vision.masks.segment import InstanceSource
from asbuilt_bim.vision.networks import bundled
from tests.example_package import example_package
from tests.measure.box_world import site
from tests.measure.test_faces import rig_of
from tests.measure.test_station import FREE, photos
from tests.project_folder import plain, write_project
from tests.vision.networks import graphs

__all__ = ["example_package"]
PLUGIN = NetworkChoice(segment="plugin:example-halves")


def wall_everywhere() -> Any:
    """A semantic network that calls everything a wall."""
    logits = np.stack([np.full((48, 64), v, np.float32) for v in (-5.0, 5.0, -5.0)])[None]
    return graphs.constant({"logits": logits})


def test_a_project_names_cards_by_paths_in_its_folder(tmp_path: Path) -> None:
    contents = plain() | {"networks": {"segment": "nets/card.yaml"}}
    project = read_project(write_project(tmp_path, contents))
    assert project.networks == NetworkChoice(segment=str(tmp_path / "nets" / "card.yaml"))


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"networks": {"segment": "../card.yaml"}}, "networks.segment"),
        ({"networks": {"segments": "card.yaml"}}, "did you mean segment"),
        ({"networks": {"stereo": "plugin:x"}}, "networks.stereo: takes a network's card"),
        ({"networks": {"depth": "card.yaml"}}, "networks.depth: isn't used"),
        ({"options": {"measure": {"depth": "fused"}}}, "networks.depth: depth: fused needs a network"),
        ({"options": {"measure": {"method": "paper"}}}, "networks.depth: method: paper needs a network"),
    ],
)
def test_what_a_project_asks_of_networks_must_fit_together(tmp_path: Path, keys: dict[str, Any], says: str) -> None:
    for name in ("design.ifc", "markers.csv", "card.yaml"):
        (tmp_path / name).touch()
    with pytest.raises(ProjectError, match="one mistake") as caught:
        read_project(write_project(tmp_path, plain() | keys))
    assert says in str(caught.value)


def test_bundled_names_the_networks_that_are_shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tmp_path / "models"
    shipped.mkdir()
    monkeypatch.setattr(bundled, "models_folder", lambda: shipped)
    contents = plain() | {"networks": {"segment": "bundled", "depth": "bundled"}}
    contents |= {"options": {"measure": {"depth": "fused"}}}
    written = write_project(tmp_path, contents)
    with pytest.raises(ProjectError, match="the shipped network for depth isn't installed"):
        read_project(written)
    for name in ("concrete", "depth"):
        (shipped / f"{name}.yaml").touch()
    chosen = read_project(written).networks
    assert chosen == NetworkChoice(segment="bundled", depth="bundled"), "a worker has them in another place"
    with pytest.raises(ProjectError, match="no network for stereo is shipped"):
        read_project(write_project(tmp_path, plain() | {"networks": {"stereo": "bundled"}}))


def test_a_bad_card_stops_the_run_before_a_station_is_measured(tmp_path: Path) -> None:
    with pytest.raises(NetworkError, match="no such file"):
        identities(NetworkChoice(segment=str(tmp_path / "card.yaml")))
    with pytest.raises(PluginError, match="no installed package offers"):
        identities(NetworkChoice(segment="plugin:nobody-has-this"))


def test_a_changed_network_is_another_one_to_the_cache(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, wall_everywhere(), "semantic")
    (before,) = identities(NetworkChoice(segment=str(path))).values()
    (tmp_path / "tiny.onnx").write_bytes((tmp_path / "tiny.onnx").read_bytes() + b"\x72\x00")  # an unknown field, empty
    (after,) = identities(NetworkChoice(segment=str(path))).values()
    assert before != after


def test_a_network_trained_again_is_another_one_where_only_the_data_beside_it_changed(tmp_path: Path) -> None:
    path, data = (
        graphs.card(tmp_path, graphs.scaled_beside(tmp_path, "tiny.onnx.data"), "inverse-depth"),
        "tiny.onnx.data",
    )
    choice = NetworkChoice(depth=str(path))
    seen = []
    for factor in (1.0, 3.0):
        (tmp_path / data).write_bytes(np.float32(factor).tobytes())
        depth = load_models(choice).relative_depth
        assert depth is not None
        seen.append((identities(choice)["tiny"], float(depth.estimate(np.full((48, 64, 3), 51, np.uint8)).mean())))
    assert seen[0][0] != seen[1][0], "the cache and the result would take one for the other"
    assert [value for _, value in seen] == pytest.approx([0.2, 0.6], abs=1e-3)


def test_two_cards_of_one_name_are_refused_since_the_cache_would_see_one_of_them(tmp_path: Path) -> None:
    for task in ("segment", "depth"):
        (tmp_path / task).mkdir()
    choice = NetworkChoice(
        segment=str(graphs.card(tmp_path / "segment", wall_everywhere(), "semantic")),
        depth=str(graphs.card(tmp_path / "depth", graphs.echo(), "inverse-depth")),
    )
    with pytest.raises(NetworkError, match=r"depth.card\.yaml: another card of the project has the name tiny, too; re"):
        identities(choice)


def test_a_cluster_measures_only_with_the_network_of_the_machine_that_sent_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = graphs.card(tmp_path, wall_everywhere(), "semantic")
    sent: list[dict[str, Any]] = []
    monkeypatch.setattr(measure_visit, "run_jobs", lambda *_, **asked: sent.append(asked) or iter(()))
    project = replace(read_project(write_project(tmp_path, plain())), networks=NetworkChoice(segment=str(path)))
    measure_visit.measure_stations([], "measure", project, rig_of(site()[1]), Workplace(), lambda *_: None)
    here = sent[0]["identity"]
    work = SameCode(work=abs, identity=here(), own=here)
    assert work(-3) == 3
    graphs.card(tmp_path, graphs.echo(3), "semantic")  # an older one, as a worker may still have it
    with pytest.raises(
        OutputError, match=r"a Dask worker has the network tiny .*, this machine has .*copy your networks"
    ):
        work(-3)
    path.unlink()
    with pytest.raises(OutputError, match=r"a Dask worker lacks what this machine has: network card .*card\.yaml"):
        work(-3)


def test_a_plugin_that_never_answers_costs_its_station_alone_with_one_worker_too(
    example_package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    endless = "import time\n\n\nclass Halves:\n    def segment(self, pair, depth):\n        time.sleep(3600.0)\n"
    (example_package / "asbuilt_bim_example/segmenter.py").write_text(endless, encoding="utf-8")
    monkeypatch.setattr(measure_visit, "_STATION", Limits(seconds=15.0, memory_bytes=math.inf))
    job = StationJob(photos=photos(), rig=rig_of(site()[1]), options=FREE, networks=PLUGIN)
    assert measure_visit.measure_apart(job) == WorkerLoss(limit_s=15.0)


@pytest.mark.parametrize("workers", [1, 2])
def test_stations_with_a_plugin_are_measured_where_they_can_be_ended(
    example_package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, workers: int
) -> None:
    sent: list[Any] = []
    monkeypatch.setattr(measure_visit, "run_jobs", lambda work, *_, **__: sent.append(work) or iter(()))
    project = read_project(write_project(tmp_path, plain()))
    for chosen in (project, replace(project, networks=PLUGIN)):
        place = Workplace(workers=workers)
        measure_visit.measure_stations([], "measure", chosen, rig_of(site()[1]), place, lambda *_: None)
    assert sent == [measure_job, measure_visit.measure_apart if workers == 1 else measure_job]
    job = StationJob(photos=photos(), rig=rig_of(site()[1]), options=FREE, networks=PLUGIN)
    found = sent[1](job)
    assert isinstance(found, StationMeasurement), "it is measured there as well"


def test_a_station_measured_with_a_network_says_who_found_its_faces(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, wall_everywhere(), "semantic", activation="softmax")
    choice = NetworkChoice(segment=str(path))
    job = StationJob(photos=photos(), rig=rig_of(site()[1]), options=FREE, networks=choice)
    found = measure_job(job)
    assert isinstance(found, StationMeasurement)
    assert {(face.source, face.segmenter) for face in found.faces} == {(InstanceSource.BOTH, "tiny")}
    assert found.before_px is not None, "what stands before its faces is looked for in its own task"
    plain_one = measure_station(photos(), rig_of(site()[1]), FREE)
    assert isinstance(plain_one, StationMeasurement)
    assert {face.source for face in plain_one.faces} == {InstanceSource.GEOMETRY}
    whole = [sum(face.whole for face in one.faces) for one in (found, plain_one)]
    assert whole[0] >= whole[1] >= 5, "what geometry finds whole by colour too, the network's word lets stand"


def test_a_fused_depth_map_comes_from_the_projects_depth_network(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, graphs.echo(), "inverse-depth")  # how bright it is: no depth at all
    models = load_models(NetworkChoice(depth=str(path)))
    found = measure_station(photos(), rig_of(site()[1]), replace(FREE, depth="fused"), models=models)
    assert not isinstance(found, StationMeasurement)
    assert found.rejections[-1].code is Reason.DEPTH_FAILED
    assert "doesn't follow this picture" in str(found.rejections[-1].values["detail"])
