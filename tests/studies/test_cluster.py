"""Studies on many processes: the same cells, kept one by one, whatever becomes of workers and
drivers.
"""

import os
import subprocess
import sys
from pathlib import Path

import dask
import psutil
import pytest
from distributed import LocalCluster
from place_rings.formats.errors import UserError
from place_rings.studies.engine import cluster, distribution
from place_rings.studies.engine import runner as engine
from place_rings.studies.engine.registry import TASKS
from place_rings.studies.engine.store import Cell, Store

from . import odd_works
from .odd_works import ALL

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
ODD = {"distributed.worker.preload": [odd_works.__file__]}


@pytest.fixture(scope="module")
def client():
    """Two workers that know some odd works."""
    before = set(os.environ)
    with dask.config.set(ODD), cluster.here(2) as found:
        yield found
    assert set(os.environ) <= before


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "cells.sqlite", "test") as found:
        yield found


def zetas():
    """Cells of two targets and two rules, one of them twice."""
    counts = (("centre", 0.05, 0.0), ("certified", None, 0.2))
    found = [
        Cell(
            "zeta",
            {
                "scene": {},
                "setup": s,
                "target": "V_S",
                "radius": r,
                "rule": rule,
                "voxel": voxel,
                "width": width,
            },
        )
        for rule, voxel, width in counts
        for r in (0.5, 0.9)
        for s in ("n1_8_0", "n2_16_25")
    ]
    return [*found, found[0]]


def timeless(results):
    return [{key: value for key, value in result.items() if key != "seconds"} for result in results]


def ends(folder, *times):
    """Cells that end their worker so many times."""
    return [Cell("end", {"x": x, "times": n, "folder": str(folder)}) for x, n in enumerate(times)]


def test_many_workers_find_what_one_finds(client, store, tmp_path):
    told = []
    found = distribution.run(client, zetas(), ALL, store, lambda *at: told.append(at))
    with Store(tmp_path / "one.sqlite", "test") as one:
        assert timeless(engine.run(zetas(), TASKS, one)) == timeless(found)
    assert told == [(i, 8) for i in range(9)]
    assert engine.run(zetas(), {}, store) == found  # all was kept
    assert distribution.run(client, zetas(), ALL, store) == found


def test_the_cluster_listens_on_this_machine_alone(client):
    client.wait_for_workers(2)  # one that an earlier test ended comes again
    family = [psutil.Process(), *psutil.Process().children(recursive=True)]
    listening = [
        c.laddr.ip for p in family for c in p.net_connections() if c.status == psutil.CONN_LISTEN
    ]
    assert len(listening) > 4
    assert set(listening) == {"127.0.0.1"}
    assert client.scheduler.address.startswith("tls://")


def test_a_lost_worker_costs_no_cell(client, store, tmp_path):
    cells = ends(tmp_path, 0, 1, 0, 0)
    assert distribution.run(client, cells, ALL, store) == [0, 1, 4, 9]


def test_a_cell_that_ends_every_worker_is_named_and_the_rest_kept(
    client, store, tmp_path, monkeypatch
):
    monkeypatch.setattr(distribution, "_LOSSES", 2)
    cells = ends(tmp_path, 0, 99)
    with pytest.raises(UserError, match=r'"end",.*"x":1}.*ended its worker 2 times'):
        distribution.run(client, cells, ALL, store)
    assert [store.get(cell) for cell in cells] == [0, None]


def test_ctrl_c_keeps_what_is_finished(client, store, tmp_path):
    cells, told = ends(tmp_path, *[0] * 20), []

    def stop_at_the_fifth(done, total):
        told.append(done)
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        distribution.run(client, cells, ALL, store, stop_at_the_fifth)
    assert sum(store.get(cell) is not None for cell in cells) >= 5
    assert distribution.run(client, cells, ALL, store) == [x * x for x in range(20)]


def test_an_error_of_a_work_is_the_same_as_with_one_process(client, store):
    with pytest.raises(ValueError, match="7 is refused"):
        distribution.run(client, [Cell("refuse", {"x": 7})], ALL, store)


def test_a_worker_with_another_program_measures_nothing(client, store):
    cells = zetas()
    with pytest.raises(UserError, match=r"task 'zeta' is from .* the same version"):
        distribution.run(client, cells, {**TASKS, "zeta": engine.run}, store)
    assert [store.get(cell) for cell in cells] == [None] * len(cells)


@pytest.fixture
def certificate(client):
    """Who has it may join the tests' own cluster."""
    names = {
        "ca-file": "tls_ca_file",
        "client.cert": "tls_client_cert",
        "client.key": "tls_client_key",
    }
    with dask.config.set(
        {
            f"distributed.comm.tls.{key}": getattr(client.security, name)
            for key, name in names.items()
        }
    ):
        yield


def test_a_running_scheduler_is_joined(client, certificate, store, tmp_path):
    with cluster.there(client.scheduler.address) as joined:
        assert distribution.run(joined, ends(tmp_path, 0, 0), ALL, store) == [0, 1]


@pytest.mark.parametrize("needed", ["place_rings.soul", "soul.place_rings"])
def test_a_cluster_without_the_program_is_refused_in_a_line(
    needed, client, certificate, monkeypatch
):
    monkeypatch.setattr(cluster, "_NEEDED", needed)
    with (
        pytest.raises(UserError, match=f"lacks {needed}"),
        cluster.there(client.scheduler.address),
    ):
        pass


def test_the_local_cluster_is_joined_by_no_other(client, monkeypatch):
    monkeypatch.setattr(cluster, "_ANSWER", 1.0)
    plain = client.scheduler.address.replace("tls://", "tcp://")
    with pytest.raises(UserError, match="no scheduler answers"), cluster.there(plain):
        pass


def test_a_scheduler_that_cannot_be_used_is_refused_in_a_line(monkeypatch):
    monkeypatch.setattr(cluster, "_WORKER", 0.1)
    quiet = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(
        n_workers=0, host="127.0.0.1", dashboard_address=None, scheduler_kwargs=quiet
    ) as empty:
        address = empty.scheduler_address
        with pytest.raises(UserError, match="has no workers"), cluster.there(address):
            pass
    monkeypatch.setattr(cluster, "_ANSWER", 1.0)
    with pytest.raises(UserError, match="no scheduler answers"), cluster.there(address):
        pass


@pytest.mark.slow
def test_studies_survive_kills(tmp_path):
    """Up to two kills of the driver, then of workers; the script checks cells and processes."""
    command = [sys.executable, str(BENCHMARKS / "kills.py"), "2", "2", "0", "60"]
    # the script imports its neighbours
    own = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    subprocess.run(command, check=True, timeout=300, stdout=subprocess.DEVNULL, env=own)
