"""Prims of OpenUSD: frames, shapes, masses and joints, by usd-core."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.solids.capsules import Capsules
from .markup import capsule_shape, turn_to
from .palette import rgb

_STIFFNESS, _DAMPING = 1000.0, 60.0  # 1/s² and 1/s, of a drive that is nearly critically damped


def add_frame(stage: Any, path: str, T: Float[np.ndarray, "4 4"], kind: str = "Xform") -> Any:
    """Add a frame, or a prim of another ``kind``, at a pose (4, 4) m in its parent; return it."""
    from pxr import UsdGeom

    prim = stage.DefinePrim(path, kind)
    _place(UsdGeom.Xformable(prim), T)
    return prim


def _place(made: Any, T: Float[np.ndarray, "4 4"]) -> None:
    from pxr import Gf, UsdGeom

    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    made.AddTranslateOp().Set(Gf.Vec3d(*map(float, T[:3, 3])))
    made.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))


def add_mesh(stage: Any, path: str, mesh: Any, colour: str, opacity: float) -> Any:
    """Add a triangle mesh (of trimesh) in the frame of its parent; return its prim."""
    from pxr import UsdGeom, Vt

    made = UsdGeom.Mesh.Define(stage, path)
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(mesh.vertices, np.float32)))
    faces = np.asarray(mesh.faces, np.int32)
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.asarray(mesh.bounds, np.float32)))
    _show(made, colour, opacity)
    return made.GetPrim()


def add_capsule(stage: Any, path: str, capsule: Capsules, colour: str) -> Any:
    """Add a capsule in the frame of its parent; return its prim."""
    from pxr import UsdGeom, Vt

    T, length, radius = capsule_shape(capsule)
    made = (UsdGeom.Capsule if length else UsdGeom.Sphere).Define(stage, path)
    made.CreateRadiusAttr(radius)
    if length:
        made.CreateHeightAttr(length)
    far = np.array([radius, radius, radius + length / 2])
    made.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([-far, far], np.float32)))
    _place(made, T)
    _show(made, colour, 1.0)
    return made.GetPrim()


def _show(made: Any, colour: str, opacity: float) -> None:
    from pxr import Gf, Vt

    made.CreateDisplayColorAttr(Vt.Vec3fArray([Gf.Vec3f(*rgb(colour))]))
    if opacity < 1:
        made.CreateDisplayOpacityAttr(Vt.FloatArray([opacity]))


def add_collision(prim: Any, hull: bool = False) -> None:
    """Make a shape solid for physics; ``hull``: a mesh, by its convex hull."""
    from pxr import UsdPhysics

    UsdPhysics.CollisionAPI.Apply(prim)
    if hull:
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr("convexHull")


def add_mass(
    prim: Any,
    mass: float,
    centre: Float[np.ndarray, " 3"],
    inertia: Float[np.ndarray, "3 3"],
) -> None:
    """State mass properties in the frame of a prim: kg, m and kg m² about the centre of mass."""
    from pxr import Gf, UsdPhysics

    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # right-handed
    x, y, z, w = map(float, Rotation.from_matrix(axes).as_quat(canonical=True))
    stated = UsdPhysics.MassAPI.Apply(prim)
    stated.CreateMassAttr(float(mass))
    stated.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, centre)))
    stated.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, moments)))
    stated.CreatePrincipalAxesAttr(Gf.Quatf(w, x, y, z))


def add_joint(
    stage: Any,
    path: str,
    links: tuple[str, str],
    origin: Float[np.ndarray, "4 4"],
    axis: Float[np.ndarray, " 3"],
    slides: bool,
    limits: Float[np.ndarray, " 2"] | None,
    value: float,
) -> Any:
    """Add a driven joint that turns about the z axis of its own frames, or slides along it.

    Args:
        stage: the stage.
        path: path of the joint.
        links: paths of the link that carries it and of the one that it moves.
        origin: pose (4, 4) m in the carrying link of the moved link at value 0.
        axis: unit axis (3,) in the moved link.
        slides: whether it is prismatic.
        limits: lowest and highest value, rad or m; None or infinite: no limits.
        value: where it starts, and where its drive holds it, rad or m.
    """
    from pxr import Gf, Sdf, UsdPhysics

    kind = UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint
    unit = 1.0 if slides else math.degrees(1.0)
    made, along = kind.Define(stage, path), np.eye(4)
    along[:3, :3] = turn_to(axis)
    made.CreateAxisAttr("Z")
    for body, link, T in ((0, links[0], origin @ along), (1, links[1], along)):
        x, y, z, w = map(float, Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True))
        getattr(made, f"CreateBody{body}Rel")().SetTargets([link])
        getattr(made, f"CreateLocalPos{body}Attr")(Gf.Vec3f(*map(float, T[:3, 3])))
        getattr(made, f"CreateLocalRot{body}Attr")(Gf.Quatf(w, x, y, z))
    if limits is not None and np.isfinite(limits).all():
        made.CreateLowerLimitAttr(unit * float(limits[0]))
        made.CreateUpperLimitAttr(unit * float(limits[1]))
    prim, way = made.GetPrim(), "linear" if slides else "angular"
    prim.AddAppliedSchema(f"PhysicsJointStateAPI:{way}")  # PhysX starts joints at 0 without it
    start = prim.CreateAttribute(f"state:{way}:physics:position", Sdf.ValueTypeNames.Float, False)
    start.Set(unit * value)
    drive = UsdPhysics.DriveAPI.Apply(prim, way)
    drive.CreateTypeAttr("acceleration")  # it needs no mass, and masses are unknown
    drive.CreateStiffnessAttr(_STIFFNESS)
    drive.CreateDampingAttr(_DAMPING)
    drive.CreateTargetPositionAttr(unit * value)
    return prim


def state(prim: Any, **values: str | float | tuple[int, int] | None) -> None:
    """State parameters of place-rings as attributes ``place_rings:NAME`` of a prim; None is left
    out."""
    from pxr import Gf, Sdf

    types = Sdf.ValueTypeNames
    for name, value in values.items():
        if isinstance(value, str) and value:
            prim.CreateAttribute(f"place_rings:{name}", types.String).Set(value)
        elif isinstance(value, tuple):
            prim.CreateAttribute(f"place_rings:{name}", types.Int2).Set(Gf.Vec2i(*value))
        elif isinstance(value, int):
            prim.CreateAttribute(f"place_rings:{name}", types.Int).Set(value)
        elif isinstance(value, float):
            prim.CreateAttribute(f"place_rings:{name}", types.Double).Set(value)
