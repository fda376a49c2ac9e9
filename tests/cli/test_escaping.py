"""Terminals, pages and pictures show text of files and users without control characters."""

import ast
import io
import json
import os
import pty
import re
import subprocess
import sys
import tomllib
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from place_rings.cli.app import app, main
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.definitions.escaping import printable, printable_json, printable_lines
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.targets.named import Shell
from place_rings.formats.loader import read_scene
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene
from place_rings.reporting.pages import code, escaped, html, table
from place_rings.reporting.plots import save
from place_rings.reporting.rendering.figures import write_png
from place_rings.reporting.terminal import Terminal, say, say_json, say_lines
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.recording.recording import Recording
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.rings.line_monitor import Port
from place_rings.viewer import html as words
from place_rings.viewer.browser import labelled
from place_rings.viewer.colours import KINDS
from rich.cells import cell_len
from rich.progress import Progress, TextColumn
from rich.style import Style
from rich.table import Table
from rich.text import Text

from ..rig.cell import SCENE, SETUP
from ..support.rooms import rooms
from ..support.viser_client import Client

ROOT = Path(__file__).parents[2]
# XML allows these: U+202E, CSI, a zero-width space, an isolate, a BOM, U+2028, private use, DEL.
IN_XML = "\u202egnp\u009b31m\u200b\u2066\ufeff\u2028\ue000\x7f"
TITLE = "\x1b]0;owned\x07"  # sets the title of a terminal
NASTY = TITLE + "\x1b[31m" + IN_XML
SHOWN_TITLE = r"\x1b]0;owned\x07"
_COLOURS = re.compile(r"\x1b\[[\d;]*m")
_CURSOR = re.compile(r"\x1b\[(\d*[A-HJK]|\?25[lh])")
_ODD = st.sampled_from([*NASTY, "\n", "\t", "[", "]", "/", ":", "\ud800"])
texts = st.text(st.one_of(st.characters(), _ODD))


def unreadable(text):
    """The characters of ``text`` that neither show nor break a line."""
    return {ascii(c) for c in text if not c.isprintable() and c != "\n"}


@given(texts)
def test_printable_text_is_one_line_and_plain_text_stays(text):
    assert printable(text).isprintable()
    assert printable(printable(text)) == printable(text)
    assert (printable(text) == text) == text.isprintable()
    assert unreadable(printable_lines(text)) == set()
    assert printable_lines(text).count("\n") == text.count("\n")
    assert str(UserError(text)) == printable(text)


def test_every_kind_of_invisible_character_is_escaped():
    kinds = [*range(0x20), *range(0x7F, 0xA0), 0x61C, *range(0x200B, 0x2010)]
    kinds += [*range(0x2028, 0x202F), *range(0x2060, 0x2070)]
    kinds += [0xD800, 0xDFFF, 0xE000, 0xFEFF, 0xFFF9, 0xE0001, 0x10FFFD]
    for kind in kinds:
        assert printable(chr(kind)).startswith("\\")
    assert printable("ζ ≥ 5 °, naïve 中文 \\ …") == "ζ ≥ 5 °, naïve 中文 \\ …"


@given(st.text(st.characters(exclude_categories=("Cs",))))
def test_escaped_json_is_json_of_the_same_data(text):
    data = {text: [text, 1]}
    shown = printable_json(json.dumps(data, ensure_ascii=False, indent=2))
    assert unreadable(shown) == set()
    assert json.loads(shown) == data


def terminal(**more):
    kind = {"force_terminal": True, "color_system": "truecolor", "width": 60}
    return Terminal(file=io.StringIO(), **kind, **more)


def drawn(console):
    """What the console wrote, without the colours that it is free to make."""
    return _COLOURS.sub("", console.file.getvalue())


