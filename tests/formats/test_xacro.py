"""Xacro files: expanded as the package xacro does it, but no file runs code, reads a file outside
its package, reads the environment, or grows beyond bounds."""

import tracemalloc
import xml.etree.ElementTree as ET
from contextlib import contextmanager, suppress

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.cli.entry import main
from place_rings.coverage.definitions.errors import UserError
from place_rings.formats.robots.packages import Packages
from place_rings.formats.robots.urdf_options import UrdfOptions
from place_rings.formats.robots.xacro_expressions import value_of
from place_rings.formats.robots.xacro_files import expand_xacro
from place_rings.viewer.triangle_meshes import read_skin

from ..support.refusals import refused

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = """{head}
<xacro:arg name="tool" default="true"/>
<xacro:property name="r" value="0.05"/>
<xacro:macro name="part" params="name length radius:=${{r}}">
<link name="${{name}}"><collision><origin xyz="0 0 ${{length / 2}}"/>
<geometry><cylinder radius="${{radius}}" length="${{length}}"/></geometry></collision></link>
</xacro:macro>
<link name="base"/><xacro:part name="upper" length="${{2 * 0.2}}"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="${{-radians(90)}}" upper="${{pi / 2}}"/></joint>
<xacro:if value="$(arg tool)"><link name="tool0"/>
<joint name="end" type="fixed"><parent link="upper"/><child link="tool0"/>
<origin xyz="0 0 0.4"/></joint></xacro:if>
{more}
</robot>"""


def written(folder, body, head=HEAD):
    path = folder / "arm.urdf.xacro"
    path.write_text(f"{head}{body}</robot>")
    return path


def expanded(path, **arguments):
    return expand_xacro(path, arguments, Packages(path))


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.urdf.xacro"
    path.write_text(ARM.format(head=HEAD, more=""))
    return path


def test_a_xacro_file_is_the_robot_that_its_expansion_is(arm, tmp_path):
    plain = tmp_path / "plain.urdf"
    plain.write_text(ET.tostring(expanded(arm), "unicode"))
    whole, again = UrdfOptions().read(arm), UrdfOptions().read(plain)
    assert repr((whole.links, whole.joints)) == repr((again.links, again.joints))
    assert UrdfOptions().pick(whole).chain.origin[-1, 2, 3] == 0.4


def test_an_argument_chooses_a_variant(arm):
    assert "tool0" in UrdfOptions().read(arm).links
    assert "tool0" not in UrdfOptions(xacro_args={"tool": "false"}).read(arm).links


def test_an_argument_that_no_file_declares_is_refused(arm):
    with refused(arm.name, "tol", "tool"):
        UrdfOptions(xacro_args={"tol": "false"}).read(arm)


SENSOR = pr.MountedSensor("tcp", (0, 0, 0.1), (0, 0, 1))


def test_an_export_adds_its_sensors_to_what_a_xacro_file_makes(arm, tmp_path, run):
    """By Python and by the command, with --urdf and by --robot: as to the URDF itself."""
    plain, setup = tmp_path / "plain.urdf", pr.Setup((), (SENSOR,))
    arm.write_text(arm.read_text().replace("<axis", '<origin xyz="0 0 0.1"/><axis'))
    plain.write_text(ET.tostring(expanded(arm, tool="true"), "unicode"))
    scene = pr.Scene(robot=pr.load(plain, tip="tool0"))
    for file, args in ((plain, {}), (arm, {"tool": "true"})):
        out = tmp_path / file.suffix[1:]
        pr.export(setup, scene, to=("urdf", "json"), urdf=file, xacro_args=args, folder=out)
    wanted = UrdfOptions().read(tmp_path / "urdf" / "robot.urdf")
    assert {"upper", "tool0", "tof_0_0"} <= set(wanted.links)
    given = (("--urdf", arm, "--robot", arm), ("--robot", arm))
    for number, options in enumerate(given):
        out = tmp_path / f"run{number}"
        words = ("--tip", "tool0", "--xacro-arg", "tool=true", "--to", "urdf", "--out", out)
        code, _, err = run("export", tmp_path / "xacro" / "sensors.json", *options, *words)
        assert code == 0, err
    for folder in ("xacro", "run0", "run1"):
        found = UrdfOptions().read(tmp_path / folder / "robot.urdf")
        assert repr((found.links, found.joints)) == repr((wanted.links, wanted.joints))


