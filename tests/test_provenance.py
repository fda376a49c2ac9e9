"""Records of measurements: the code that a page's measurement can reach, machine and load."""

import inspect
import json
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.studies.engine.import_closure import ImportGraph
from place_rings.studies.engine.provenance import (
    BUSY,
    MeasurementRecorder,
    MeasurementRun,
    Provenance,
    ProvenanceError,
    digests,
    from_json,
    sentences,
)

from .rooms import ROOT

STEP = runpy.run_path(str(ROOT / ".ci" / "results.py"))
RUN = MeasurementRun(
    "2026-01-01 10:00", "a" * 40, [], "a machine", {"numpy": "2"}, 9.0, 0.1, 0.9, 0.02
)
RECORD = Provenance("a command", ["high/task.py"], files={"high/task.py": "1" * 12}, runs=[RUN])
share = st.floats(0, 4)


def written(root, **files):
    """Write files of a checkout; ``__`` separates folders, rooms are those named here."""
    for name, text in files.items():
        file = root.joinpath(*name.split("__")).with_suffix(".py")
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.parent.name != "bench":
            (file.parent / "__init__.py").touch()
        file.write_text(text)
    return root


def reached(root, name):
    return set(digests([root / name], ImportGraph(root))) - {"high/__init__.py", "low/__init__.py"}


@pytest.mark.parametrize(
    "statement",
    [
        "from beside import X",
        "import beside",
        "import subprocess, sys\nsubprocess.run([sys.executable, 'beside.py'])",
    ],
)
def test_a_benchmark_reaches_the_files_beside_it(statement, tmp_path):
    root = written(tmp_path, bench__a=statement, bench__beside="X = 1", bench__other="")
    assert reached(root, "bench/a.py") == {"bench/a.py", "bench/beside.py"}


@pytest.mark.parametrize(
    "statement",
    ["run('-m', 'place_rings.low.leaf')", "run('-c', 'from place_rings.low.leaf import X; X()')"],
)
def test_a_text_of_a_benchmark_that_names_a_module_stands_for_an_import(statement, tmp_path):
    root = written(tmp_path, bench__a=statement, low__leaf="X = 1", low__other="")
    assert reached(root, "bench/a.py") == {"bench/a.py", "low/leaf.py"}


@pytest.mark.parametrize("place", ["bench__a", "high__a"])
def test_a_module_that_loads_others_by_name_stands_for_all(place, tmp_path):
    root = written(tmp_path, **{place: "import importlib"}, low__leaf="X = 1")
    assert "low/leaf.py" in reached(root, place.replace("__", "/") + ".py")


def test_a_docstring_names_nothing(tmp_path):
    text = '"""place_rings.low.leaf, beside.py, data"""\n'
    root = written(tmp_path, bench__a=text, bench__beside="", low__leaf="")
    (tmp_path / "bench/data").mkdir()
    (tmp_path / "bench/data/one.csv").touch()
    assert reached(root, "bench/a.py") == {"bench/a.py"}


def test_data_files_that_code_names_count_with_every_byte(tmp_path):
    root = written(tmp_path, high__task="FOLDER, FILE = 'data', 'one.toml'", low__leaf="")
    (root / "high/data/deep").mkdir(parents=True)
    for name in ("data/deep/a.csv", "one.toml", "two.toml"):
        (root / "high" / name).write_text("x")
    before = digests([root / "high/task.py"], ImportGraph(root))
    assert set(before) - {"high/__init__.py"} == {
        "high/task.py",
        "high/data/deep/a.csv",
        "high/one.toml",
    }
    (root / "high/data/deep/a.csv").write_text("# x")
    after = digests([root / "high/task.py"], ImportGraph(root))
    assert replace(RECORD, files=before).changes(after) == ["high/data/deep/a.csv"]


def test_files_that_a_command_names_count(checkout, capsys):
    record, mine = checkout / "results/one/provenance.json", checkout / "mine.toml"
    mine.write_text("x = 1")
    files = digests([checkout / "high/task.py"], ImportGraph(checkout), [mine])
    read = from_json(record.read_text())
    record.write_text(replace(read, files=files, inputs=["mine.toml"]).to_json())
    assert checked(checkout, capsys)[1] == "results: 3 of 3 match the code\n"
    mine.write_text("x = 2")
    assert "    changed: mine.toml\n" in checked(checkout, capsys)[1]
    mine.unlink()
    assert "    gone: mine.toml\n" in checked(checkout, capsys)[1]


@given(share, share, st.floats(0, 1), st.integers(1, 3))
def test_a_page_says_that_the_machine_was_busy_if_and_only_if_it_was(before, after, others, runs):
    quiet = replace(RUN, load_before=0.0, others=0.0)
    last = replace(RUN, load_before=before, load_after=after, others=others)
    record = replace(RECORD, runs=[quiet] * (runs - 1) + [last])
    assert ("busy" in sentences(record, "x.json")) == (max(before, others) > BUSY)
    assert from_json(record.to_json()) == record


