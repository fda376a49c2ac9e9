"""Weight fields: exact counts against dense sums, limits where they agree with plain targets, and
intervals that hold the truth."""

import io
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.targets.combined import IntersectionOf
from place_rings.coverage.targets.named import Shell, ToolSphere
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import voxels
from place_rings.coverage.voxels.sample_points import samples_of
from place_rings.coverage.voxels.weighted_voxels import important
from place_rings.coverage.weight_field import LEVELS, WeightField, weights_of
from place_rings.formats.loader import read_scene, read_target
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.scene import Scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.tolerance import exact_zetas, nominal_cones
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_targets import verify_targets
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import places

from ..strategies.units import GENERATORS, failures
from ..strategies.volumes import ANYWHERE
from ..support.scene_tables import reread
from ..support.searching import search

SETUP = named_setup("n2_16_25")
VOXEL = 0.04


def some_field(seed, shape, cell_mm, values, outside):
    rng = np.random.default_rng(seed)
    weights = rng.integers(0, values, shape) / max(values - 1, 1)
    weights.flat[0] = 1.0
    cell = np.array(cell_mm) / 1000
    return WeightField.of(weights, -cell * np.array(shape) / 2, cell, outside / 10)


FIELDS = st.builds(
    some_field,
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.integers(1, 8)] * 3),
    st.tuples(*[st.integers(130, 900)] * 3),
    st.sampled_from([2, 5, 1000]),
    st.sampled_from([0, 0, 3]),
)


def scene_of(*targets):
    return Scene(targets=tuple(t for t in targets), occlusion="ignore", rules=Rules(mount="free"))


def near(field):
    return Shell(0.5, importance=field)


def samples(scene, target, voxel):
    """Sample points of all voxels of the target."""
    wanted = voxels(scene.solid(target, 0), voxel, "sampled")
    keys = [np.arange(a, b) for a, b in zip(wanted.start, wanted.stop, strict=True)]
    return samples_of(np.concatenate(keys), voxel)


def dense(scene, target, voxel):
    """Weights of all voxels of the target, and which of them are covered, one by one."""
    centres = samples(scene, target, voxel)
    field = target.importance
    index = np.floor((centres - field.origin) / field.cell).astype(int)
    inside = ((index >= 0) & (index < field.level.shape)).all(axis=1)
    weight = np.full(len(centres), field.outside)
    weight[inside] = [field.level[tuple(i)] for i in index[inside]]
    return weight, Verifier(scene, voxel).seen(SETUP, 0)(centres) <= 0


@settings(max_examples=8)
@given(FIELDS)
def test_count_is_the_dense_sum(field):
    target = near(field)
    scene = scene_of(target)
    weight, seen = dense(scene, target, VOXEL)
    assume(weight.any())
    verifier = Verifier(scene, VOXEL)
    for _ in range(2):  # the second time by the layers that were kept
        found = verifier.verify(SETUP, target)
        assert found.zeta == int(weight[seen].sum()) / int(weight.sum())
        assert found.target_voxels == (weight > 0).sum()
        assert found.covered_voxels == (seen & (weight > 0)).sum()


@pytest.mark.slow
def test_count_by_regions_is_the_same():
    """Where memory is short, the target is counted region by region."""
    field = WeightField.of(np.random.default_rng(0).random((5, 5, 5)), (-1, -1, 0), (0.4, 0.4, 0.4))
    target = near(field)
    scene = scene_of(target)
    whole = Verifier(scene, 0.03).verify(SETUP, target)
    parts = Verifier(scene, 0.03, memory=6e6)
    assert parts.verify(SETUP, target).zeta == whole.zeta
    assert all(region is not None for _, region in parts.pieces(target, 0))


def test_a_constant_field_is_no_field():
    scene = scene_of(Shell(0.5))
    for field in (
        WeightField.of(np.ones((1, 1, 1)), (0, 0, 0), (1, 1, 1), 1.0),
        WeightField.of(np.full((3, 4, 5), 0.7), (-2, -2, -2), (2, 1, 1)),
    ):
        for rule in ("centre", "touch"):
            plain, same = (
                Verifier(scene, 0.04, rule).verify(SETUP, t) for t in (Shell(0.5), near(field))
            )
            assert (same.zeta, same.target_voxels, same.covered_voxels) == (
                plain.zeta,
                plain.target_voxels,
                plain.covered_voxels,
            )