def test_the_surface_of_a_robot_is_that_of_what_its_xacro_file_makes(arm, tmp_path):
    plain = tmp_path / "plain.urdf"
    arm.write_text(arm.read_text().replace("<axis", '<origin xyz="0 0 0.1"/><axis'))
    text = ET.tostring(expanded(arm), "unicode").replace("collision>", "visual>")
    plain.write_text(text)
    visual = tmp_path / "visual.urdf.xacro"
    visual.write_text(arm.read_text().replace("collision>", "visual>"))
    reading = UrdfOptions(tip="tool0")
    robot = reading.fit(arm).robot
    one, other = (read_skin(str(f), reading, robot).at(np.array([0.3]))[0] for f in (plain, visual))
    assert len(one)
    np.testing.assert_allclose(one, other)


def test_an_argument_of_another_file_is_refused(tmp_path):
    (tmp_path / "arm.urdf").write_text('<robot name="arm"><link name="base"/></robot>')
    with refused("arm.urdf", "--xacro-arg"):
        UrdfOptions(xacro_args={"tool": "false"}).read(tmp_path / "arm.urdf")


numbers = st.integers(-20, 20).map(str) | st.floats(-9, 9).map(repr) | st.just("pi") | st.just("r")
terms = st.recursive(
    numbers,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({' '.join(t)})"),
        st.tuples(inner, inner, inner).map(lambda t: f"({t[0]} if {t[1]} < {t[2]} else {t[0]})"),
        inner.map(lambda t: f"cos({t})"),
        inner.map(lambda t: f"math.atan2({t}, 2)"),
        inner.map(lambda t: f"round(python.abs({t}), 3)"),
        st.tuples(inner, inner).map(lambda t: f"[{t[0]}, {t[1]}][-1]"),
        st.tuples(inner, inner).map(lambda t: f"max({t[0]}, {t[1]})"),
        inner.map(lambda t: f"dict(a={t})['a']"),
        inner.map(lambda t: f"({t} > 1 and not {t} == 3 or {t} != 2)"),
        inner.map(lambda t: f"len(str({t}).split('.'))"),
    ),
    max_leaves=6,
)


@given(text=terms)
def test_expressions_have_the_values_that_xacro_gives(tmp_path_factory, text):
    import xacro  # it changes how minidom writes

    path = written(
        tmp_path_factory.mktemp("terms"),
        f'<xacro:property name="r" value="0.25"/><link name="a${{{text.replace("<", "&lt;")}}}"/>',
    )
    theirs = ET.fromstring(xacro.process_file(str(path)).documentElement.toxml())
    assert expanded(path).find("link").get("name") == theirs.find("link").get("name")


HOSTILE = [
    "().__class__.__base__.__subclasses__()",
    "''.join.__self__",
    "'{0.__class__}'.format(1)",
    "'%99999999d' % 1",
    "__import__('os').getcwd()",
    "open('/etc/hostname').read()",
    "eval('1')",
    "python.type(1)",
    "python.vars()",
    "xacro.load_yaml('/etc/hostname')",
    "xacro.load_yaml('../secret.yaml')",
    "load_yaml('link.yaml')",
    "[c for c in 'ab']",
    "(lambda: 1)()",
    "f'{1}'",
    "(x := 1)",
    "9**9**9",
    "2 ** 4000",
    "'a' * 10**9",
    "range(10**12)",
    "math.factorial(10**7)",
    "print(1)",
    "max(**{'a': 1})",
    "[*'ab']",
    "-" * 1900 + "1",
    "(" * 900 + ")" * 900,
    "1 << 9999999",
    "SECRET",
    "1 if",
]
SUBSTITUTIONS = [
    "$(env SECRET)",
    "$(optenv SECRET x)",
    "$(eval env)",
    "$(eval ().__class__)",
    "$(find ..)",
    "$(find /)",
    "$(find nothing)",
    "$(cwd)",
    "$(arg nothing)",
]


