"""A cell in an OpenUSD file: parts stand where usd-core's own rules put them, and a file that names
others, or harms its reader, is refused."""

import numpy as np
import place_rings as pr
import pytest
from place_rings.formats import optional_dependencies
from place_rings.formats.loader import read_scene
from place_rings.formats.mesh_readers.mesh_numbers import MOST_PARTS, MeshError
from place_rings.formats.mesh_readers.usd import usd_parts
from place_rings.formats.scene_meshes import parts_in
from pxr import Gf, Sdf, Usd, UsdGeom
from scipy.spatial.transform import Rotation

from ..support.refusals import refused

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]])
COUNTS, FACES = [4, 3, 3, 3, 3], [0, 3, 2, 1, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]  # a pyramid


def stage_of(unit=1.0, up="Z"):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    return stage


def pyramid(stage, path):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, c)) for c in CORNERS])
    mesh.CreateFaceVertexCountsAttr(COUNTS)
    mesh.CreateFaceVertexIndicesAttr(FACES)
    return mesh


def read(stage):
    return usd_parts(stage.GetRootLayer().ExportToString().encode())


def volume(triangles):
    return np.linalg.det(triangles).sum() / 6


def extent(triangles):
    return triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))


@pytest.mark.parametrize("ending", ["usda", "usdc", "usd"])
def test_a_cube_in_cm_with_y_up_is_an_obstacle_in_m_with_z_up(tmp_path, ending):
    stage = stage_of(0.01, "Y")
    UsdGeom.Cube.Define(stage, "/cell/box").CreateSizeAttr(100)
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/cell/box")).SetTranslate((300, 50, 20))
    pyramid(stage, "/cell/walkway")
    stage.Export(str(tmp_path / f"cell.{ending}"))
    text = f'obstacles = [{{ file = "cell.{ending}", parts = ["*", "!walkway"] }}]'
    (tmp_path / "scene.toml").write_text(text)
    (box,) = read_scene(tmp_path / "scene.toml").obstacles
    assert box.name == "box"
    points = np.array(box.points)
    np.testing.assert_allclose([points.min(0), points.max(0)], [[2.5, -0.7, 0], [3.5, 0.3, 1]])
    mesh = pr.Mesh.load(tmp_path / f"cell.{ending}", parts=["walkway"])
    corners = np.array(mesh.vertices)
    wanted = [[0, -0.01, 0], [0.01, 0, 0.01]]
    np.testing.assert_allclose([corners.min(0), corners.max(0)], wanted, atol=1e-8)


def test_transforms_nest_mirrors_and_orientation_keep_faces_outward():
    stage = stage_of()
    group = UsdGeom.Xform.Define(stage, "/group")
    group.AddTranslateOp().Set((1, 2, 3))
    group.AddRotateXYZOp().Set((10, 20, 30))
    pyramid(stage, "/group/a").AddScaleOp().Set((2, -1, 1))
    turned = pyramid(stage, "/group/b")
    turned.CreateOrientationAttr("leftHanded")
    turned.SetResetXformStack(True)
    parts = read(stage)
    assert list(parts) == ["group/a", "group/b"]
    R = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)
    wanted = R.apply(CORNERS * [2, -1, 1]) + np.array([1, 2, 3])
    made = np.unique(parts["group/a"].reshape(-1, 3).round(9), axis=0)
    np.testing.assert_allclose(made, np.unique(wanted.round(9), axis=0), atol=1e-8)
    assert volume(parts["group/a"]) == pytest.approx(2 / 3)
    assert volume(parts["group/b"]) == pytest.approx(-1 / 3)
    np.testing.assert_allclose(extent(parts["group/b"]), [[0, 0, 0], [1, 1, 1]])


def test_round_shapes_have_their_extents_and_volumes():
    stage, along = stage_of(), dict(zip("XYZ", np.eye(3), strict=True))
    volumes = {
        "Sphere": np.pi * 4 / 3,
        "Cylinder": 3 * np.pi,
        "Cone": np.pi,
        "Capsule": np.pi * (4 / 3 + 3),
    }
    shapes = [(kind, axis) for kind in volumes for axis in along]
    for kind, axis in shapes:
        prim = getattr(UsdGeom, kind).Define(stage, f"/{kind}_{axis}")
        prim.CreateRadiusAttr(1)
        if kind != "Sphere":
            prim.CreateHeightAttr(3)
            prim.CreateAxisAttr(axis)
    halves = {"Sphere": 1, "Cylinder": 1.5, "Cone": 1.5, "Capsule": 2.5}
    made = read(stage)
    for kind, axis in shapes:
        far = 1 + (halves[kind] - 1) * along[axis]
        np.testing.assert_allclose(extent(made[f"{kind}_{axis}"]), [-far, far], atol=1e-9)
        assert 0.97 < volume(made[f"{kind}_{axis}"]) / volumes[kind] < 1


def test_guides_and_what_is_invisible_are_left_out():
    stage = stage_of()
    for name in ("shown", "guide/a", "hidden/a"):
        UsdGeom.Cube.Define(stage, f"/{name}")
    UsdGeom.Imageable(UsdGeom.Xform.Define(stage, "/guide")).CreatePurposeAttr("guide")
    UsdGeom.Imageable(UsdGeom.Xform.Define(stage, "/hidden")).MakeInvisible()
    UsdGeom.BasisCurves.Define(stage, "/edges")
    parts = read(stage)
    assert {name: len(part) for name, part in parts.items()} == {"shown": 12, "edges": 0}


