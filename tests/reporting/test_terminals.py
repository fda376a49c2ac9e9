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
from place_rings.reporting.tables import count_error_line
from place_rings.reporting.terminal import Terminal

VERIFY = ["verify", "n1_8_0", "--target", "V_S", "--radius", "0.5", "--voxel", "0.05"]


def run(words, **environment):
    """Exit code, stdout and stderr (bytes) of a command in a process of its own."""
    code = "from place_rings.cli.entry import main; main()"
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "PYTHONUTF8")}
    ended = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, env=kept | environment
    )
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.long
@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp437", "utf-8"])
@pytest.mark.parametrize("more", [[], ["--json"]])
def test_a_count_is_printed_whatever_the_terminal_can_encode(encoding, more):
    code, out, err = run([*VERIFY, *more], PYTHONIOENCODING=encoding)
    assert code == 0, err
    text = out.decode(encoding)
    zeta = json.loads(text)["zeta_percent"] if more else None
    assert zeta is None or 10 < zeta < 30
    assert more or re.search(r"n1_8_0\D+24\D+1\d\.\d\d", text)


def test_errors_are_printed_in_ascii():
    code, out, err = run(["verify", "n1_8_0", "--target", "V_ζ"], PYTHONIOENCODING="ascii")
    assert (code, out) == (2, b"")
    assert b"zeta" in err


def test_no_color_means_no_escapes():
    code, out, _ = run(VERIFY, NO_COLOR="1", FORCE_COLOR="", TERM="xterm")
    assert code == 0
    assert b"\x1b" not in out


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_a_table_fits_the_window_and_keeps_its_figures(columns):
    code, out, _ = run(VERIFY, COLUMNS=str(columns))
    text = out.decode()
    assert code == 0
    assert max(len(line) for line in text.splitlines() if line[:1] in "┏┃┡│└") <= columns
    assert re.search(r"1\d\.\d\d", text)


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


@pytest.mark.parametrize(("voxel", "points"), [(0.005, "0.05"), (0.01, "0.1"), (0.1, "1")])
def test_a_count_states_its_error(voxel, points):
    assert f" {points} points;" in count_error_line(voxel)
    assert count_error_line(0.3) is None