@pytest.fixture
def beside(tmp_path, monkeypatch):
    """A folder of a package, beside which and in the environment there is a secret."""
    monkeypatch.setenv("SECRET", "0.123456")
    (tmp_path / "secret.yaml").write_text("0.123456")
    (tmp_path / "secret.xacro").write_text(f'{HEAD}<link name="0.123456"/></robot>')
    package = tmp_path / "package"
    package.mkdir()
    (package / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (package / "link.xacro").symlink_to(tmp_path / "secret.xacro")
    return package


@pytest.mark.parametrize("text", [*(f"${{{one}}}" for one in HOSTILE), *SUBSTITUTIONS])
@pytest.mark.parametrize("where", ["link", "property", "argument", "condition"])
def test_no_expression_runs_code_or_leaves_the_package(beside, text, where):
    bodies = {
        "link": '<link name="{}"/>',
        "property": '<xacro:property name="p" value="{}"/><link name="${{p}}"/>',
        "argument": '<xacro:arg name="p" default="{}"/><link name="$(arg p)"/>',
        "condition": '<xacro:if value="{}"><link name="a"/></xacro:if>',
    }
    path = written(beside, bodies[where].format(text.replace("<", "&lt;")))
    with refused() as caught:
        expanded(path)
    assert "0.123456" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["../secret.xacro", "link.xacro", "/etc/hostname", "$(dirname)/../secret.xacro", "?*"]
)
def test_an_include_stays_in_the_package(beside, name):
    with refused() as caught:
        expanded(written(beside, f'<xacro:include filename="{name}"/>'))
    assert "0.123456" not in str(caught.value)


def test_an_include_of_a_package_that_the_user_gives_is_read(beside):
    path = written(beside, '<xacro:include filename="$(find other)/part.xacro"/>')
    other = beside.parent / "other"
    other.mkdir()
    (other / "part.xacro").write_text(f'{HEAD}<link name="part"/></robot>')
    with refused("other", "--packages"):
        UrdfOptions().read(path)
    assert "part" in UrdfOptions(package={"other": other}).read(path).links
    assert "part" in UrdfOptions(packages=[other]).read(path).links


def test_a_missing_include_may_be_optional(tmp_path):
    inner = '<xacro:include filename="none.xacro"{}/><link name="a"/>'
    with refused("none.xacro"):
        expanded(written(tmp_path, inner.format("")))
    path = written(tmp_path, inner.format(' optional="true"'))
    assert expanded(path).find("link").get("name") == "a"


def test_tables_have_units_and_share_values(tmp_path):
    (tmp_path / "t.yaml").write_text("a: &a {turn: !degrees 180, long: !millimeters 2 + 3}\nb: *a")
    path = written(
        tmp_path,
        '<xacro:property name="t" value="${xacro.load_yaml(\'t.yaml\')}"/>'
        "<link name=\"${t.b.turn == pi and t['a']['long'] == 0.005}\"/>",
    )
    assert expanded(path).find("link").get("name") == "True"


def doubling(first, step, use, count=60):
    """A file in which each of some parts stands for two of the one before."""
    steps = (step.replace("NEXT", f"p{i + 1}").replace("LAST", f"p{i}") for i in range(count))
    return first + "".join(steps) + use.replace("LAST", f"p{count}")


BOMBS = {
    "texts": doubling(
        '<xacro:property name="p0" value="abc"/>',
        '<xacro:property name="NEXT" value="${LAST}${LAST}"/>',
        '<link name="${LAST}"/>',
    ),
    "lists": doubling(
        '<xacro:property name="p0" value="${[1, 2]}"/>',
        '<xacro:property name="NEXT" value="${[LAST, LAST]}"/>',
        '<link name="${LAST}"/>',
    ),
    "products": doubling(
        '<xacro:property name="p0" value="${2**500}"/>',
        '<xacro:property name="NEXT" value="${LAST * LAST}"/>',
        '<link name="${LAST}"/>',
    ),
    "macros": doubling(
        '<xacro:macro name="p0"><link name="a"/></xacro:macro>',
        '<xacro:macro name="NEXT"><xacro:LAST/><xacro:LAST/></xacro:macro>',
        "<xacro:LAST/>",
    ),
    "blocks": doubling(
        '<xacro:macro name="p0" params="*b"><xacro:insert_block name="b"/></xacro:macro>',
        '<xacro:macro name="NEXT" params="*b"><xacro:LAST><g><xacro:insert_block name="b"/>'
        '<xacro:insert_block name="b"/></g></xacro:LAST></xacro:macro>',
        '<xacro:LAST><link name="a"/></xacro:LAST>',
    ),
    "a macro of itself": '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>',
    "a file of itself": '<xacro:include filename="arm.urdf.xacro"/>',
    "aliases": "<link name=\"${xacro.load_yaml('bomb.yaml')['p30']}\"/>",
    "merges": "<link name=\"${xacro.load_yaml('merge.yaml')['p30']}\"/>",
    "a circle": '<xacro:property name="a" value="${b}"/><xacro:property name="b" value="${a}"/>'
    '<link name="${a}"/>',
}