@settings(max_examples=8)
@given(st.tuples(*[st.integers(-9, 3)] * 3), st.tuples(*[st.integers(2, 9)] * 3))
def test_a_field_of_0_and_1_cuts_the_target(corner, cells):
    """The weights' box lies between the centres of voxels, so both count the same ones."""
    low = np.array(corner) * 0.1
    size = np.array(cells) * 0.1
    field = WeightField.of(np.ones(cells), low, (0.1, 0.1, 0.1))
    box = Box(size, low + size / 2)
    cut = IntersectionOf((Shell(0.5), box), name="cut")
    scene = scene_of(cut, near(field))
    if len(voxels(scene.solid(cut, 0), 0.05)) == 0:
        with pytest.raises(ValueError, match=r"V_S\(0.5\)"):
            Verifier(scene, 0.05).verify(SETUP, near(field))
        return
    expected = Verifier(scene, 0.05).verify(SETUP, cut)
    found = Verifier(scene, 0.05).verify(SETUP, near(field))
    assert (found.zeta, found.target_voxels) == (expected.zeta, expected.target_voxels)


@settings(max_examples=2)
@given(FIELDS)
def test_certified_interval_holds_the_dense_share(field):
    target = near(field)
    scene = scene_of(target)
    assume(len(important(field, voxels(scene.solid(target, 0), 0.03), False)) > 2000)
    fine = Verifier(scene, 0.03).verify(SETUP, target).zeta
    found = Verifier(scene, None, "certified", 0.04).verify(SETUP, target)
    assert found.high - found.low <= 0.04
    assert found.low - 0.01 <= fine <= found.high + 0.01
    wider = Verifier(scene, 0.15, "certified").verify(SETUP, target)
    assert wider.low <= found.high
    assert found.low <= wider.high


def test_certified_weight_of_a_box_is_the_closed_form():
    """A ball's share of a box's weight where the weight is 1, 2 or 3 in slices, exact in the end.

    The box [0, 3] x [0, 1] x [0, 1] has the weights 1, 2, 3 by unit slices; the box [0.5, 2.5] in x
    covers 0.5 + 2 + 1.5 of 6.
    """
    field = WeightField.of(np.array([1.0, 2, 3]).reshape(3, 1, 1), (5, 0, 0), (1, 1, 1))
    whole, part = (Box((w, 1.0, 1.0), (6.5, 0.5, 0.5)).solid(ANYWHERE) for w in (3.0, 2.0))
    found = bracket(whole, part, 0.01, weights=field)
    true = 4 / 6
    assert found.low <= true <= found.high
    assert found.high - found.low <= 0.01


@given(FIELDS, GENERATORS)
def test_bounds_in_cubes_hold(field, rng):
    points, side = rng.uniform(-1.5, 1.5, (40, 3)), float(rng.choice([0.01, 0.1, 0.5]))
    found = field.in_cubes(points, side, 1e-12)
    inside = rng.uniform(-0.5, 0.5, (4000, 3)) * side
    weight = np.stack([field.levels_at(p + inside) for p in points]) / LEVELS
    assert failures(points, found.least <= weight.min(axis=1) + 1e-12) == []
    assert failures(points, found.most >= weight.max(axis=1) - 1e-12) == []
    noise = 5 * weight.std(axis=1) / np.sqrt(4000) + 1e-9
    assert failures(points, found.mean.low <= weight.mean(axis=1) + noise) == []
    assert failures(points, found.mean.high >= weight.mean(axis=1) - noise) == []


@settings(max_examples=5)
@given(FIELDS)
def test_sampled_points_are_as_dense_as_the_weights(field):
    target = near(field)
    scene = scene_of(target)
    weight, seen = dense(scene, target, VOXEL)
    assume((weight > 0).sum() > 1000)
    points = scene.sample(target, 0, 8000, 0)
    assert (field.levels_at(points) > 0).all()
    share = (Verifier(scene).seen(SETUP, 0)(points) <= 0).mean()
    assert abs(share - weight[seen].sum() / weight.sum()) < 0.04
    seed = int(np.random.SeedSequence(0).generate_state(1)[0])
    drawn = TargetPoints(scene, 500, 0).points[0]
    assert np.array_equal(drawn, scene.sample(target, 0, 500, seed))


