"""What the network is given and asked, in closed form; and that it learns, is kept, and comes back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from asbuilt_training.averaged import Averaged  # noqa: E402
from asbuilt_training.figures import depth_errors  # noqa: E402
from asbuilt_training.fit import Plan, Run, rate_at  # noqa: E402
from asbuilt_training.loader import collate  # noqa: E402
from asbuilt_training.losses import bond_loss, class_loss, depth_loss, offset_loss, thing_loss  # noqa: E402
from asbuilt_training.mean import mean_of  # noqa: E402
from asbuilt_training.model import ConcreteNet  # noqa: E402
from asbuilt_training.samples import Recipe, centre_offsets, plain_sample, training_sample  # noqa: E402
from asbuilt_training.shards import Picture, Pool, read_shard, sources_of  # noqa: E402
from asbuilt_training.stereo import stereo_of  # noqa: E402

HEIGHT, WIDTH = 96, 128
RECIPE = Recipe(width_px=WIDTH, height_px=HEIGHT)


def _picture(rng: np.random.Generator) -> Picture:
    """Return a wall 4 m off before a ground 1.6 m below, under the sky."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    inverse = np.where(rows > 48, (rows - 48) / (120.0 * 1.6), 0.0).astype(np.float32)
    wall = (columns > 40) & (columns < 100) & (rows > 20) & (rows < 90)
    inverse[wall] = 0.25
    kind, instance = wall.astype(np.uint8), np.where(wall, 7, 0).astype(np.uint16)
    rgb = np.where(wall[..., None], 150, 90) + rng.integers(-20, 20, (HEIGHT, WIDTH, 3))
    return Picture(
        rgb=rgb.astype(np.uint8), kind=kind, instance=instance, inverse_depth_per_m=inverse, fx_px=120.0, fy_px=120.0,
        cx_px=(WIDTH - 1) / 2, cy_px=(HEIGHT - 1) / 2, left_px=np.arange(WIDTH, dtype=np.float32) + 0.5,
        baseline_m=0.4, up=np.array([0.1, -0.99, 0.05]),
    )  # fmt: skip


def _write_shard(path: Path, count: int = 6) -> None:
    pictures = [_picture(np.random.default_rng(k)) for k in range(count)]
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(
        path,
        rgb=np.stack([p.rgb for p in pictures]), kind=np.stack([p.kind for p in pictures]),
        instance=np.stack([p.instance for p in pictures]),
        inverse_depth=np.stack([p.inverse_depth_per_m for p in pictures]).astype(np.float16),
        fx_px=np.full(count, 120, np.float32), baseline_m=np.full(count, 0.4, np.float32),
        up=np.tile(np.array([0, -1, 0], np.float32), (count, 1)), source=np.array(["test"] * count),
    )  # fmt: skip


def test_stereo_knows_nothing_of_the_sky_nor_of_what_the_other_camera_does_not_see() -> None:
    inverse = np.full((40, 120), 0.1, dtype=np.float32)
    inverse[:, 60:80] = 0.5  # 20 px of disparity against 4: the 16 px left of it are hidden
    inverse[:10] = 0.0
    grey = np.random.default_rng(0).integers(0, 255, (40, 120), dtype=np.uint8)
    known = np.zeros(inverse.shape)
    for seed in range(60):
        left = np.arange(120, dtype=np.float32) + 0.5
        rng = np.random.default_rng(seed)
        known += stereo_of(rng, inverse, grey, bf_px_m=40.0, left_px=left) > 0.0
    assert known[:10].max() <= 12  # a blunder now and then
    assert known[15:, 46:58].mean() < 0.35 * known[15:, 85:115].mean()  # fattened over, filled, or blundered at times
    assert known[15:, :3].mean() < 0.5 * known[15:, 85:115].mean()


def test_stereo_of_a_plain_wall_is_off_by_little() -> None:
    inverse = np.full((60, 100), 0.2, dtype=np.float32)
    grey = np.random.default_rng(0).integers(0, 255, (60, 100), dtype=np.uint8)
    left = np.arange(100, dtype=np.float32) + 50.0
    found = [stereo_of(np.random.default_rng(s), inverse, grey, bf_px_m=40.0, left_px=left) for s in range(30)]
    off_px = [np.median(np.abs(one[one > 0] - 0.2)) * 40.0 for one in found if (one > 0).any()]
    assert len(off_px) >= 28
    assert np.median(off_px) < 0.15