@given(texts, st.booleans())
def test_whatever_is_printed_shows(text, soft):
    """As a string, a styled and a linked Text, and in a table with columns of all kinds."""
    console = terminal()
    console.print(text, soft_wrap=soft)
    console.print(text, highlight=False, markup=False, soft_wrap=soft)
    console.print(
        Text(text, style=Style(link=f"http://192.0.2.1/{text}")),
        Text.assemble(("a", "bold"), (text, "red")),
    )
    table = Table(title=text, caption=text)
    for kind in ({}, {"justify": "right"}, {"no_wrap": True}, {"overflow": "fold"}):
        table.add_column(text, **kind)
    table.add_row(text, Text(text), text, text)
    console.print(table)
    console.rule(text)
    console.out(text)
    assert unreadable(drawn(console)) == set()


@given(texts)
def test_plain_lines_show_what_console_lines_show(text):
    console = Terminal(file=io.StringIO(), width=60)
    console.print(text, highlight=False, soft_wrap=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", io.StringIO())
        say(text)
        said = sys.stdout.getvalue()
    assert console.file.getvalue() == said == printable(text) + "\n"


def test_strings_are_no_markup_and_a_string_is_one_line():
    console = terminal()
    texts = ("[link=http://192.0.2.1]x[/link]", "[/nothing]", ":warning:", "[bold]b[/bold]")
    for text in (*texts, "a\nring 0: fine"):
        console.print(text, highlight=False)
        with console.status(text) as status:
            status.update(text)
    said = drawn(console)
    assert unreadable(_CURSOR.sub("", said).replace("\r", "")) == set()
    for text in (*texts, r"a\nring 0: fine"):
        assert said.count(text) >= 2


@given(texts, texts, texts)
def test_styles_stay_on_their_text(a, b, c):
    """Also where escapes are longer than what they stand for."""
    console = terminal()
    # Text leaves a few characters out itself
    a, b, c = (Text(t).plain for t in (a, b, c))
    text = Text.assemble(a, (b, "bold"), c)
    options = console.options.update(no_wrap=True, overflow="ignore")
    found = [s for s in console.render(text, options) if not s.control]
    bold = "".join(s.text for s in found if s.style and s.style.bold)
    wanted = "".join("" if c in "\n" else printable(c) for c in b)
    assert bold.replace("\n", "").replace(" ", "") == wanted.replace(" ", "")


@given(st.lists(texts, min_size=1, max_size=4))
def test_columns_are_as_wide_as_what_is_shown(cells):
    console = Terminal(file=io.StringIO(), width=400)
    table = Table("text", "end")
    for cell in cells:
        table.add_row(cell[:20], "x")
    console.print(table)
    lines = console.file.getvalue().splitlines()
    assert len(lines) == len(cells) + 4
    assert len({cell_len(line) for line in lines}) == 1


def test_progress_questions_lines_and_json_show(monkeypatch, capsys):
    console = terminal()
    with Progress(TextColumn("{task.description}", markup=False), console=console) as bar:
        bar.add_task(NASTY, total=1)
        print(NASTY)  # taken in by the bar
    assert unreadable(_CURSOR.sub("", drawn(console)).replace("\r", "")) == set()
    assert "gnp" in drawn(console)
    console = terminal()
    monkeypatch.setattr("builtins.input", lambda *_: "yes")
    assert console.input(f"{NASTY}?") == console.input(Text(f"{IN_XML}?")) == "yes"
    assert unreadable(drawn(console)) == set()
    capsys.readouterr()
    say_lines(f"a{NASTY}\nb\n")
    say(NASTY, error=True)
    say_json(json.dumps({"a": NASTY}, ensure_ascii=False, indent=2))
    out, err = capsys.readouterr()
    assert unreadable(out + err) == set()
    assert out.startswith("a" + printable(NASTY) + "\nb\n{")
    assert json.loads(out[out.index("{") :]) == {"a": NASTY}


PRINTS = re.compile(r"\b(print|input|Console|TextColumn|rich|sys\.std(out|err))\b")


def prints(node, fixed):
    """Whether a node writes to the terminal in a way of its own."""
    match node:
        case ast.Call(func=ast.Name() | ast.Attribute()):
            called = ast.unparse(node.func)
            plain = called == "TextColumn" and "markup" not in {k.arg for k in node.keywords}
            return plain or called in ("print", "input") or called.split(".")[-1] == "Console"
        case ast.Attribute(attr="stdout" | "stderr"):
            return node not in fixed and ast.unparse(node.value) == "sys"
        case ast.ImportFrom(module=str()) if node.module.split(".")[0] == "rich":
            names = {alias.name for alias in node.names}
            return node.module == "rich.prompt" or names & {"print", "get_console", "inspect"}
    return False


def test_nobody_else_prints():
    """Only reporting/terminal.py does; processes of rig/, and those that read files, write to
    their parents."""
    processes = (
        "formats/limited_process.py",
        "formats/layouts/mat_process.py",
        "formats/mesh_readers/usd_process.py",
    )
    for path in (path for room in rooms() if room != "rig" for path in (ROOT / room).rglob("*.py")):
        name, text = path.relative_to(ROOT).as_posix(), path.read_text("utf-8")
        if name in ("reporting/terminal.py", *processes) or not PRINTS.search(text):
            continue
        nodes = list(ast.walk(ast.parse(text)))
        fixed = {  # streams to which only text of the program itself is written
            n.func.value
            for n in nodes
            if isinstance(n, ast.Call)
            and isinstance(n.func, ast.Attribute)
            and n.func.attr in ("write", "flush")
            and all(isinstance(a, ast.Constant) for a in n.args)
        }
        assert [f"{name}:{node.lineno}" for node in nodes if prints(node, fixed)] == []
        if not name.startswith(("cli/", "reporting/")):
            assert not re.search(r"^\s*from rich", text, re.M), name


def test_help_goes_the_same_way():
    assert isinstance(app.console, Terminal)
    assert isinstance(app.error_console, Terminal)
    assert app.error_console.stderr


# Through the commands.


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    """No line of a table is broken."""
    monkeypatch.setenv("COLUMNS", "400")


def arm(name, *links):
    """A URDF of two turning links of those names."""
    body = "<geometry><cylinder radius='0.05' length='0.4'/></geometry>"
    body = f"<collision><origin xyz='0 0 0.25'/>{body}</collision>"
    text = f"<robot name='{name}'><link name='base'/>"
    for i, (parent, link) in enumerate(zip(("base", *links), links, strict=False)):
        text += f"<link name='{link}'>{body}</link><joint name='j{i}{IN_XML}' type='continuous'>"
        text += f"<parent link='{parent}'/><child link='{link}'/>"
        text += f"<origin xyz='0 0 {0.1 + 0.5 * i}'/><axis xyz='0 1 0'/></joint>"
    text += "<link name='side'/><joint name='s' type='continuous'>"
    text += f"<parent link='{links[0]}'/><child link='side'/></joint>"
    text += f"<link name='tip{IN_XML}'/><joint name='f' type='fixed'><parent link='{links[-1]}'/>"
    return text + f"<child link='tip{IN_XML}'/><origin xyz='0 0 0.5'/></joint></robot>"


LINKS = (f"low{IN_XML}", f"high{IN_XML}")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a hostile URDF."""
    folder = tmp_path_factory.mktemp("arm")
    (folder / "evil.urdf").write_text(arm(f"evil{IN_XML}", *LINKS), "utf-8")
    return folder


def ok(found, *shown):
    """All of what a command printed shows, and parts of it are there."""
    code, out, err = found
    assert unreadable(out + err) == set()
    for text in shown:
        assert text in out + err
    return code


@pytest.fixture(scope="module")
def robot(made):
    """The folder of robot.toml, scene.toml and robot.png of it."""
    out = made / f"out{NASTY}"
    words = ("robot", str(made / "evil.urdf"), "--tip", f"tip{IN_XML}", "--out", str(out))
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said), suppress(SystemExit):
        patch.setenv("COLUMNS", "400")
        patch.setattr(sys, "argv", ["place-rings", *words])
        patch.setattr("signal.signal", lambda *_: None)
        main()
    assert {path.name for path in out.iterdir()} == {"robot.toml", "scene.toml", "robot.png"}
    assert ok((0, said.getvalue(), ""), SHOWN_TITLE, printable(LINKS[0])) == 0
    return out


_COMMAND = [sys.executable, "-m", "place_rings.cli.entry"]


def test_a_robots_files_keep_their_data(robot):
    scene = read_scene(robot / "scene.toml")
    assert scene.robot.name == f"evil{IN_XML}"
    assert scene.robot.links[:2] == LINKS


def test_a_hostile_robot_shows(run, made, robot):
    ring = {"link": LINKS[1], "position": 0.5, "count": 4}
    mounted = robot / f"mounted{NASTY}.toml"
    mounted.write_text(tomli_w.dumps({"rings": [ring], "scene": {"robot": "robot.toml"}}), "utf-8")
    words = ("--voxel", "0.1", "--target", "V_S", "--radius", "0.5")
    assert ok(run("verify", mounted, *words), printable(f"evil{IN_XML}"), SHOWN_TITLE) == 0
    found = run("robustness", mounted, *words, "--draws", "1")
    assert ok(found, printable(LINKS[1]), SHOWN_TITLE) == 0
    assert ok(run("cones", mounted)) == 0
    code, out, err = run("verify", mounted, *words, "--json")
    assert ok((code, out, err)) == 0
    assert json.loads(out)["setup"] == str(mounted)
    assert ok(run("export", mounted, "--to", "csv", "--out", NASTY), SHOWN_TITLE) == 0
    assert (
        ok(run("verify", "n1_8_0", "--robot", made / "evil.urdf"), printable(f"tip{IN_XML}")) == 2
    )


def test_what_is_mounted_by_lists_shows(run, tmp_path):
    """By the name of the file, and by what stands in it."""
    for kind in ("csv", "json"):
        assert ok(run("export", "n1_8_0", "--to", kind, "--out", "lists")) == 0
        (plain,) = (p for p in (tmp_path / "lists").glob(f"*.{kind}"))
        file = plain.rename(tmp_path / f"{NASTY}.{kind}")
        assert ok(run("verify", file, "--voxel", "0.1"), SHOWN_TITLE) == 0
        text = file.read_text().replace("pose", f"p{IN_XML}").replace("tcp", IN_XML)
        (tmp_path / f"bad.{kind}").write_text(text, "utf-8")
        assert ok(run("verify", f"bad.{kind}", "--voxel", "0.1"), r"\u202egnp\x9b31m") == 2


def test_a_hostile_proposal_shows(run, tmp_path):
    """In names that commands print; what a report holds is tested with reports."""
    quoted = json.dumps(NASTY).replace("\x7f", "\\u007f")
    ring, scene = Ring("tool", 0.0, 4), Scene.paper()
    cones = sensor_cones(scene.robot, Setup((ring,)), scene.poses[0].q)
    at = np.asarray(cones.apex[0]).round(3).tolist()
    obstacle = f"{{ name = {quoted}, centre = {at}, size = [0.1, 0.1, 0.1] }}"
    rings = tomli_w.dumps({"rings": [{"link": ring.link, "position": 0.0, "count": ring.count}]})
    keys = f'[scene]\nocclusion = "shadow"\nobstacles = [{obstacle}]\n'
    (tmp_path / "p.toml").write_text(rings + keys, "utf-8")
    assert ok(run("verify", "p.toml", "--target", "V_O", "--voxel", "0.1"), SHOWN_TITLE) == 0
    for asked in (
        ("verify", f"{NASTY}.toml"),
        ("verify", "p.toml", "--target", NASTY),
        ("verify", "p.toml", f"--{NASTY}", "1"),
        (NASTY,),
        ("verify", "p.toml", "--scene", f"{NASTY}/x.toml"),
    ):
        assert ok(run(*asked), SHOWN_TITLE) == 2


def hostile_scene():
    """The test rig's scene with names that nobody wants, and its setup."""
    named = {m.link: m.link + NASTY for m in SCENE.robot.mounts}
    mounts = tuple(replace(m, link=named[m.link]) for m in SCENE.robot.mounts)
    robot = replace(SCENE.robot, name=f"arm{NASTY}", mounts=mounts)
    obstacles = tuple(replace(o, name=o.name + NASTY) for o in SCENE.obstacles)
    scene = replace(SCENE, robot=robot, obstacles=obstacles, targets=(Shell(0.25),))
    return scene, replace(SETUP, rings=tuple(replace(r, link=named[r.link]) for r in SETUP.rings))


def test_a_hostile_recording_shows(run, tmp_path):
    scene, setup = hostile_scene()
    about = PlannedCheck(
        name=f"small{NASTY}",
        proposal=ProposalFile.of(setup, scene),
        seed=3,
        simulated=False,
        moved=False,
        stale_s=0.08,
        voxel=0.2,
        ports=[Port(name=f"port {NASTY}", count=r.count, baud=460800) for r in setup.rings],
        seconds=1.0,
        wave=False,
        stops=None,
        trials=[],
        version=f"0{NASTY}",
    )
    with Recording(tmp_path / "tape.rig", {"check": about.header}) as recording:
        for kind in ("link ended", "ring ended", "note", NASTY):
            more = {"what": kind, "why": NASTY, "detail": NASTY, "note": NASTY, "ring": 0}
            recording.put(Record(Kind.EVENT, 0, 100.0, json.dumps(more).encode()))
    code = ok(run("check", "--replay", "tape.rig", "--out", f"out{NASTY}"), SHOWN_TITLE)
    assert code == 3
    folder = tmp_path / f"out{NASTY}"
    page = (folder / "check.html").read_text("utf-8")
    assert unreadable(page) == set()
    assert SHOWN_TITLE in Read(page).text
    assert json.loads((folder / "check.json").read_text("utf-8"))["setup"] == f"small{NASTY}"
    _, out, _ = found = run("check", "--replay", "tape.rig", "--out", "again", "--json")
    ok(found)
    assert json.loads(out)["setup"] == f"small{NASTY}"
    assert ok(run("check", NASTY, "--replay", "tape.rig"), SHOWN_TITLE) == 2


def in_a_terminal(*words, cwd):
    """What a command does in a terminal of its own: its exit code, and what it wrote."""
    leader, follower = pty.openpty()
    env = {
        **os.environ,
        "TERM": "xterm-256color",
        "COLUMNS": "400",
        "LINES": "40",
        "PYTHONUTF8": "1",
    }
    ends = dict.fromkeys(("stdin", "stdout", "stderr"), follower)
    with subprocess.Popen([*_COMMAND, *words], **ends, cwd=cwd, env=env) as child:
        os.close(follower)
        data = b""
        try:
            while part := os.read(leader, 1 << 16):
                data += part
        except OSError:  # the other end is closed
            pass
        finally:
            os.close(leader)
    return child.returncode, data.decode("utf-8")


def test_a_real_terminal_gets_colours_and_moves_of_the_cursor_only(robot):
    ring = {"link": LINKS[1], "position": 0.5, "count": 4}
    proposal = {"rings": [ring], "scene": {"robot": "robot.toml"}}
    (robot / f"p{NASTY}.toml").write_text(tomli_w.dumps(proposal), "utf-8")
    said = [
        in_a_terminal("verify", f"p{NASTY}.toml", "--voxel", "0.1", cwd=robot),
        in_a_terminal("verify", f"{NASTY}\udcff.toml", cwd=robot),
    ]
    assert [left for left, _ in said] == [0, 2]
    for left, text in said:
        assert SHOWN_TITLE in text
        assert "\x1b[" in text or left  # it knew that it wrote to a terminal
        rest = _CURSOR.sub("", _COLOURS.sub("", text)).replace("\r", "")
        assert unreadable(rest) == set()


def test_what_python_itself_prints_shows(tmp_path):
    program = f"""
import logging, sys, threading, warnings
from place_rings.reporting.terminal import guard
guard()
text = {NASTY!r}
warnings.warn(text)
logging.getLogger("place").warning(text)
thread = threading.Thread(target=lambda: (_ for _ in ()).throw(RuntimeError(text)), name=text)
thread.start()
thread.join()
raise RuntimeError(text)
"""
    call = [sys.executable, "-c", program]
    done = subprocess.run(call, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 1
    assert unreadable(done.stderr) == set()
    assert done.stderr.count(SHOWN_TITLE) >= 5


# What is read elsewhere than in a terminal.


class Read(HTMLParser):
    """The text of a page."""

    def __init__(self, page):
        super().__init__()
        self.text = ""
        self.feed(page)

    def handle_data(self, data):
        self.text += data


@given(texts)
def test_pages_show_all_text(tmp_path_factory, text):
    """Escaped or not: what a page's author forgot shows as well."""
    cells = table(("a", "b"), [(escaped(text), "x")])
    markdown = f"{escaped(text)}\n\n{cells}\n{code(text)}\n\n{text}\n"
    page = html(markdown, tmp_path_factory.getbasetemp(), text)
    assert unreadable(page) == set()
    assert unreadable(escaped(text)) == unreadable(code(text)) == set()


@pytest.mark.parametrize("write", ["rendering", "plot"])
def test_names_in_pictures_show(tmp_path, write):
    """matplotlib warns of characters that no font has, and warnings are errors here."""
    figure = Figure(figsize=(2, 2))
    figure.subplots().set_title(NASTY)
    figure.text(0, 0, f"a{NASTY}\nb")
    dollar = r"$\frac$" if write == "rendering" else ""  # no formula
    figure.legend(handles=[Patch(label=f"{NASTY}{dollar}")])
    kept = tmp_path / "x.png"
    write_png(kept, figure) if write == "rendering" else save(figure, kept)
    shown = [t.get_text() for t in figure.findobj(lambda a: hasattr(a, "get_text"))]
    assert printable_lines(f"a{NASTY}\nb") in shown
    assert unreadable("".join(shown)) == set()


@given(texts)
def test_the_viewers_words_show(text):
    said = words.heading([text], text, [1], [1]) + words.note(text)
    said += words.legend([0.1] * len(KINDS), text, text) + words.proof_table(text, [])
    said += words.zeta_table([text], [words.TableRow(text, ((0.1, 0.2),))], text, text)
    said += words.headline(0.1, text, text, text) + words.link(text)
    assert unreadable(said) == set()


@given(st.lists(texts, min_size=1, unique=True))
def test_the_viewers_choices_show_and_mean_one_name_each(names):
    found = labelled(names)
    assert list(found.values()) == names
    assert unreadable("".join(found)) == set()


def test_the_viewers_controls_show_and_choose_links():
    from place_rings.viewer.server import Server
    from place_rings.viewer.session import ViewerSession

    scene, setup = hostile_scene()
    with Server(
        ViewerSession(replace(scene, obstacles=()), {NASTY: setup, f"b{NASTY}": setup})
    ) as server:
        client = Client(server.url)
        try:
            client.until(lambda: client.zeta("V_S(0.25)") is not None, "the page says no ζ")
            said = json.dumps(client.controls, ensure_ascii=False, default=str)
            assert unreadable(said) == set()
            as_json = r"\\u(00[019]|007f)|\\[bfrt]"  # how JSON writes control characters
            assert not re.search(as_json, said.replace(r"\\", ""))
            client.set("Link", printable(scene.robot.links[0]))
            client.until(
                lambda: client.value("Ring").startswith(f"0: {scene.robot.links[0][:4]}"),
                "the ring stayed",
            )
        finally:
            client.close()


@given(texts)
def test_comments_of_a_file_leave_it_toml(text):
    model = ProposalFile(rings=[{"link": "forearm", "position": 0.5, "count": 4}])
    written = to_toml(model, f"About\n{text}").encode("utf-8", "replace").decode()
    assert tomllib.loads(written)["rings"][0]["count"] == 4
    assert unreadable(written) == set()


def test_names_of_any_kind_make_a_scene_that_reads_back(tmp_path):
    from place_rings.cli.runs.robot import scene_text

    scene, _ = hostile_scene()
    long = replace(scene.robot.mounts[0], link=f'"\\{NASTY}' + "x" * 60)
    robot = replace(scene.robot, name="a\n[rules]\nb", mounts=(long, *scene.robot.mounts[1:]))
    found = tomllib.loads(scene_text(robot, "robot.toml"))
    assert list(found["mounts"]) == list(robot.links)
    assert "rules" not in found
