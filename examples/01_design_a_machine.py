"""Design a machine: `pentapod design` from a shipped machine, to smaller leg forces on a smaller base.

    python examples/01_design_a_machine.py --machine desk --out out/designs

The needs and ranges are in examples/design_desk.toml, design_steep.toml and design_bench-general.toml: steep cones of
directions, and the general family. docs/howto/design.md explains the files. A search takes some minutes; interrupted
with Ctrl-C, it goes on where it was when it is called again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pentapod.cli.main import main as pentapod

HERE = Path(__file__).parent
MACHINES = tuple(path.stem.removeprefix("design_") for path in sorted(HERE.glob("design_*.toml")))


def main() -> None:
    """Call the command with the design file of a machine."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machine", choices=MACHINES, default="desk")
    parser.add_argument("--out", type=Path, default=Path("out/designs"))
    options = parser.parse_args()
    sys.exit(pentapod(["design", str(HERE / f"design_{options.machine}.toml"), "-o", str(options.out)]))


if __name__ == "__main__":
    main()