def test_offsets_point_to_the_middle_of_each_thing() -> None:
    kind, instance = np.zeros((20, 30), np.uint8), np.zeros((20, 30), np.uint16)
    kind[2:7, 4:13], instance[2:7, 4:13] = 1, 3
    kind[10:19, 20:23], instance[10:19, 20:23] = 2, 9
    offsets = centre_offsets(kind, instance).astype(np.float32) * 16.0  # from 32 px of the input to pixels of the map
    assert offsets[:, 2, 4] == pytest.approx((4.0, 2.0), abs=0.01)
    assert offsets[:, 18, 22] == pytest.approx((-1.0, -4.0), abs=0.01)
    assert np.isnan(offsets[:, 0, 0]).all()


def test_a_crop_keeps_the_place_of_each_point_in_space() -> None:
    picture = _picture(np.random.default_rng(0))
    sample = plain_sample(np.random.default_rng(1), picture, with_geometry=True)
    assert sample.geometry.shape == (5, HEIGHT, WIDTH)
    on_wall = sample.geometry[:, 40, 80].astype(float)
    assert on_wall[0] == pytest.approx(0.5, abs=0.15)  # 2 m / 4 m
    mirrored = picture.mirrored()
    assert mirrored.up[0] == -picture.up[0] and mirrored.kind[50, WIDTH - 1 - 45] == picture.kind[50, 45]


