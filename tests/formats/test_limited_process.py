"""Reading in a process of its own: what works too long is ended by its processor time, and what
waits is not taken for that."""

import pytest
from place_rings.formats.layouts import mat_process
from place_rings.formats.limited_process import MOST_S, answer_of
from place_rings.formats.mesh_readers import usd_process

resource = pytest.importorskip("resource")


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write a module, and return its name."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))

    def written(text):
        (tmp_path / "reader_of_a_test.py").write_text(text)
        return "reader_of_a_test"

    return written


def test_a_reader_that_works_without_end_is_ended_by_its_processor_time(module):
    limits = "from place_rings.formats.limited_process import limit\nlimit(1 << 30, 1)\n"
    answer = answer_of(module(f"{limits}print('begun', flush=True)\nwhile True: pass\n"))
    assert answer.startswith(b"a file that")


def test_a_reader_that_waits_is_ended_by_the_clock(module):
    name = module("import time\ntime.sleep(600)\n")
    assert answer_of(name, seconds=1) == b"a file that takes too long to read"


@pytest.mark.parametrize("reader", [usd_process, mat_process])
def test_the_clock_leaves_each_reader_several_times_its_processor_time(reader):
    """So that a busy machine does not refuse a good file."""
    assert MOST_S >= 8 * reader._SECONDS
