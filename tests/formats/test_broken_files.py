"""Files with broken pieces: each is read, or refused in one line.

``PLACE_RINGS_BROKEN=5000 pytest -m slow tests/formats/test_broken_files.py`` draws more of them.
"""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from place_rings.cli.app import app
from place_rings.cli.options.urdf_robot import import_urdf
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.formats.detection_rates import read_rates
from place_rings.formats.loader import read_proposal, read_scene, read_target, resolve
from place_rings.formats.mesh_readers.collada import read_collada
from place_rings.formats.mesh_readers.mesh_numbers import MeshError
from place_rings.formats.mesh_readers.obj import read_obj
from place_rings.formats.model_reader import read_calibration, read_sensor
from place_rings.formats.recorded_motion import read_record
from place_rings.formats.robots.xml_text import plain_xml
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.stop_times import read_stop_times
from place_rings.formats.writing import to_toml
from place_rings.objectives.named_layouts import layout_in
from place_rings.objectives.scene import Scene

from ..strategies.broken_text import broken
from .test_calibration import REAL, conf
from .test_mesh_readers import dae
from .test_own_sensors import MINE
from .test_stop_times import HEAD, ROW

CELLS = Path(__file__).resolve().parents[2] / "examples" / "cells"
MANY = int(os.environ.get("PLACE_RINGS_BROKEN", "150"))
FEW = 6
RATES = "distance_m,reflectance,rate,frames\n0.5,0.17,1,300\n1,0.17,0.6,300\n1.5,0.17,0,300\n"
TARGET = """name = "walkway"
[volume]
kind = "difference"
of = [
    {kind = "box", size = [0.8, 2.0, 1.8], centre = [0.9, 0.0, 0.6]},
    {kind = "cylinder", radius = 0.15, height = 3.0, centre = [1.1, 0.6, 0.6]},
]
"""
_LINK = """<link name="l{0}"><collision><origin xyz="0 0 0.15" rpy="0 0 0"/>
<geometry><cylinder radius="0.05" length="0.3"/></geometry></collision></link>
"""
_JOINT = """<joint name="j{1}" type="revolute"><parent link="l{0}"/><child link="l{1}"/>
<origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
"""
URDF = (
    '<robot name="arm">\n'
    + "".join(_LINK.format(i) for i in range(4))
    + "".join(_JOINT.format(i, i + 1) for i in range(3))
    + "</robot>\n"
)
_BODY = """<body name="l{0}" pos="0 0 0.3">
<joint name="j{0}" type="hinge" axis="0 1 0" range="-90 90"/>
<geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.05"/>
"""
MJCF = (
    '<mujoco model="arm"><compiler angle="degree"/><worldbody><body name="base">\n'
    + '<geom type="box" size="0.1 0.1 0.1"/>\n'
    + "".join(_BODY.format(i) for i in range(3))
    + "</body>" * 4
    + "</worldbody></mujoco>\n"
)
MOTION = "t," + ",".join(f"q{i}" for i in range(6)) + "\n0,0,-1,1,0,1,0\n0.5,0.1,-1,1,0,1,0\n"
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\no part\nf 1//1 2//1 3//1 4//1\n"


def _written(*command: str) -> dict[str, str]:
    """Return the texts that a command writes into a folder, by their files' names."""
    with TemporaryDirectory() as folder:
        app([*command, "--out", folder], result_action="return_value")
        texts = (f for f in Path(folder).iterdir() if f.suffix not in (".png", ".stl"))
        return {f.name: f.read_text("utf-8") for f in texts}


@cache
def _exported(to: str) -> dict[str, str]:
    return _written("export", "n1_4_0", "--to", to)


def _proposal() -> str:
    scene = Scene()
    return to_toml(ProposalFile.of(layout_in(scene, "n1_4_0"), scene))


def _fitted(path: Path) -> object:
    return import_urdf(path, capsules=1)


def _calibration(path: Path) -> object:
    return read_calibration(path, ROBOTS["ur3"])


def _collada(path: Path) -> object:
    return read_collada(plain_xml(path.read_bytes(), path.name))


def _resolved(path: Path) -> object:
    return resolve(str(path), Scene())


Read = Callable[[Path], object]
FILES: dict[str, tuple[str, Callable[[], str], Read]] = {
    **{
        f.stem: (f.name, lambda f=f: f.read_text("utf-8"), read_scene)
        for f in sorted(CELLS.glob("*.toml"))
    },
    "proposal": ("mine.toml", _proposal, read_proposal),
    "target": ("door.toml", lambda: TARGET, read_target),
    "sensor": ("own.toml", lambda: MINE, read_sensor),
    "sensors in CSV": ("s.csv", lambda: _exported("csv")["sensors.csv"], _resolved),
    "sensors in JSON": ("s.json", lambda: _exported("json")["sensors.json"], _resolved),
    "sensors in URDF": ("s.urdf", lambda: _exported("urdf")["robot.urdf"], _resolved),
    "motion": ("m.csv", lambda: MOTION, lambda path: read_record(path, UR10)),
    "stops": ("stops.csv", lambda: HEAD + ROW, lambda path: read_stop_times(path, UR10)),
    "rates": ("rates.csv", lambda: RATES, read_rates),
    "calibration": (
        "c.conf",
        lambda: conf(REAL),
        _calibration,
    ),
    "OBJ": ("a.obj", lambda: SQUARE, lambda path: read_obj(path.read_bytes())),
    "COLLADA": ("a.dae", lambda: dae().decode(), _collada),
    "URDF": ("r.urdf", lambda: URDF, _fitted),
    "MJCF": ("r.xml", lambda: MJCF, _fitted),
}


@cache
def _text(kind: str) -> str:
    return FILES[kind][1]()


def _readable_or_refused(kind: str, text: str) -> bool:
    """Return whether a file is read; otherwise one line says what is wrong."""
    name, _, read = FILES[kind]
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_text(text, "utf-8", errors="surrogatepass")
        try:
            read(path)
        except (UserError, MeshError) as error:
            line = str(error)
            assert line
            assert line.isprintable()
            assert len(line) < 2000
            return False
    return True


@pytest.mark.parametrize("kind", FILES)
def test_a_whole_file_is_read(kind):
    assert _readable_or_refused(kind, _text(kind))


@pytest.mark.parametrize("kind", FILES)
@settings(max_examples=FEW, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_broken_file_is_read_or_refused(kind, data):
    _readable_or_refused(kind, data.draw(broken(_text(kind))))


@pytest.mark.slow
@pytest.mark.parametrize("kind", FILES)
@settings(max_examples=MANY, suppress_health_check=list(HealthCheck), print_blob=True)
@given(data=st.data())
def test_many_broken_files_are_read_or_refused(kind, data):
    _readable_or_refused(kind, data.draw(broken(_text(kind))))