def test_k_coverage_and_losses_are_weighted():
    rng = np.random.default_rng(0)
    field = WeightField.of(rng.random((6, 6, 6)), (-1.2, -1.2, -0.2), (0.4, 0.4, 0.4))
    target = near(field)
    scene = scene_of(target)
    verifier = Verifier(scene, VOXEL)
    centres = samples(scene, target, VOXEL)
    weight, cones = field.levels_at(centres), verifier.seen(SETUP, 0)
    held = np.stack([cones.part(centres, k) <= 0 for k in range(len(cones))])
    found = redundancy(verifier, SETUP, target, 3)
    for k in (1, 2, 3):
        expected = weight[held.sum(axis=0) >= k].sum() / weight.sum()
        assert found.seen[k - 1] == pytest.approx(expected, abs=1e-12)
    for k in (0, 17, 79):
        rest = np.delete(held, k, axis=0).any(axis=0)
        assert found.without_sensor[k] == pytest.approx(weight[rest].sum() / weight.sum(), abs=1e-9)
    for seen in (1, 2):
        (share,) = exact_zetas(verifier, target, nominal_cones(verifier, SETUP), seen)
        assert share == pytest.approx(found.seen[seen - 1], abs=1e-12)
    assert judge(verifier, SETUP, Criterion(seen=2))[1] == pytest.approx(found.seen[1], abs=1e-12)


def test_weighted_targets_count_among_others():
    field = WeightField.of(np.random.default_rng(1).random((3, 3, 3)), (-1, -1, 0), (0.7, 0.7, 0.7))
    scene = scene_of(near(field), Shell(0.5), ToolSphere())
    verifier, targets = Verifier(scene, VOXEL), [g.target for g in scene.targets]
    together = verify_targets(verifier, SETUP, targets)
    assert [v.zeta for v in together] == [verifier.verify(SETUP, t).zeta for t in targets]
    assert [str(t) for t in targets] == ["V_S(0.5) weighted", "V_S(0.5)", "V_T"]


def test_points_of_the_rod_follow_the_weights():
    field = WeightField.of(np.array([1.0, 3]).reshape(2, 1, 1), (-2, -2, -2), (2, 4, 4))
    scene = scene_of(near(field))
    where = places(scene, near(field), Rod(0.01, 0.0), 0.1).points[0]
    weight, _ = dense(scene, near(field), 0.1)
    assert (field.levels_at(where) > 0).all()
    share = weight[weight == LEVELS].sum() / weight.sum()
    assert abs((where[:, 0] > 0).mean() - share) < 0.1


@settings(max_examples=10)
@given(FIELDS)
def test_there_and_back_through_files(field):
    codec = adapter(WeightField)
    back = codec.validate_python(codec.dump_python(field, mode="json"))
    assert np.array_equal(back.level, field.level)
    assert (back.outside, back.origin, back.cell) == (field.outside, field.origin, field.cell)
    scene = reread(scene_of(near(field)))
    assert scene.targets[0].target == near(field)


def table(file):
    return (
        "name = 'V_S'\nradius = 0.5\n[importance]\norigin = [-1.0, -2.0, 0.0]\n"
        f"cell = [0.5, 0.5, 2.0]\nfile = '{file}'\n"
    )


def test_files_of_weights_read_alike(tmp_path):
    weights = np.array([[0.0, 1.0, 0.5], [0.25, 0.75, 0.1]])  # (X, Y)
    (tmp_path / "a.csv").write_text(
        "# along x\n" + "\n".join(",".join(map(str, row)) for row in weights.T)
    )
    np.save(tmp_path / "b.npy", weights)
    np.savez(tmp_path / "c.npz", weights=weights, other=np.zeros(3))
    np.savez_compressed(tmp_path / "d.npz", weights[..., None])
    fields = []
    for name in ("a.csv", "b.npy", "c.npz", "d.npz"):
        (tmp_path / "target.toml").write_text(table(name))
        fields.append(read_target(tmp_path / "target.toml").target.importance)
        given = pr.weight_field(tmp_path / name, origin=(-1, -2, 0), cell=(0.5, 0.5, 2))
        assert given == fields[-1]
    assert fields[0] == fields[1] == fields[2] == fields[3]
    assert fields[0].weights[1, 2, 0] == pytest.approx(0.1, abs=1e-5)
    lines = table("a.csv").replace("[importance]", "[targets.importance]")
    (tmp_path / "scene.toml").write_text("[[targets]]\n" + lines)
    assert read_scene(tmp_path / "scene.toml").targets[0].target.importance == fields[0]


