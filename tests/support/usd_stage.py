"""Forward kinematics of an OpenUSD stage by the attributes of its physics joints alone, as a
simulator takes them; it knows nothing of the product's chain."""

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation


class UsdArm:
    """The articulation of a stage's default prim."""

    def __init__(self, path):
        self.stage = Usd.Stage.Open(str(path))
        self.root, self.cache = self.stage.GetDefaultPrim(), UsdGeom.XformCache()
        self.prims = {prim.GetName(): prim for prim in Usd.PrimRange(self.root)}
        self.moving = [p for p in self.prims.values() if p.IsA(UsdPhysics.RevoluteJoint)]
        self.moving += [p for p in self.prims.values() if p.IsA(UsdPhysics.PrismaticJoint)]

    def world(self, prim) -> np.ndarray:
        """The pose (4, 4) m of a prim, or of the one with this name, as it stands in the file."""
        prim = self.prims[prim] if isinstance(prim, str) else prim
        return np.array(self.cache.GetLocalToWorldTransform(prim)).T

    def at(self, values) -> dict[str, np.ndarray]:
        """The poses (4, 4) m of all links at joint values, rad or m, by joint."""
        (fixed,) = (p for p in self.prims.values() if p.IsA(UsdPhysics.FixedJoint))
        base = UsdPhysics.Joint(fixed).GetBody1Rel().GetTargets()[0]
        poses = {base: self.world(self.stage.GetPrimAtPath(base))}
        left = list(self.moving)
        while left:
            joint = next(j for j in left if _body(j, 0) in poses)
            left.remove(joint)
            T = poses[_body(joint, 0)] @ _frame(joint, 0) @ _motion(joint, values[joint.GetName()])
            poses[_body(joint, 1)] = T @ np.linalg.inv(_frame(joint, 1))
        return {path.name: T for path, T in poses.items()}

    def limits(self, name):
        """Lowest and highest value of a joint, rad or m."""
        joint = UsdPhysics.RevoluteJoint(self.prims[name])
        pair = [joint.GetLowerLimitAttr().Get(), joint.GetUpperLimitAttr().Get()]
        return np.radians(pair) if self.prims[name].IsA(UsdPhysics.RevoluteJoint) else pair


def _body(joint, number):
    (path,) = getattr(UsdPhysics.Joint(joint), f"GetBody{number}Rel")().GetTargets()
    return path


def _frame(joint, number) -> np.ndarray:
    place, turn = (
        getattr(UsdPhysics.Joint(joint), f"GetLocal{key}{number}Attr")().Get()
        for key in ("Pos", "Rot")
    )
    return np.array(Gf.Matrix4d().SetRotate(Gf.Quatd(turn)).SetTranslateOnly(Gf.Vec3d(place))).T


def _motion(joint, value) -> np.ndarray:
    T, slides = np.eye(4), joint.IsA(UsdPhysics.PrismaticJoint)
    of = UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint
    axis = np.eye(3)["XYZ".index(of(joint).GetAxisAttr().Get())]
    if slides:
        T[:3, 3] = value * axis
    else:
        T[:3, :3] = Rotation.from_rotvec(value * axis).as_matrix()
    return T
