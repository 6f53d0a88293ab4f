"""What a training picture says of itself: classes, instances, depth, and that a seed draws it again."""

import os
from pathlib import Path

import numpy as np
import pytest
from asbuilt_synthetic.meshes import box

from asbuilt_training.__main__ import main
from asbuilt_training.classes import BACKGROUND, COLUMN, OTHER, SLAB, WALL
from asbuilt_training.images import looks, shards
from asbuilt_training.images.cameras import views
from asbuilt_training.images.draw import HEIGHT_PX, WIDTH_PX, View, draw
from asbuilt_training.images.elements import column, erect, slab, wall
from asbuilt_training.images.real_ifc import ifc_files, shapes
from asbuilt_training.images.stage import Stage
from asbuilt_training.images.things import Place, Thing, numbered
from asbuilt_training.images.yards import yard_place

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).parents[3] / "shared/data"))


@pytest.fixture(autouse=True)
def few_patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """One small pattern of each family: what is tested here isn't looks."""
    monkeypatch.setattr(looks, "_POOL", {name: (1, 64, 0.05) for name in looks._POOL})
    looks.pool.cache_clear()


def place() -> Place:
    """A wall 5 m before the camera, left, a column 3 m before it, right, and a thin bar between, on open ground."""
    rng = np.random.default_rng(0)
    things = erect(wall((5.0, 0.3), np.pi / 2, 3.0, 0.2, 2.5), 1.0, 7, rng, finished=True)[:1]
    things += erect(column((3.25, -0.8), 0.0, (0.5, 0.5), 2.0), 1.0, 4, rng, finished=True)[:1]
    things.append(Thing(part=box("Bar", (3.0, -0.004, 0.0), (3.01, 0.004, 3.0), "rebar"), kind=OTHER))
    things.append(Thing(part=box("Ground", (-50, -50, -1), (50, 50, 0), "ground"), kind=BACKGROUND))
    return Place(source="test", things=numbered(things))


