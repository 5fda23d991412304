"""The process in which the tasks of one worker run, one after the other: `python -m pentapod.batch.tasks.child`.

Whatever a task does to its process, the worker lives on. Lines of JSON come in by standard input and go out by standard
output; what tasks print goes to standard error. When the worker ends, the process does.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import traceback
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from pentapod.batch.tasks.task import function_of

OUT_OF_MEMORY = "out of memory"


def answer(order: dict[str, Any]) -> str:
    """Run a task in this process; return its row, or what it crashed with, and where, in JSON.

    order: function, folder, arguments.
    """
    try:
        row = function_of(order["function"])(Path(order["folder"]), **order["arguments"])
        return json.dumps({"row": row}, allow_nan=False)
    except (Exception, SystemExit) as error:
        crashed = OUT_OF_MEMORY if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
        return json.dumps({"crashed": crashed, "trace": traceback.format_exc()})


def _listen(orders: SimpleQueue[dict[str, Any]]) -> None:
    """Take orders till the worker is gone; then end the process, whatever it is at."""
    for line in sys.stdin.buffer:
        orders.put(json.loads(line))
    os._exit(1)


def main() -> None:
    """Answer orders till the worker is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the driver
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    orders: SimpleQueue[dict[str, Any]] = SimpleQueue()
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    while True:
        answers.write(answer(orders.get()).encode() + b"\n")
        answers.flush()


if __name__ == "__main__":
    main()
