"""Robots by the names of robot_descriptions: found on disk, never downloaded. A small package of
that form stands in for it."""

import sys
from itertools import product

import place_rings as pr
import pytest
from place_rings.formats.robots.descriptions import find_description, is_robot_source
from place_rings.formats.robots.urdf_options import UrdfOptions

from ..support.refusals import refused

CACHE = """raise AssertionError("this module downloads")"""
REPOSITORIES = """
class Repository:
    def __init__(self, cache_path): self.cache_path = cache_path
REPOSITORIES = {"arms": Repository("arms"), "none": Repository("none")}
"""
NAMES = "plain_description", "xacro_description", "absent_description", "reading_description"
MODULE = """
from os import getenv, path
from ._cache import clone_to_cache as _clone
REPOSITORY_PATH = _clone("{of}", commit=getenv("ROBOT_DESCRIPTION_COMMIT", None))
PACKAGE_PATH = path.join(REPOSITORY_PATH, "arm")
"""
PLAIN = """
URDF_PATH = path.join(PACKAGE_PATH, "urdf", "arm.urdf")
URDF_PATH_LONG = path.join(PACKAGE_PATH, "urdf", "long.urdf")
"""
XACRO = """
XACRO_PATH = path.join(PACKAGE_PATH, "urdf", "arm.urdf.xacro")
XACRO_ARGS = {"length": "0.5", "hand": "true"}
XACRO_ARGS_NO_HAND = {"hand": "false"}
XACRO_PACKAGE_PATHS = {"other": path.join(REPOSITORY_PATH, "elsewhere")}
"""
ARM = """<robot name="arm" {more}>{first}<link name="base"/><link name="upper"/>{hand}
<joint name="turn" type="continuous"><parent link="base"/><child link="upper"/></joint>
<link name="tool0"/><joint name="end" type="fixed"><parent link="upper"/><child link="tool0"/>
<origin xyz="0 0 {length}"/></joint></robot>"""
HAND = """<link name="hand"/><joint name="grip" type="fixed"><parent link="tool0"/>
<child link="hand"/></joint>"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of one repository, and a package of the form of robot_descriptions."""
    package, cache = tmp_path / "site" / "robot_descriptions", tmp_path / "cache"
    package.mkdir(parents=True)
    table = ", ".join(f'"{name}": 0' for name in NAMES)
    files = {"__init__": "", "_cache": CACHE, "_repositories": REPOSITORIES}
    files |= {"_descriptions": f"DESCRIPTIONS = {{{table}}}"}
    files |= {NAMES[0]: MODULE.format(of="arms") + PLAIN}
    files |= {NAMES[1]: MODULE.format(of="arms") + XACRO}
    files |= {NAMES[2]: MODULE.format(of="none") + PLAIN}
    files |= {NAMES[3]: MODULE.format(of="arms") + "open(path.join(PACKAGE_PATH, 'cut.urdf'))"}
    for name, text in files.items():
        (package / f"{name}.py").write_text(text)
    urdf, other = cache / "arms" / "arm" / "urdf", cache / "arms" / "elsewhere"
    urdf.mkdir(parents=True)
    other.mkdir()
    for name, length in (("arm", 0.3), ("long", 0.9)):
        text = ARM.format(more="", first="", hand=HAND, length=length)
        (urdf / f"{name}.urdf").write_text(text)
    declared = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    arguments = '<xacro:arg name="length" default="1"/><xacro:arg name="hand" default="true"/>'
    arguments += '<xacro:include filename="$(find other)/part.xacro"/>'
    hand = f'<xacro:if value="$(arg hand)">{HAND}</xacro:if>'
    text = ARM.format(more=declared, first=arguments, hand=hand, length="$(arg length)")
    (urdf / "arm.urdf.xacro").write_text(text)
    (other / "part.xacro").write_text(f"<robot {declared}/>")
    for name in [name for name in sys.modules if name.startswith("robot_descriptions")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(package.parent)
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(cache))
    monkeypatch.delenv("ROBOT_DESCRIPTION_COMMIT", raising=False)
    yield cache
    for name in [name for name in sys.modules if name.startswith("robot_descriptions")]:
        del sys.modules[name]


def read(name, **arguments):
    """Return the length of a robot's arm, and its links."""
    path, options = UrdfOptions(xacro_args=arguments).located(name)
    urdf = options.read(path)
    return float(options.pick(urdf).chain.origin[-1, 2, 3]), set(urdf.links)


def test_a_name_is_the_file_that_its_module_states(cache):
    assert read("plain_description")[0] == 0.3
    assert read("plain_description:long")[0] == 0.9
    assert find_description("plain_description").path.is_relative_to(cache)
    assert "robot_descriptions._cache" not in sys.modules
    assert "robot_descriptions.plain_description" not in sys.modules


def test_arguments_are_the_modules_then_the_variants_then_the_users(cache):
    for variant, length, hand in product((True, False), (None, "0.7"), (None, "true", "false")):
        given = {k: v for k, v in (("length", length), ("hand", hand)) if v is not None}
        metres, links = read("xacro_description" + ":no_hand" * variant, **given)
        assert metres == float(length or 0.5)
        assert ("hand" in links) == ((hand or ("false" if variant else "true")) == "true")


def test_what_is_not_on_disk_is_refused_with_the_command_that_fetches_it(cache):
    with refused("absent_description", "robot_descriptions.absent_description"):
        find_description("absent_description")
    with refused("reading_description", "cut.urdf", "robot_descriptions.reading_description"):
        find_description("reading_description")
    (cache / "arms" / "arm" / "urdf" / "arm.urdf").unlink()
    with refused("plain_description", "robot_descriptions.plain_description"):
        find_description("plain_description")


def test_a_commit_of_the_environment_has_its_own_copy(cache, monkeypatch):
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", "abc")
    with refused("plain_description"):
        find_description("plain_description")
    (cache / "arms-abc").mkdir()
    (cache / "arms").rename(cache / "arms-abc" / "arms")
    assert read("plain_description")[0] == 0.3


def test_unknown_names_and_variants_are_refused_with_the_known_ones(cache):
    with refused("plane_description", "plain_description"):
        find_description("plane_description")
    with refused("plain_description:hand", "long"):
        find_description("plain_description:hand")
    with refused("xacro_description:hand", "no_hand"):
        find_description("xacro_description:hand")


def test_without_the_package_a_name_is_refused_with_what_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    with refused("plain_description", "place-rings[robots]"):
        find_description("plain_description")


def test_a_source_is_a_file_of_a_description_or_a_name():
    for text in (
        "a.urdf",
        "A.URDF",
        "b/c.urdf.xacro",
        "d.xml",
        "ur5e_description",
        "x_description:y",
    ):
        assert is_robot_source(text)
    for text in ("ur5e", "robot.toml", "description", "a_description.toml"):
        assert not is_robot_source(text)


def test_an_export_adds_its_sensors_to_a_robot_by_its_name(cache, tmp_path):
    path = cache / "arms" / "arm" / "urdf" / "arm.urdf"
    turning = '<child link="upper"/></joint>'
    moved = '<child link="upper"/><origin xyz="0 0 0.1"/></joint>'
    path.write_text(path.read_text().replace(turning, moved))
    robot = pr.load("plain_description", tip="tool0")
    setup = pr.Setup((), (pr.MountedSensor("tcp", (0, 0, 0.1), (0, 0, 1)),))
    pr.export(setup, pr.Scene(robot=robot), to="urdf", urdf="plain_description", folder=tmp_path)
    assert {"upper", "tool0", "tof_0_0"} <= set(UrdfOptions().read(tmp_path / "robot.urdf").links)