def npy(array, **keys):
    file = io.BytesIO()
    np.save(file, array, **keys)
    return file.getvalue()


BAD = {
    "none.csv": (None, "none.csv"),
    "text.csv": (b"1 2\n3 x", "row 1"),
    "ragged.csv": (b"1 2\n3", "row 1"),
    "negative.csv": (b"1 -2", "row 0"),
    "nan.csv": (b"1 nan", "row 0"),
    "zero.csv": (b"0 0", "above 0"),
    "empty.csv": (b"", "empty.csv"),
    "image.png": (b"", 'found "image.png"'),
    "objects.npy": (npy(np.array([[{}]], object), allow_pickle=True), "object"),
    "flat.npy": (npy(np.ones(3)), "(3,)"),
    "text.npy": (b"hello", "text.npy"),
    "large.npy": (npy(np.ones((1000, 1000))), "200000"),
    "broken.npz": (b"PK", "broken.npz"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_weights_say_what_is_wrong(name, tmp_path):
    data, found = BAD[name]
    if data is not None:
        (tmp_path / name).write_bytes(data)
    (tmp_path / "target.toml").write_text(table(name))
    with pytest.raises(UserError) as error:
        read_target(tmp_path / "target.toml")
    assert found in str(error.value)
    assert str(error.value).startswith(f"{tmp_path / 'target.toml'}: importance.file: ")


def test_bad_rows_and_several_arrays_without_a_name_are_refused(tmp_path):
    rows = table("a.csv").replace("file = 'a.csv'", "rows = ['1 2', '3']")
    (tmp_path / "target.toml").write_text(rows)
    with pytest.raises(UserError, match=r"target.toml: importance.rows: found .*row 1"):
        read_target(tmp_path / "target.toml")
    np.savez(tmp_path / "two.npz", a=np.ones((2, 2)), b=np.ones((2, 2)))
    with pytest.raises(pr.InputError, match=r"two.npz.*weights"):
        pr.weight_field(tmp_path / "two.npz", cell=(1, 1, 1))


def test_rows_in_layers():
    weights = weights_of(["1 2", "3 4", "5 6", "7 8"], 2)
    assert weights.shape == (2, 2, 2)
    assert weights[1, 0, 0] == 2
    assert weights[0, 1, 0] == 3
    assert weights[0, 0, 1] == 5
    with pytest.raises(ValueError, match="3"):
        weights_of(["1 2", "3 4", "5 6"], 2)


def test_arguments_of_python_are_checked():
    for weights, cell, found in (
        (np.ones(3), (1, 1, 1), "weights.*3"),
        (-np.ones((2, 2)), (1, 1, 1), "weights"),
        (np.ones((2, 2)), (1, 1, 0), "cell"),
        ("nowhere.csv", (1, 1, 1), "nowhere.csv"),
    ):
        with pytest.raises(pr.InputError, match=found):
            pr.weight_field(weights, cell=cell)
    with pytest.raises(pr.InputError, match="importance"):
        pr.Shell(0.5, importance=np.ones((2, 2)))
    field = pr.weight_field(np.ones((2, 2)), cell=(1, 1, 1))
    scene = pr.Scene(targets=[pr.Shell(0.5, importance=field), pr.Shell(0.5)])
    assert [t.importance for t in scene.targets] == [field, None]
    assert replace(scene).targets == scene.targets


def test_a_search_covers_where_the_weight_is():
    """All weight on one side: the layout found for it covers more of it than the one found for the
    whole."""
    field = WeightField.of(np.ones((1, 1, 1)), (0.2, -2, -2), (2, 4, 6))
    whole, side = scene_of(Shell(0.5)), scene_of(near(field))
    rounds = Round(512, 4, 1, 8, 0.2, 8, 1), Round(1024, 2, 2, 8, 0.05, 6, 3)
    found = [search(Space(s, sensors=12), schedule=rounds, voxel=0.05) for s in (whole, side)]
    verifier = Verifier(side, 0.05)
    other, mine = (verifier.verify(f.setup, near(field)).zeta for f in found)
    assert mine > other
    assert found[1].exact == mine