@pytest.mark.parametrize("which", BOMBS)
def test_no_file_grows_beyond_bounds(tmp_path, which, monkeypatch):
    monkeypatch.setattr("place_rings.formats.robots.xacro_files._MOST", 1000)
    lines = "".join(f"p{i + 1}: &p{i + 1} [*p{i}, *p{i}]\n" for i in range(30))
    (tmp_path / "bomb.yaml").write_text(f"p0: &p0 [1, 2]\n{lines}")
    lines = "".join(f"p{i + 1}: &p{i + 1} {{<<: [*p{i}, *p{i}]}}\n" for i in range(30))
    (tmp_path / "merge.yaml").write_text(f"p0: &p0 {{a: 1}}\n{lines}")
    with refused():
        expanded(written(tmp_path, BOMBS[which]))


def test_what_files_and_attributes_hold_counts_each_time(tmp_path, monkeypatch):
    monkeypatch.setattr("place_rings.formats.robots.xacro_files._LONGEST", 200_000)
    (tmp_path / "part.xacro").write_text(f"{HEAD}<!--{'c' * 50_000}--></robot>")
    (tmp_path / "part.yaml").write_text(f"a: 1 #{'c' * 50_000}")
    empty = " ".join(f'a{i}=""' for i in range(1000))
    for one in (
        '<xacro:include filename="part.xacro"/>',
        '<xacro:property name="p" value="${load_yaml(\'part.yaml\')}"/><a b="${p.a}"/>',
        f"<g {empty}/>",
    ):
        expanded(written(tmp_path, one))
        with refused():
            expanded(written(tmp_path, 10 * one))


@contextmanager
def little_memory():
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_comments_of_macros_are_not_repeated(tmp_path):
    macro = f'<xacro:macro name="m"><!--{"c" * 50_000}--><a/></xacro:macro>'
    with little_memory():
        expanded(written(tmp_path, macro + 500 * "<xacro:m/>"))


def test_a_list_in_itself_is_refused_before_it_fills_the_memory():
    table = [0] * 3000
    table.append(table)
    with little_memory(), refused():
        value_of("len(table)", {"table": table}, {}, "arm.xacro")


def test_a_document_type_is_refused_in_every_file(tmp_path):
    typed = '<!DOCTYPE r [<!ENTITY e "abc">]>' + HEAD
    with refused("document type"):
        expanded(written(tmp_path, '<link name="&e;"/>', typed))
    (tmp_path / "part.xacro").write_text(f'{typed}<link name="&e;"/></robot>')
    with refused("part.xacro", "document type"):
        expanded(written(tmp_path, '<xacro:include filename="part.xacro"/>'))


def test_what_an_expression_makes_is_evaluated_no_second_time(tmp_path):
    lines = ["a: $", "b: '{().__class__}'"]
    (tmp_path / "parts.yaml").write_text("\n".join(lines))
    body = '<xacro:property name="t" value="${load_yaml(\'parts.yaml\')}"/>'
    path = written(tmp_path, f'{body}<link name="${{t.a + t.b}}"/>')
    assert expanded(path).find("link").get("name") == "${().__class__}"
    with refused("expression"):
        UrdfOptions().read(path)


def test_a_refusal_is_one_line_and_writes_nothing(tmp_path, capsys, monkeypatch):
    path = written(tmp_path, '<link name="${().__class__}"/>')
    monkeypatch.setattr("sys.argv", ["place-rings", "robot", str(path), "--out", "out"])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@given(text=st.text(max_size=40))
def test_any_text_of_an_expression_is_a_value_or_a_refusal(tmp_path_factory, text):
    escaped = "".join(f"&#{ord(c)};" for c in text if c.isprintable())
    path = written(tmp_path_factory.mktemp("any"), f'<link name="${{{escaped}}}"/>')
    with suppress(UserError):  # nothing else
        expanded(path)
