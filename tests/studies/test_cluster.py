"""Studies on many processes: the same cells, kept one by one, whatever becomes of workers and
drivers.
"""

import os
import subprocess
import sys
from importlib.metadata import version

import dask
import psutil
import pytest
from distributed import LocalCluster
from place_rings.coverage.definitions.errors import UserError
from place_rings.studies.engine import cluster, distribution
from place_rings.studies.engine import runner as engine
from place_rings.studies.engine.runner import TASKS
from place_rings.studies.engine.store import Cell, Store

from . import odd_works
from .odd_works import ALL

pytestmark = pytest.mark.slow

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
    """Cells of two rules, one of them twice."""
    counts = (
        {"rule": "centre", "voxel": 0.1, "width": 0.0},
        {"rule": "certified", "voxel": None, "width": 0.3},
    )
    found = [
        Cell("zeta", {"scene": {}, "setup": s, "target": "V_S", "radius": 0.5, **count})
        for count in counts
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
    assert told == [(i, 4) for i in range(5)]
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


def test_a_lost_worker_costs_no_cell_and_a_cell_that_ends_every_worker_is_named(
    client, store, tmp_path, monkeypatch
):
    cells = ends(tmp_path, 0, 1, 0, 0)
    assert distribution.run(client, cells, ALL, store) == [0, 1, 4, 9]
    monkeypatch.setattr(distribution, "_LOSSES", 1)
    cells = ends(tmp_path, 0, 1, 99)
    with pytest.raises(UserError, match=r'"end",.*"x":2}'):
        distribution.run(client, cells, ALL, store)
    assert [store.get(cell) for cell in cells] == [0, 1, None]


def test_ctrl_c_keeps_what_is_finished(client, store, tmp_path):
    cells, told = ends(tmp_path, *[0] * 12), []

    def stop_at_the_fifth(done, total):
        told.append(done)
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        distribution.run(client, cells, ALL, store, stop_at_the_fifth)
    assert sum(store.get(cell) is not None for cell in cells) >= 5
    assert distribution.run(client, cells, ALL, store) == [x * x for x in range(12)]


def test_an_error_of_a_task_is_the_same_as_with_one_process(client, store):
    with pytest.raises(ValueError, match="7 is refused"):
        distribution.run(client, [Cell("refuse", {"x": 7})], ALL, store)


def test_a_worker_with_another_version_measures_nothing(client, store, monkeypatch):
    cells = zetas()
    monkeypatch.setattr(distribution, "version", lambda _: "99.9")  # of this process alone
    with pytest.raises(UserError, match=rf"{version('place-rings')}.* 99\.9"):
        distribution.run(client, cells, TASKS, store)
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


def test_a_scheduler_that_cannot_be_used_is_refused(client, certificate, monkeypatch):
    """A cluster without the program, one that is another's own, one without workers, and none."""
    address = client.scheduler.address

    def refused(address):
        with pytest.raises(UserError, match=r"^--scheduler: ") as error, cluster.there(address):
            pass
        return str(error.value)

    for needed in ("place_rings.soul", "soul.place_rings"):
        with monkeypatch.context() as patch:
            patch.setattr(cluster, "_NEEDED", needed)
            assert needed in refused(address)
    monkeypatch.setattr(cluster, "_WORKER", 0.1)
    quiet = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(
        n_workers=0, host="127.0.0.1", dashboard_address=None, scheduler_kwargs=quiet
    ) as empty:
        found = empty.scheduler_address
        assert found in refused(found)
    monkeypatch.setattr(cluster, "_ANSWER", 0.3)
    for silent in (found, address.replace("tls://", "tcp://")):
        assert silent in refused(silent)


DRIVER = """
import sys
import dask
from pathlib import Path
from place_rings.studies.engine import cluster, distribution
from place_rings.studies.engine.store import Store
sys.path.insert(0, sys.argv[1])
import odd_works
cells = [odd_works.Cell("nap", {"x": x}) for x in range(200)]
if __name__ == "__main__":
    with (
        dask.config.set({"distributed.worker.preload": [odd_works.__file__]}),
        cluster.here(1) as client,
        Store(Path("cells.sqlite"), "test") as store,
    ):
        distribution.run(client, cells, odd_works.ALL, store, lambda *at: print(*at, flush=True))
"""


@pytest.mark.slow
def test_a_killed_driver_leaves_no_process_and_loses_no_stored_cell(tmp_path):
    program = tmp_path / "driver.py"  # its workers read it, too
    program.write_text(DRIVER)
    command = [sys.executable, str(program), os.path.dirname(odd_works.__file__)]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as driver:
        assert driver.stdout is not None
        while int(driver.stdout.readline().split()[0]) < 3:
            pass
        family = psutil.Process(driver.pid).children(recursive=True)
        driver.kill()
    assert psutil.wait_procs(family, timeout=60)[1] == []
    cells = [Cell("nap", {"x": x}) for x in range(200)]
    with Store(tmp_path / "cells.sqlite", "test") as store:
        kept = {cell.arguments["x"]: store.get(cell) for cell in cells[:20]}
        assert sum(result is not None for result in kept.values()) >= 3
        assert all(result in (None, x * x) for x, result in kept.items())
        measured = []
        works = {"nap": lambda x: measured.append(x) or x * x}
        assert engine.run(cells, works, store) == [x * x for x in range(200)]
        assert set(measured) & {x for x in kept if kept[x] is not None} == set()