def test_every_example_has_its_shapes_and_depth_alone_where_geometry_is_absent() -> None:
    rng = np.random.default_rng(3)
    for _ in range(8):
        sample = training_sample(rng, _picture(rng), RECIPE)
        assert sample.image.shape == (HEIGHT, WIDTH, 3) and sample.image.dtype == np.uint8
        assert sample.offsets.shape == (2, HEIGHT // 2, WIDTH // 2)
        assert sample.has_geometry or not sample.geometry.any()


def test_no_geometry_and_geometry_of_zeros_are_the_same() -> None:
    net = ConcreteNet().eval()
    image = torch.randn(1, 3, 64, 64)
    for one, other in zip(net(image, None), net(image, torch.zeros(1, 5, 64, 64)), strict=True):
        assert torch.equal(one, other)


def test_the_class_loss_is_small_for_the_truth_and_counts_nothing_ignored() -> None:
    kind = torch.randint(0, 6, (2, 8, 8)).repeat_interleave(2, 1).repeat_interleave(2, 2)
    logits = torch.nn.functional.one_hot(kind[:, ::2, ::2], 6).permute(0, 3, 1, 2).float() * 20.0
    weight, even = torch.ones_like(kind).float(), torch.ones(6)
    assert class_loss(logits, kind, weight, even) < 0.01
    wrong = logits.roll(1, dims=1)
    assert class_loss(wrong, kind, weight, even) > 5.0
    ignored = torch.full_like(kind, 255)
    assert class_loss(wrong, ignored, weight, even).item() == pytest.approx(0.0, abs=1e-6)


def test_the_offset_loss_asks_nothing_off_the_walls() -> None:
    target = torch.full((1, 2, 4, 4), float("nan"))
    target[:, :, 1, 1] = 2.0
    assert offset_loss(torch.zeros(1, 2, 4, 4), target).item() == pytest.approx(2.0)


def test_the_bond_loss_is_small_where_things_are_told_apart_and_asks_nothing_off_them() -> None:
    thing = torch.zeros(1, 12, 12, dtype=torch.int32)
    thing[:, :, :6], thing[:, 6:, 6:] = 4, 9
    right, below = torch.full((1, 12, 12), 20.0), torch.full((1, 12, 12), 20.0)
    right[:, 6:, 4:6] = -20.0  # two to the right stands the other thing
    bonds = torch.stack([right, below, right, below, right, below], dim=1)
    bonds[:, 2, 6:] = -20.0  # eight to the right, too
    assert bond_loss(bonds, thing) < 1e-3
    assert bond_loss(-bonds, thing) > 5.0
    assert bond_loss(-bonds, torch.zeros_like(thing)).item() == 0.0


def test_the_thing_loss_counts_a_small_thing_as_much_as_a_large_one() -> None:
    kind, thing = torch.zeros(1, 40, 40, dtype=torch.long), torch.zeros(1, 20, 20, dtype=torch.int32)
    kind[:, :, :20], thing[:, :, :10] = 1, 1
    kind[:, 10:20, 30:], thing[:, 5:10, 15:] = 2, 2
    logits = torch.zeros(1, 6, 20, 20)
    logits[:, 1], logits[:, :, :, 15:] = 9.0, 0.0
    logits[:, 2, :, 15:] = 9.0
    right = thing_loss(logits, kind, thing)
    small_wrong, large_wrong = logits.clone(), logits.clone()
    small_wrong[:, 1:3, :, 15:] = logits[:, [2, 1], :, 15:]
    large_wrong[:, 1:3, :, :10] = logits[:, [2, 1], :, :10]
    assert right < 0.01 < 3.0 < thing_loss(small_wrong, kind, thing)
    assert thing_loss(small_wrong, kind, thing).item() == pytest.approx(thing_loss(large_wrong, kind, thing).item())


def test_the_depth_loss_does_not_see_scale_but_sees_a_wrong_order() -> None:
    true = torch.rand(3, 40, 40) * 0.5 + 0.05
    log = true.log() - true.log().mean()
    assert depth_loss(log, true) < 1e-4
    assert depth_loss(log + 2.0, true).item() == pytest.approx(0.04, abs=1e-3)  # held near 0, by little
    assert depth_loss(-true.log(), true) > 1.0
    sky = torch.zeros(1, 40, 40)
    sky[:, 20:] = 0.2
    near, far = torch.zeros(1, 40, 40), torch.where(sky > 0, 0.0, -9.0)
    far = far - far.mean()
    assert depth_loss(far, sky) < 1e-4 < depth_loss(near, sky)
    assert depth_errors((2.0 * true[0] - 1.0).numpy(), true[0].numpy()) == pytest.approx((0.0, 1.0), abs=1e-5)


def test_the_average_follows_the_network() -> None:
    net = torch.nn.Linear(2, 2)
    average = Averaged(net)
    with torch.no_grad():
        net.weight.fill_(1.0)
    for _ in range(8000):
        average.update(net)
    assert torch.allclose(average.net.weight, net.weight, atol=0.02)


def test_the_mean_of_weights_lies_between_them_and_keeps_what_only_one_has() -> None:
    one, other = {"a": torch.tensor([4.0]), "n": torch.tensor(7), "new": torch.ones(1)}, {"a": torch.tensor([0.0])}
    found = mean_of(one, other | {"n": torch.tensor(3)}, 0.75)
    assert (found["a"].item(), found["n"].item(), found["new"].item()) == (3.0, 7, 1.0)


def test_steps_are_small_at_both_ends() -> None:
    assert rate_at(0.0, 1.0) < 0.1 and rate_at(0.03, 1.0) == pytest.approx(1.0, abs=0.01) and rate_at(1.0, 1.0) < 1e-3


def test_a_run_learns_is_kept_and_goes_on(tmp_path: Path) -> None:
    _write_shard(tmp_path / "valid" / "0.npz")
    plan = Plan(data="", valid=str(tmp_path / "valid"), minutes=1.0)
    run = Run(plan, tmp_path / "run", resume=False)
    rng = np.random.default_rng(0)
    batch = collate([training_sample(rng, _picture(rng), RECIPE) for _ in range(4)])
    run.spent_s = 3.0
    losses = [sum(run.one_step(batch)) for _ in range(12)]
    assert min(losses[-3:]) < 0.8 * losses[0]
    run.keep(tmp_path / "run" / "last.pt")
    again = Run(plan, tmp_path / "run", resume=True)
    assert again.step == 12 and again.spent_s == 3.0
    for one, other in zip(again.net.parameters(), run.net.parameters(), strict=True):
        assert torch.equal(one, other)


def test_a_shard_that_lacks_its_truth_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "bad.npz", rgb=np.zeros((1, 4, 4, 3), np.uint8))
    with pytest.raises(ValueError, match="has no kind"):
        read_shard(tmp_path / "bad.npz")


def test_shards_that_come_later_are_found(tmp_path: Path) -> None:
    _write_shard(tmp_path / "a.npz", 2)
    pool = Pool(tmp_path)
    assert pool.refresh() == 2
    _write_shard(tmp_path / "b.npz", 3)
    assert pool.refresh() == 5 and sources_of(tmp_path) == {"test": 5}
    assert len(list(pool.pictures(np.random.default_rng(0)))) == 5
