"""Files that would take a reader much time or memory are refused in one line before it begins, or
by a process of its own; what only looks like them is read.
"""

import struct
import tomllib
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType
from place_rings.cli.app import main
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.layouts.layout import read_layout
from place_rings.formats.layouts.mat_frames import sensors_of_mat
from place_rings.formats.loader import read_scene
from place_rings.formats.model_reader import read_calibration
from place_rings.formats.schema.layout_models import LayoutMatModel
from place_rings.formats.toml_text import MOST_PARTS, MOST_TABLES, toml_keys
from place_rings.rig.sources.bags import bag

from ..rig.bags import JOINTS, START, write_mcap
from ..support.refusals import has_parts, refused

PART = st.sampled_from(["a", "b-1", "7", '"x y"', "'q.'", '"\\"."', '""'])
DOT = st.sampled_from([".", " . ", "\t."])


@st.composite
def dotted(draw, least, most):
    """A dotted key of many parts."""
    parts = draw(st.lists(PART, min_size=1, max_size=5))
    count = draw(st.integers(least, most))
    return draw(DOT).join(
        parts[i % len(parts)] + str(i) * parts[i % len(parts)].isalnum() for i in range(count)
    )


PLACES = ["{} = 1", "[{}]", "[[ {} ]]", "x = {{ {} = 1 }}", "x = [1.5, {{ y = 2, {} = 1 }}]"]
before = st.sampled_from(
    ["", "# a.b...\n", "s = '''a.\n.'''\n", 's = """\\"""."""\n', "f = [0.5,\n.1]\n"]
)


@given(dotted(MOST_PARTS + 1, 3000), st.sampled_from(PLACES), before)
def test_a_key_of_too_many_parts_is_refused(key, place, text):
    line = text.count("\n") + 1
    with pytest.raises(ValueError, match=rf"line {line}\b.*{MOST_PARTS}"):
        toml_keys(text + place.format(key))


@given(dotted(1, MOST_PARTS - 1), st.sampled_from(PLACES), st.integers(0, 200))
def test_what_has_many_dots_but_no_long_key_is_read(key, place, many):
    text = f"""# {"a." * many}
name = "{"b." * many}" # {"c." * many}
long = \"\"\"{"d." * many}\"\"\"
plain = '{"e." * many}'
list = [{"0.5, " * many}]
day = 2026-01-02T03:04:05.678
"""
    text += place.format(key)
    try:
        wanted = tomllib.loads(text)
    except tomllib.TOMLDecodeError:  # such as a key twice
        with pytest.raises(tomllib.TOMLDecodeError):
            toml_keys(text)
    else:
        assert toml_keys(text) == wanted


HEADS = {
    "tables": ("[a{0}]", 1, True),
    "deep tables": (f"[{'.'.join(f'a{k}_{{0}}' for k in range(MOST_PARTS))}]", MOST_PARTS, True),
    "lists": ("[[ a ]] # more", 1, True),
    "dotted keys": ("a.b{0} = 1", 2, True),
    "quoted keys": ('"a"."b"."{0}" = 1.5', 3, True),
    "plain keys": ("a{0} = 1.5", 1, False),
    "rows": ("  [0.1, {0}.2],", 1, False),
    "numbers": ("  {0}.2,", 1, False),
    "remarks": ("# a.b.c = 1 {0}", 1, False),
}


