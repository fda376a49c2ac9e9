"""Clusters of processes for studies: local ones, or those of a running scheduler.

Dask's own messages carry Python objects: whoever reaches a scheduler can run code on all its
machines. The local cluster therefore listens on 127.0.0.1 only, with a private certificate. Join
only a scheduler that you trust.
"""

import asyncio
import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from multiprocessing import resource_tracker

import dask
from distributed import Client, LocalCluster
from distributed.security import Security

from ...coverage.definitions.errors import UserError

_NEEDED = f"{__package__}.distribution"
_ANSWER, _WORKER = 30.0, 30.0  # s, timeouts for a scheduler's answer and for its first worker
_START = 300.0  # s, for a worker to start on a busy machine
_GRACE = 1.0  # s, for a worker to end
_LOCAL = {
    "distributed.worker.multiprocessing-method": "spawn",  # JAX's threads do not survive a fork
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": (
        {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")} | {"NPROC": "1"}
    ),  # XLA's name of the option
    # this process handles losses, as it knows which cells are finished
    "distributed.scheduler.allowed-failures": 0,
    # restart a worker, however long that takes
    "distributed.deploy.lost-worker-timeout": "365 days",
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.http.routes": [],
}


@contextmanager
def here(workers: int) -> Iterator[Client]:
    """Yield a cluster of ``workers`` local processes, which end with this process in every
    case.
    """
    environment = set(os.environ)
    with dask.config.set(_LOCAL):
        with _uninterrupted() as pressed:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=0,
                host="127.0.0.1",
                protocol="tls://",
                security=Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                death_timeout=_START,
                silence_logs=logging.CRITICAL,
            )
            client = Client(cluster, set_as_default=False)
        try:
            if pressed:
                raise KeyboardInterrupt
            yield client
        finally:
            with _uninterrupted():
                cluster.sync(_close, cluster)
                client.close()
                cluster.close()
                for name in (
                    set(os.environ) - environment
                ):  # variables that were set for the workers
                    del os.environ[name]


@contextmanager
def _uninterrupted() -> Iterator[list[int]]:
    """Only record Ctrl-C, as half a cluster cannot be closed.

    Threads and processes that start in this context never receive it.
    """
    pressed: list[int] = []
    resource_tracker.ensure_running()  # started below, it would unblock the signals
    handler = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield pressed
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


async def _close(cluster: LocalCluster) -> None:
    """End the workers without waiting for their current cells."""
    with suppress(TimeoutError):
        await asyncio.gather(*(nanny.close(timeout=_GRACE) for nanny in cluster.workers.values()))


@contextmanager
def there(scheduler: str) -> Iterator[Client]:
    """Yield the cluster of a running scheduler.

    Raises:
        UserError: if there is no scheduler at that address, or it has no workers, or no
            place-rings.
    """
    # errors are reported in one line
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
    except OSError as error:
        raise UserError(f"--scheduler: no scheduler answers at {scheduler}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError as error:
            raise UserError(f"--scheduler: {scheduler} has no workers") from error
        _check(client)
        yield client


def _check(client: Client) -> None:
    """Check that the scheduler and its workers have the program.

    A message with a name that they lack would end them.
    """
    try:
        found = [
            client.run_on_scheduler(find_spec, _NEEDED),
            *client.run(find_spec, _NEEDED).values(),
        ]
    except ImportError:
        found = [None]
    if not all(found):
        raise UserError(
            f"--scheduler: a process lacks {_NEEDED}; install place-rings as here on all machines"
        )
