"""The model of a robot's file, and of the table ``[robot]`` in a scene. Degrees in files, radians
in code.
"""

from typing import Annotated, Self

from pydantic import Field, model_validator

from .base_model import StrictModel, refuse

BASE_FRAME, TCP_FRAME = "base", "tcp"
_Place = Annotated[float, Field(ge=-100, le=100, description="metres")]
_Part = Annotated[float, Field(ge=-1.000001, le=1.000001, description="part of a unit vector")]
_Angle = Annotated[float, Field(ge=-360, le=360, description="degrees")]
_Turn = Annotated[float, Field(ge=-720, le=720, description="degrees")]
_Point = Annotated[list[_Place], Field(min_length=3, max_length=3)]
_Unit = Annotated[list[_Part], Field(min_length=3, max_length=3)]
_Angles = Annotated[list[_Angle], Field(min_length=3, max_length=3)]
_Share = Annotated[float, Field(ge=0, le=1, description="0 proximal to 1 distal")]
_Name = Annotated[str, Field(min_length=1, max_length=100)]
_UNIT = 1e-6  # by which the length of a unit vector may be off


class JointModel(StrictModel):
    """A revolute joint: where it is in the frame of the one before at angle 0, and its axis there
    after that.
    """

    name: _Name
    xyz: _Point = [0.0, 0.0, 0.0]
    rpy_deg: _Angles = Field(
        default=[0.0, 0.0, 0.0], description="degrees, about the fixed x, then y, then z"
    )
    axis: _Unit = [0.0, 0.0, 1.0]
    limits_deg: Annotated[list[_Turn], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="degrees; none: it turns freely"
    )


class TcpModel(StrictModel):
    """The TCP in the last joint's frame."""

    xyz: _Point = [0.0, 0.0, 0.0]
    rpy_deg: _Angles = [0.0, 0.0, 0.0]


class MountAxisModel(StrictModel):
    """The axis of a link around which rings sit, in the frame of a joint, or of the TCP."""

    link: _Name
    frame: _Name = Field(description="the joint that moves the link, or tcp")
    start: _Point = [0.0, 0.0, 0.0]
    axis: _Unit
    zero: _Unit = Field(description="across the axis: a ring of phase 0 has its first sensor there")
    length: float = Field(ge=0, le=100, description="metres; 0: a fixed place")
    usable: Annotated[list[_Share], Field(min_length=2, max_length=2)] = Field(
        default=[0.0, 1.0], description="where a real ring can be closed, 0 proximal to 1 distal"
    )
    section: float = Field(
        default=0.0, ge=0, le=10, description="metres, radius of what a ring surrounds; 0: unknown"
    )
    aside: float = Field(
        default=0.0, ge=0, le=10, description="metres, how far beside the axis that lies"
    )
    toward_deg: float = Field(
        default=0.0, ge=-360, le=360, description="degrees, to which side, as a ring's phase"
    )


class BodyModel(StrictModel):
    """A capsule in the frame of a joint, or of the base."""

    name: _Name
    frame: _Name = Field(description="the joint that moves it, or base")
    start: _Point
    end: _Point
    radius: float = Field(gt=0, le=10, description="metres")


class RobotFile(StrictModel):
    """A robot (TOML): a chain of revolute joints, mount axes, and the capsules that stand for its
    links.
    """

    name: _Name
    source: str = Field(default="", max_length=1000, description="where the figures are from")
    reach: float = Field(gt=0, le=100, description="metres, radius of V_O about the base")
    home_deg: list[_Turn] | None = Field(
        default=None, description="degrees, the pose where a scene has none"
    )
    tcp: TcpModel = TcpModel()
    joints: list[JointModel] = Field(min_length=1, max_length=20)
    mounts: list[MountAxisModel] = Field(min_length=1, max_length=100)
    bodies: list[BodyModel] = Field(default=[], max_length=1000)

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        faults: list[tuple[tuple[int | str, ...], object, str]] = []
        names = [j.name for j in self.joints]
        faults += [
            (
                ("joints", i, "name"),
                name,
                f"each name once, and neither {BASE_FRAME} nor {TCP_FRAME}",
            )
            for i, name in enumerate(names)
            if name in names[:i] or name in (BASE_FRAME, TCP_FRAME)
        ]
        links = [m.link for m in self.mounts]
        faults += [
            (("mounts", i, "link"), link, "each link once")
            for i, link in enumerate(links)
            if link in links[:i]
        ]
        for i, joint in enumerate(self.joints):
            if abs(sum(v * v for v in joint.axis) - 1) > _UNIT:
                faults.append((("joints", i, "axis"), f"{joint.axis}", "a vector of length 1"))
            if joint.limits_deg is not None and joint.limits_deg[0] >= joint.limits_deg[1]:
                faults.append(
                    (("joints", i, "limits_deg"), f"{joint.limits_deg}", "the lower value first")
                )
        if all(
            sum(v * v for v in xyz) < 1e-12 for xyz in (*(j.xyz for j in self.joints), self.tcp.xyz)
        ):
            faults.append((("joints",), "a chain without length", "one of some length"))
        for i, mount in enumerate(self.mounts):
            if mount.frame not in (*names, TCP_FRAME):
                faults.append((("mounts", i, "frame"), mount.frame, ", ".join((*names, TCP_FRAME))))
            for key in ("axis", "zero"):
                if abs(sum(v * v for v in getattr(mount, key)) - 1) > _UNIT:
                    faults.append(
                        (("mounts", i, key), f"{getattr(mount, key)}", "a vector of length 1")
                    )
            if abs(sum(a * b for a, b in zip(mount.axis, mount.zero, strict=True))) > _UNIT:
                faults.append((("mounts", i, "zero"), f"{mount.zero}", "a vector across the axis"))
            if mount.usable[0] >= mount.usable[1]:
                faults.append((("mounts", i, "usable"), f"{mount.usable}", "the lower value first"))
        faults += [
            (("bodies", i, "frame"), body.frame, ", ".join((BASE_FRAME, *names)))
            for i, body in enumerate(self.bodies)
            if body.frame not in (BASE_FRAME, *names)
        ]
        if self.home_deg is not None:
            if len(self.home_deg) != len(names):
                faults.append(
                    (("home_deg",), len(self.home_deg), f"{len(names)} angles, one for each joint")
                )
            else:
                for i, (q, joint) in enumerate(zip(self.home_deg, self.joints, strict=True)):
                    low, high = joint.limits_deg or (-720.0, 720.0)
                    if not low - _UNIT <= q <= high + _UNIT:
                        faults.append(
                            (("home_deg", i), q, f"{low:g} to {high:g}, the limits of {joint.name}")
                        )
        refuse(faults)
        return self
