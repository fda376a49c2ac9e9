"""Where the processes of a study are: a cluster on this machine, or a scheduler that runs already, of dask.distributed.

What goes to a worker is text. Yet dask's own messages carry Python objects: whoever reaches a scheduler can run code on all
its machines. So the local cluster listens on 127.0.0.1 only, under a certificate of its own that nobody else has; and a
scheduler that is joined must be one that is trusted.
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

from ..formats.errors import UserError

_NEEDED = f"{__package__}.cluster"
_ANSWER, _WORKER = 30.0, 30.0  # s, for a scheduler to answer, and then to have a worker
_START = 300.0  # s, for a worker to start, on a machine however busy
_GRACE = 1.0  # s, for a worker to end
_LOCAL = {
    "distributed.worker.multiprocessing-method": "spawn",  # JAX's threads do not survive a fork
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    | {"NPROC": "1"},  # XLA's name for it
    "distributed.scheduler.allowed-failures": 0,  # who was lost is seen here, where it is known what was finished
    "distributed.deploy.lost-worker-timeout": "365 days",  # a worker is started again, however long that takes
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.http.routes": [],
}


@contextmanager
def here(workers: int) -> Iterator[Client]:
    """A cluster of that many processes on this machine. They end with this process, however it ends."""
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
                for name in set(os.environ) - environment:  # set for the workers
                    del os.environ[name]


@contextmanager
def _uninterrupted() -> Iterator[list[int]]:
    """Ctrl-C is only noted, as half a cluster cannot be closed; threads and processes that start here never see it."""
    pressed: list[int] = []
    resource_tracker.ensure_running()  # else it is started below, and unblocks what is blocked
    handler = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield pressed
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


async def _close(cluster: LocalCluster) -> None:
    """End the workers without waiting for what they still measure, which nobody wants."""
    with suppress(TimeoutError):
        await asyncio.gather(*(nanny.close(timeout=_GRACE) for nanny in cluster.workers.values()))


@contextmanager
def there(scheduler: str) -> Iterator[Client]:
    """The cluster of a scheduler that runs already.

    Raises:
        UserError: if there is none at that address, or one without workers, or without place-rings.
    """
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what goes wrong is told in a line
    try:
        client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
    except OSError as error:
        raise UserError(f"--scheduler: found {scheduler}, where none answers, allowed: a running one") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError as error:
            raise UserError(f"--scheduler: found {scheduler} without workers, allowed: a scheduler with some") from error
        _check(client)
        yield client


def _check(client: Client) -> None:
    """See that the scheduler and its workers have the program, as a message with a name that they lack would end them."""
    try:
        found = [client.run_on_scheduler(find_spec, _NEEDED), *client.run(find_spec, _NEEDED).values()]
    except ImportError:
        found = [None]
    if not all(found):
        raise UserError(f"--scheduler: found a process without {_NEEDED}, allowed: all with place-rings installed as here")