@pytest.mark.parametrize("kind", HEADS)
def test_tables_are_bounded_and_nothing_else_counts_as_one(kind):
    """300,000 tables took 12 s, and 40,000 of 30 parts 1.4 GB."""
    line, parts, tables = HEADS[kind]
    rows = [line.format(i) for i in range(MOST_TABLES // parts + 1)]
    text = "\n".join(["x = [", *rows, "]"] if kind in ("rows", "numbers") else rows)
    if tables:
        with pytest.raises(ValueError, match=f"{MOST_TABLES}"):
            toml_keys(text)
    else:
        assert toml_keys(text) == tomllib.loads(text)


def test_a_list_of_sensors_with_many_keys_is_one_line(tmp_path, run):
    """A million took 1.1 GB."""
    keys = ",".join(f'"{i}": 1' for i in range(300_000))
    (tmp_path / "s.json").write_text(f"{{{keys}}}")
    code, _, err = run("verify", "s.json")
    assert code == 2
    assert has_parts(err, "s.json 300000 200000")


@pytest.mark.parametrize("kind", ["scene", "proposal", "csv"])
def test_a_file_with_such_a_key_is_one_line(tmp_path, monkeypatch, capsys, kind):
    """A key of 400 kB took 82 s and 3.9 GB."""
    key = ".".join("a" * 200_000) + " = 1\n"
    file = tmp_path / {"scene": "s.toml", "proposal": "p.toml", "csv": "l.csv"}[kind]
    file.write_text("# " * (kind == "csv") + key)
    words = {"scene": ["verify", "n1_3_0", "--scene"], "proposal": ["verify"]}
    if kind == "csv":
        with refused("l.csv"):
            read_layout(file)
        return
    monkeypatch.setattr("sys.argv", ["place-rings", *words[kind], str(file)])
    with pytest.raises(SystemExit) as end:
        main()
    said = capsys.readouterr().err
    assert end.value.code == 2
    assert (said.count("\n"), str(file) in said) == (1, True)


def test_a_calibration_that_is_large_or_names_what_it_said_is_refused(tmp_path):
    (tmp_path / "kinematics.yaml").write_text("kinematics:\n" + "  a: {x: 0}\n" * 30_000)
    with refused("kinematics.yaml 256 kB"):
        read_calibration(tmp_path / "kinematics.yaml", ROBOTS["ur3"])
    text = "a0: &a0 {b: 1}\n"
    for i in range(20):
        text += f"a{i + 1}: &a{i + 1} {{<<: [{', '.join([f'*a{i}'] * 9)}]}}\n"
    (tmp_path / "kinematics.yaml").write_text(text)
    with refused("kinematics.yaml"):
        read_calibration(tmp_path / "kinematics.yaml", ROBOTS["ur3"])


def element(kind, data):
    """A data element of a MATLAB file, padded to 8 bytes."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(kind, shape, name, content):
    """An array's element: flags, dimensions, name, and its content."""
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack("<2i", *shape))
    return element(14, head + element(1, name) + content)


HEADER = b"MATLAB 5.0".ljust(116) + bytes(8) + struct.pack("<H", 0x0100) + b"IM"


def nested(depth):
    """Cells within each other."""
    parts = [matrix(6, (1, 1), b"", element(9, bytes(8)))]
    size = len(parts[0])
    for level in range(depth):
        start = matrix(1, (1, 1), b"v" if level == depth - 1 else b"", b"")[8:]
        parts.append(struct.pack("<II", 14, len(start) + size) + start)
        size += len(parts[-1])
    return HEADER + b"".join(reversed(parts))


def claims(packed):
    """An array that states many more bytes than there are."""
    size = 2_400_000_000
    content = struct.pack("<II", 9, size)
    head = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<2i", 4, size // 32))
    data = head + element(1, b"v") + content
    whole = struct.pack("<II", 14, len(data) + size) + data
    return HEADER + (element(15, zlib.compress(whole)) if packed else whole)


@pytest.mark.parametrize(
    "data",
    [
        lambda: nested(5300),
        lambda: nested(100_000),
        lambda: claims(False),
        lambda: claims(True),
        lambda: b"MATLAB 5.0" + bytes(200),
    ],
    ids=["cells", "more cells", "claims", "packed claims", "damaged"],
)
def test_a_matlab_file_that_its_parser_does_not_survive_is_one_line(tmp_path, data):
    (tmp_path / "f.mat").write_bytes(data())
    asked = LayoutMatModel(file="f.mat", link="elbow", variable="v")
    with refused("f.mat"):
        list(sensors_of_mat(tmp_path / "f.mat", asked, UR10, Sensor()))


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_log_that_unpacks_to_many_times_its_size_is_refused(tmp_path, compression):
    """One of 486 kB unpacked to 11 GB."""
    path = tmp_path / "bomb.mcap"
    told = [("/j", JOINTS, START + n, bytes(1_000_000)) for n in range(120)]
    write_mcap(path, told, compression=compression, chunk_size=4_000_000)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(UserError) as error:
        list(bag(path, "/steps").messages())
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_a_scene_behind_a_link_names_files_beside_the_real_one(tmp_path):
    """What is checked is what is read."""
    for folder, angle in (("real", 10), ("link", 20)):
        (tmp_path / folder).mkdir()
        rows = [f"{t},{','.join(['0'] * 5)},{angle}" for t in (0, 1)]
        text = "\n".join(["t,q0,q1,q2,q3,q4,q5", *rows])
        (tmp_path / folder / "m.csv").write_text(text)
    scene = tmp_path / "real" / "s.toml"
    scene.write_text('[trajectory]\nfile = "m.csv"\nunit = "deg"\n')
    (tmp_path / "link" / "s.toml").symlink_to(scene)
    for file in (scene, tmp_path / "link" / "s.toml"):
        np.testing.assert_allclose(np.degrees(read_scene(file).poses[0].q[5]), 10)
