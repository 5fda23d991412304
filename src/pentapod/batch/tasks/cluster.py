"""Dask: workers on this machine, or a scheduler that runs somewhere."""

from __future__ import annotations

import logging
import re
from collections.abc import Generator
from contextlib import contextmanager, suppress
from typing import Any

from pentapod.base.display import load_extra
from pentapod.base.errors import InputError

_SETTINGS = {
    # A worker gets the next task when it has none, so that its death is nobody else's.
    "distributed.scheduler.worker-saturation": 1.0,
    # The engine runs a task again, and counts; the scheduler shall not.
    "distributed.scheduler.allowed-failures": 0,
}
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+")

CONNECT_S = 15.0
"""Seconds in which a scheduler must answer."""

CLOSE_S = 30.0
"""Seconds in which workers are waited for at the end; those that are left end with this process."""


@contextmanager
def client_of(scheduler: str | None, workers: int | None) -> Generator[Any]:
    """Yield a Dask client. scheduler: address; None for `workers` processes on this machine, which listen to it alone.

    Raises InputError where Dask is not installed, or no scheduler answers.
    """
    distributed = load_extra("distributed", "batch", "many jobs need Dask, which is not installed")
    import dask.config  # noqa: PLC0415

    if scheduler is not None:
        place: dict[str, Any] = {"key": "scheduler", "value": scheduler, "remedy": '"dask scheduler" starts one'}
        if not _ADDRESS.fullmatch(scheduler):
            raise InputError("not the address of a scheduler", expected="tcp://host:8786, for example", **place)
        try:
            # Folders come from the workers themselves; where these cannot be reached, through the scheduler.
            client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False, direct_to_workers=True)
        except OSError as error:
            raise InputError("no scheduler answers", **place) from error
        with client:
            yield client
        return
    with dask.config.set(_SETTINGS), _quiet():
        cluster = distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, memory_limit=0, host="127.0.0.1", dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"}, silence_logs=logging.CRITICAL,
        )  # fmt: skip
        try:
            with distributed.Client(cluster, set_as_default=False) as client:
                yield client
        finally:
            with suppress(TimeoutError):
                cluster.close(timeout=CLOSE_S)


def lost_scheduler(client: Any) -> bool:
    """Return whether a client has lost its scheduler."""
    return client.status != "running"


@contextmanager
def _quiet() -> Generator[None]:
    """Keep Dask's log to itself: the death of a worker is told by the table."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
