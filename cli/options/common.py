"""Options that several commands share, one by one."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

Targets = Annotated[
    tuple[str, ...],
    Parameter(
        name="--target",
        negative=(),
        help="V_O, V_T, V_OT, V_S, V_P; radius, weight: V_S:0.5=0.6. Repeatable.",
    ),
]
Radius = Annotated[
    float | None, Parameter(help="Radius of a --target V_S that has none of its own, m.")
]
SceneFileOption = Annotated[
    Path | None, Parameter(name="--scene", help="Another scene than the reference scene (TOML).")
]
RobotOption = Annotated[
    str | None, Parameter(help="A built-in robot (see robots), a robot's file (.toml), or a .urdf.")
]
Voxel = Annotated[float, Parameter(help="Side of a voxel, m.")]
Json = Annotated[
    bool, Parameter(name="--json", negative=(), help="Print one JSON object for scripts.")
]
Subject = Annotated[
    str,
    Parameter(
        name="PROPOSAL_OR_NAME",
        help="A proposal's file, sensors (.csv, .json, .urdf), or a name like n2_16_25.",
    ),
]
Floors = Annotated[
    tuple[str, ...],
    Parameter(negative=(), help="A floor: V_S:1.5=60 for 60 percent of it. Repeatable."),
]
Seed = Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")]
Count = Annotated[int, Parameter(validator=Number(gte=1, lte=200))]