@pytest.mark.parametrize(
    "record",
    [
        RECORD,
        replace(RECORD, kind="reconstructed", commit="b" * 40, runs=[]),
        replace(RECORD, kind="unrecorded", files={}, runs=[]),
    ],
    ids=lambda record: record.kind,
)
def test_a_record_is_read_as_it_was_written(record):
    assert from_json(record.to_json()) == record
    assert sentences(record, "x.json")


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ({"format": 9}, "format: found 9"),
        ({"kind": "guessed"}, "kind: found 'guessed'"),
        ({"files": {"high/task.py": "2" * 12}}, "digest: found"),
        ({"files": {}, "digest": "e3b0c44298fc1c14"}, "files and sources: found none"),
        ({"runs": []}, "runs: only a measured page"),
        ({"runs": [{"ended": "today"}]}, "found no record"),
        ({"more": 1}, "found no record"),
    ],
)
def test_a_broken_record_is_refused(damage, said):
    with pytest.raises(ProvenanceError, match=said):
        from_json(json.dumps(json.loads(RECORD.to_json()) | damage))


@pytest.mark.parametrize("text", ["", "[]", "{", "null", '"x"', '{"format": 1}'])
def test_what_is_no_record_is_refused(text):
    with pytest.raises(ProvenanceError):
        from_json(text)


def test_a_resumed_measurement_keeps_its_runs_as_long_as_the_code_is_the_same(tmp_path):
    source, file = Path(inspect.getfile(ImportGraph)), tmp_path / "record.json"  # as installed
    first = MeasurementRecorder("a command", [source]).record(file)
    assert first.sources == ["studies/engine/import_closure.py"]
    assert (first.runs[0].reused, first.runs[0].seconds) == (0, pytest.approx(0, abs=30))
    file.write_text(first.to_json())
    second = MeasurementRecorder("a command", [source]).record(file)
    assert second.runs[0] == first.runs[0]
    assert len(second.runs) == 2
    nothing_new = MeasurementRecorder("a command", [source])
    nothing_new.count(0, 5)
    assert nothing_new.record(file) == first
    file.write_text(replace(first, files={"other.py": "1"}).to_json())
    assert len(MeasurementRecorder("a command", [source]).record(file).runs) == 1


@pytest.fixture
def checkout(tmp_path):
    """A checkout with a study's page, and a page of two sections, all with records."""
    root = written(tmp_path, high__task="from ..low import leaf", low__leaf="X = 1", bench__a="")
    pages = {
        "results/one/README.md": "# One\n",
        "results/many.md": "# Many\n\n<!-- a -->\nA\n\n<!-- b -->\nB\n",
    }
    for name, text in pages.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    records = {"one/provenance": "high/task.py", "many/a": "bench/a.py", "many/b": "bench/a.py"}
    for name, source in records.items():
        file = root / "results" / f"{name}.json"
        file.parent.mkdir(exist_ok=True)
        files = digests([root / source], ImportGraph(root))
        file.write_text(Provenance(f"measure {name}", [source], files=files, runs=[RUN]).to_json())
    return root


def checked(root, capsys):
    code = STEP["main"](root)
    out, err = capsys.readouterr()
    return code, out, err


def test_comments_and_docstrings_make_no_page_old(checkout, capsys):
    (checkout / "low/leaf.py").write_text('"""A text."""\n# a comment\nX = 1\n"""The X."""\n')
    assert checked(checkout, capsys) == (0, "results: 3 of 3 match the code\n", "")


def test_an_old_page_is_listed_with_its_command_and_the_modules_that_changed(checkout, capsys):
    (checkout / "low/leaf.py").write_text("from . import new\nX = 2")
    (checkout / "low/new.py").touch()
    code, out, err = checked(checkout, capsys)
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "results: 2 of 3 match the code",
        "older than the code: results/one/README.md",
        "    changed: low/leaf.py; new: low/new.py",
        "    measure it again: measure one/provenance",
    ]


def test_a_page_whose_benchmark_is_gone_is_listed(checkout, capsys):
    (checkout / "bench/a.py").unlink()
    code, out, _ = checked(checkout, capsys)
    assert code == 0
    assert out.count("is gone: bench/a.py") == 2


@pytest.mark.parametrize("text", [None, "", "{}", "\0"])
def test_a_page_without_a_usable_record_fails_the_step(text, checkout, capsys):
    file = checkout / "results/many/b.json"
    file.unlink() if text is None else file.write_text(text)
    code, _, err = checked(checkout, capsys)
    assert code == 1
    assert err.startswith("results: results/many/b.json of results/many.md, b: ")


def test_every_page_of_this_checkout_has_a_place_for_its_record():
    pages = list(STEP["pages"](ROOT / "results"))
    assert len({page.record for page in pages}) == len(pages) > 20
    assert not [page.name for page in pages if not page.record.is_file()]


def test_reading_records_imports_no_numerical_library():
    code = (
        f"import runpy, sys; runpy.run_path({str(ROOT / '.ci/results.py')!r});"
        " print(sys.modules.keys() & {'jax', 'numpy'})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
