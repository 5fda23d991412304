"""A Dask scheduler, and workers on "another machine": they do not see the driver's folder."""

import asyncio
import logging
import sys
from pathlib import Path

from pentapod.batch.tasks import worker as tasks_worker


def scheduler():
    """Serve, and print the address."""
    from distributed import Scheduler

    async def serve():
        async with Scheduler(host="127.0.0.1", port=0, dashboard_address="127.0.0.1:0", dashboard=False) as served:
            sys.stdout.write(f"{served.address}\n")
            sys.stdout.flush()
            await served.finished()

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    asyncio.run(serve())


class Far(type(Path())):
    """A path of a file system on which no batch's folder is."""

    def is_dir(self):
        """Return False for the folder by which a batch knows its own file system."""
        return not self.name.startswith(".unfinished-") and super().is_dir()


def worker(address, folder):
    """Work for a scheduler, with files in a folder of its own."""
    from distributed import Worker

    async def work():
        async with Worker(address, nthreads=1, local_directory=folder, memory_limit=0, host="127.0.0.1") as working:
            await working.finished()

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    tasks_worker.Path = Far
    asyncio.run(work())