def ahead(fx_px: float = 300.0) -> View:
    """Look along x from 1.5 m, held level."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0, 0, 1.0], [-1, 0, 0], [0, -1, 0]])
    pose[2, 3] = 1.5
    return View(world_from_camera=pose, fx_px=fx_px)


def test_classes_instances_and_inverse_depth_of_a_pixel_are_of_the_same_thing() -> None:
    stage = Stage(place(), looks.pool(0), np.random.default_rng(1))
    made = draw(stage, ahead(), np.random.default_rng(2))
    assert made.radiance.shape == (HEIGHT_PX, WIDTH_PX, 3)
    assert np.isfinite(made.radiance).all()
    assert made.radiance.min() >= 0
    row = HEIGHT_PX // 2
    wall_px, column_px = (row, WIDTH_PX // 2 - 80), (row, WIDTH_PX // 2 + 80)
    assert (made.kind[wall_px], made.kind[column_px]) == (WALL, COLUMN)
    assert (made.instance[wall_px], made.instance[column_px]) == (1, 2)
    assert made.inverse_depth_per_m[wall_px] == pytest.approx(1 / 4.9, rel=1e-3)
    assert made.inverse_depth_per_m[column_px] == pytest.approx(1 / 3.0, rel=1e-3)
    assert ((made.instance > 0) == np.isin(made.kind, (WALL, COLUMN))).all()
    assert (made.inverse_depth_per_m[0] == 0).any(), "over the wall there is sky"
    front = np.abs(made.inverse_depth_per_m[row] - 1 / 3.0) < 1e-3
    width = int((front & (made.instance[row] == 2)).sum())
    assert width == pytest.approx(300 * 0.5 / 3.0, abs=1), "a column of 0.5 m at 3 m"


def test_up_points_up_in_the_cameras_own_frame() -> None:
    stage = Stage(place(), looks.pool(0), np.random.default_rng(1))
    made = shards._picture(draw(stage, ahead(), np.random.default_rng(2)), ahead(), "test", np.random.default_rng(3))
    assert made.up == pytest.approx([0, -1, 0])
    assert made.rgb.dtype == np.uint8
    assert made.inverse_depth.dtype == np.float16


def test_a_bar_of_a_pixels_width_and_a_speck_of_concrete_are_ignored() -> None:
    kind = np.full((20, 20), BACKGROUND, np.uint8)
    instance = np.zeros((20, 20), np.uint16)
    kind[:, 5], kind[5:15, 10:15] = OTHER, OTHER
    kind[0:2, 17:19], instance[0:2, 17:19] = WALL, 3
    told, numbers = shards._learnable(kind, instance)
    assert (told[:, 5] == shards.IGNORED).all()
    assert (told[6:14, 11:14] == OTHER).all()
    assert (told[0:2, 17:19] == shards.IGNORED).all()
    assert not numbers.any()


def test_the_same_seed_draws_the_same_bytes_and_another_seed_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shards, "places", lambda seed, _: [yard_place(np.random.default_rng(seed))])
    first, again, other = (next(iter(shards.pictures(seed, shards.Job(pictures_a_place=1)))) for seed in (11, 11, 12))
    for name in ("rgb", "kind", "instance", "inverse_depth", "up"):
        assert np.array_equal(getattr(first, name), getattr(again, name)), name
    assert not np.array_equal(first.rgb, other.rgb)


def test_views_hold_concrete_and_nothing_stands_before_the_lens() -> None:
    stage = Stage(place(), looks.pool(0), np.random.default_rng(1))
    rng = np.random.default_rng(5)
    seen = [draw(stage, view, rng) for view in views(stage, 6, rng)]
    assert len(seen) >= 4
    assert all(1 / made.inverse_depth_per_m.max() > 0.2 for made in seen)
    assert sum((np.isin(made.kind, (WALL, COLUMN)).mean() > 0.01) for made in seen) >= 3


def test_a_shard_holds_what_was_drawn_or_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Stage(place(), looks.pool(0), np.random.default_rng(1))
    made = shards._picture(draw(stage, ahead(), np.random.default_rng(2)), ahead(), "test", np.random.default_rng(3))
    path = shards.shard_path(tmp_path, 7)
    with monkeypatch.context() as broken:
        broken.setattr(np.lib.format, "write_array", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
        with pytest.raises(OSError, match="disk full"):
            shards.write_shard(path, [made])
    assert not path.exists()
    shards.write_shard(path, [made, made])
    with np.load(path, allow_pickle=False) as shard:
        assert shard["rgb"].shape == (2, HEIGHT_PX, WIDTH_PX, 3)
        assert np.array_equal(shard["instance"][1], made.instance)
        assert shard["source"].tolist() == ["test", "test"]


def test_an_element_that_is_not_poured_shows_its_bars_or_forms_and_no_concrete() -> None:
    for seed in range(6):
        things = erect(wall((0, 0), 0.0, 3.0, 0.2, 2.5), 0.0, 1, np.random.default_rng(seed))
        assert things
        assert not {t.kind for t in things} & {WALL, COLUMN}
    assert {t.kind for t in erect(slab((0, 0), (4, 4), 0.2, 0.2), 1.0, 1, np.random.default_rng(0))} == {SLAB}


@pytest.mark.parametrize("seeds", ["1000", "9:3", "a:b", "0:4"])
def test_a_range_of_seeds_that_is_none_is_refused_as_wrong_usage(
    seeds: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(["images", "--out", str(tmp_path), "--seeds", seeds])
    assert end.value.code == 2
    assert "no range of seeds" in capsys.readouterr().err


def test_steel_sections_and_thin_skins_of_real_files_are_no_concrete() -> None:
    files = [f for f in ifc_files(DATA / "ifc") if f.name == "example.ifc"]
    if not files:
        pytest.skip("no real IFC files here")
    kinds = [s.kind for s in shapes(files[0])]
    assert kinds.count(WALL) == 17
    assert 0 < kinds.count(COLUMN) <= 12, "42 columns, 12 of them of concrete"


def test_a_path_traced_picture_lies_on_the_same_masks_as_the_ray_cast_one(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("bpy", reason="the path tracer needs Blender's Python wheel")
    from asbuilt_training.images import traced

    monkeypatch.setattr(traced, "SAMPLES", 8)
    stage = Stage(place(), looks.pool(0), np.random.default_rng(1))
    cast = draw(stage, ahead(), np.random.default_rng(2))
    made = traced.trace(stage, ahead(), np.random.default_rng(2))
    assert np.array_equal(made.kind, cast.kind)
    assert np.array_equal(made.instance, cast.instance)
    sky = made.inverse_depth_per_m == 0
    top = np.log(made.radiance.mean(2) + 1e-3)
    step = np.abs(np.diff(top[:, WIDTH_PX // 2 + 80]))
    edge = int(np.flatnonzero(np.diff(sky[:, WIDTH_PX // 2 + 80].astype(int)))[0])
    assert abs(int(step[: edge + 20].argmax()) - edge) <= 1, "the column's top is where its mask ends"