def test_instances_stand_where_they_are_placed():
    stage = stage_of()
    UsdGeom.Cube.Define(stage, "/shape/cube")
    stage.GetPrimAtPath("/shape").SetSpecifier(Sdf.SpecifierClass)
    for i in range(2):
        copy = UsdGeom.Xform.Define(stage, f"/copy_{i}")
        copy.AddTranslateOp().Set((5 * i, 0, 0))
        copy.GetPrim().GetReferences().AddInternalReference("/shape")
        copy.GetPrim().SetInstanceable(True)
    parts = read(stage)
    assert list(parts) == ["copy_0/cube", "copy_1/cube"]
    assert extent(parts["copy_1/cube"])[1].tolist() == [6, 1, 1]


def test_our_own_export_is_read_back(tmp_path):
    sizes = {"table": [0.6, 1.2, 0.2], "post": [0.1, 0.1, 2.0]}
    centres = {"table": [0.9, 0, -0.1], "post": [-0.8, 0.5, 1.0]}
    bodies = [pr.Obstacle(size=sizes[n], centre=centres[n], name=n) for n in sizes]
    scene = pr.Scene("ur10", obstacles=bodies)
    pr.export("n1_3_0", scene, to="usd", folder=tmp_path)
    text = 'obstacles = [{ file = "scene.usda", parts = ["cell"] }]'
    (tmp_path / "scene.toml").write_text(text)
    made = read_scene(tmp_path / "scene.toml").obstacles
    assert len(made) == 2
    for name, body in zip(sizes, made, strict=True):
        points, half = np.array(body.points), np.array(sizes[name]) / 2
        wanted = [centres[name] - half, centres[name] + half]
        np.testing.assert_allclose([points.min(0), points.max(0)], wanted, atol=1e-6)


def test_a_stage_that_names_other_files_is_refused(tmp_path):
    other = tmp_path / "other.usda"
    stage = Usd.Stage.CreateNew(str(other))
    UsdGeom.Cube.Define(stage, "/a/cube")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/a"))
    stage.Save()
    for arc in ("reference", "payload", "sublayer", "variant", "clips"):
        stage = stage_of()
        UsdGeom.Cube.Define(stage, "/own")
        prim = stage.DefinePrim("/a")
        if arc == "reference":
            prim.GetReferences().AddReference(str(other))
        elif arc == "payload":
            prim.GetPayloads().AddPayload(str(other))
        elif arc == "sublayer":
            stage.GetRootLayer().subLayerPaths.append(str(other))
        elif arc == "variant":
            sets = prim.GetVariantSets().AddVariantSet("v")
            sets.AddVariant("x")
            sets.SetVariantSelection("x")
            with sets.GetVariantEditContext():
                prim.GetReferences().AddReference(str(other))
        else:
            clips = Usd.ClipsAPI(prim)
            clips.SetClipAssetPaths([Sdf.AssetPath(str(other))])
            clips.SetClipPrimPath("/a")
        (tmp_path / "cell.usda").write_text(stage.GetRootLayer().ExportToString())
        (tmp_path / "scene.toml").write_text('obstacles = [{ file = "cell.usda" }]')
        with refused("scene.toml", "obstacles[0].file", "cell.usda"):
            read_scene(tmp_path / "scene.toml")


BOMB = "".join(
    f'def "p{i}" {{\n'
    + "".join(f'def "c{k}" (references = </p{i + 1}>) {{}}\n' for k in range(10))
    + "}\n"
    for i in range(12)
)
BAD = {
    "empty": b"",
    "archive": b"PK\3\4",
    "text": b"#usda 1.0\ndef {",
    "cut": b"PXR-USDC" + bytes(60),
    "deep": b"#usda 1.0\n" + b'def "a"\n{\n' * 500_000,
    "many": b"#usda 1.0\n" + b"".join(b'def "a%d"{}\n' % i for i in range(MOST_PARTS + 2)),
    "corner": b'#usda 1.0\ndef Mesh "a" {\npoint3f[] points = [(0, 0, 0)]\n'
    b"int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n}",
    "infinite": b'#usda 1.0\ndef Cube "a" {\ndouble size = inf\n}',
    "unit": b'#usda 1.0\n(metersPerUnit = 0)\ndef Cube "a" {}',
}


@pytest.mark.parametrize("kind", BAD)
def test_a_damaged_or_harmful_file_is_refused(kind):
    with pytest.raises(MeshError):
        usd_parts(BAD[kind])


@pytest.mark.parametrize("kind", ["NurbsPatch", "PointInstancer"])
def test_a_surface_that_is_not_read_is_refused_only_where_it_is_chosen(tmp_path, kind):
    stage = stage_of()
    pyramid(stage, "/tent")
    stage.DefinePrim("/sail", kind)
    stage.GetRootLayer().Export(str(tmp_path / "cell.usda"))
    rest = parts_in("here", "cell.usda", (tmp_path / "cell.usda").read_bytes(), ["*", "!sail"])
    assert list(rest) == ["tent"]
    for patterns in ((), ["sail"]):
        with refused("cell.usda", "sail", kind):
            parts_in("here", "cell.usda", (tmp_path / "cell.usda").read_bytes(), patterns)


@pytest.mark.slow
def test_references_that_multiply_are_refused():
    with pytest.raises(MeshError):
        usd_parts(b"#usda 1.0\n" + BOMB.encode())


def test_without_its_library_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(optional_dependencies, "find_spec", lambda name: None)
    (tmp_path / "cell.usd").write_text("#usda 1.0\n")
    (tmp_path / "scene.toml").write_text('obstacles = [{ file = "cell.usd" }]')
    with refused("scene.toml", "obstacles[0].file", "cell.usd", "place-rings[usd]"):
        read_scene(tmp_path / "scene.toml")
