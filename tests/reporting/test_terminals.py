"""Terminals as they are: encodings without our characters, pipes, narrow windows, no colours."""

import json
import os
import re
import subprocess
import sys
import time
from io import StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.reporting import progress
from place_rings.reporting.explained import Explained
from place_rings.reporting.terminal import Terminal
from place_rings.reporting.text import with_error

VERIFY = "verify n1_8_0 --target V_S --radius 0.5 --voxel 0.1"


ONCE = """
import json, os, sys
from place_rings.cli.entry import main
for environment in json.loads(sys.argv[1]):
    os.environ.update(environment)
    sys.argv = ["place-rings", *environment["WORDS"].split()]
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(encoding=environment.get("ENCODING", "utf-8"), errors="strict")
    try:
        main()
    except SystemExit as stop:
        assert (stop.code or 0) == int(environment.get("CODE", 0))
    print(flush=True)
    sys.stdout.buffer.write(b"\\0")
    sys.stdout.flush()
    sys.stderr.flush()
"""


def run(*environments):
    """Stdout of a command in each of some environments, one after another in a process that writes
    to pipes, and all of stderr (bytes)."""
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "PYTHONUTF8")}
    command = [sys.executable, "-c", ONCE, json.dumps(environments)]
    done = subprocess.run(command, capture_output=True, env=kept)
    assert done.returncode == 0, done.stderr
    return done.stdout.split(b"\0")[:-1], done.stderr


def test_a_count_is_printed_whatever_the_terminal_can_encode_and_shows():
    encodings, columns = ("ascii", "cp1252", "cp437", "utf-8"), (60, 80, 120)
    tables = [{"WORDS": VERIFY, "ENCODING": name} for name in encodings]
    objects = [{**one, "WORDS": f"{VERIFY} --json"} for one in tables]
    plain = {"WORDS": VERIFY, "NO_COLOR": "1", "FORCE_COLOR": "", "TERM": "xterm"}
    windows = [{"WORDS": VERIFY, "COLUMNS": str(width)} for width in columns]
    bad = {"WORDS": "verify n1_8_0 --target V_ζ", "ENCODING": "ascii", "CODE": "2"}
    found, err = run(*tables, *objects, plain, *windows, bad)
    for name, table, one in zip(encodings, found, found[4:], strict=False):
        assert re.search(r"n1_8_0\D+24\D+1\d\.\d\d", table.decode(name))
        assert 10 < json.loads(one.decode(name))["zeta_percent"] < 30
    assert not [text for text in found[4:] if b"\x1b" in text]
    for width, text in zip(columns, found[9:12], strict=True):
        lines = text.decode().splitlines()
        assert max(len(line) for line in lines if line[:1] in ("┏", "┃", "┡", "│", "└")) <= width
        assert re.search(r"1\d\.\d\d", text.decode())
    assert found[12].strip() == b""
    assert b"zeta" in err  # in ASCII


def test_a_pipe_gets_a_line_at_intervals_until_all_is_done(monkeypatch, capsys):
    monkeypatch.setattr(progress, "EVERY", 0.05)
    with progress.ProgressBar(Terminal(file=StringIO())) as bar:
        task = bar.add_task("counting", total=4, best="best so far 12.0 %")
        bar.update(task, completed=1)
        end = time.monotonic() + 20
        seen = ""
        while "1 of 4" not in seen and time.monotonic() < end:
            time.sleep(0.01)
            seen += capsys.readouterr().err
    assert re.search(r"counting, 1 of 4, best so far 12\.0 %, \d+ s\n", seen)


def test_a_terminal_gets_a_bar_and_no_lines(monkeypatch, capsys):
    monkeypatch.setattr(progress, "EVERY", 0.01)
    console = Terminal(file=StringIO(), force_terminal=True, width=80)
    with progress.ProgressBar(console) as bar:
        bar.add_task("counting", total=4)
        time.sleep(0.1)
    assert capsys.readouterr().err == ""
    assert "counting" in console.file.getvalue()


@given(st.text("abc ", min_size=1), st.floats(0, 100), st.none() | st.floats(1, 100))
def test_a_finished_task_is_not_reported(description, completed, total):
    bar = progress.ProgressBar(Terminal(file=StringIO()))
    task = bar.add_task(description, total=total)
    bar.update(task, completed=completed)
    finished = total is not None and completed >= total
    assert (bar.line() is None) == finished


@given(st.floats(0, 100), st.floats(0, 1))
def test_a_count_is_written_with_its_error_rounded_up(percent, error):
    zeta, _, stated = with_error(percent, error).partition(" ± ")
    assert float(zeta) == pytest.approx(percent, abs=0.0051)
    assert 100 * error - 1e-6 <= float(stated) <= 100 * error + 0.0101
    assert with_error(percent, None) == zeta


def test_a_table_wider_than_the_terminal_is_turned_and_keeps_every_cell():
    heads = ("setup", *(f"V_S(0.{i}) dark clothing" for i in range(9)))
    rows = [[name, *(f"{i}.25 ± 1.37" for i in range(9))] for name in ("proposal", "n1_8_0")]
    console = Terminal(file=StringIO(), force_terminal=True, width=80, color_system=None)
    console.print(Explained.of("title", heads, rows, "text", bold=("proposal",)))
    lines = console.file.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    for i in range(9):
        assert sum(heads[i + 1] in line and line.count(rows[0][i + 1]) == 2 for line in lines) == 1
