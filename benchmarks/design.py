"""A machine at `desk`'s needs with smaller leg forces: asked and reached. Run ``make bench-design``.

First the proofs alone: the shipped machines' worst figures by bounds beside the worst of 10,000 poses, with boxes and
seconds of CPU. Then `pentapod design` on examples/design_desk.toml: `desk`'s legs, joints, bodies, work volume and
footprint, and the dome planned on each machine that is found, with a verdict; its seconds are of the clock, all cores.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from pentapod.design.design_file import DesignFile
from pentapod.design.members import design_machines
from pentapod.design.output import to_dict, write_front
from pentapod.design.proof import dense_worst, prove
from pentapod.design.unknowns import Unknowns
from pentapod.machine import Machine

DESIGN = Path(__file__).parents[1] / "examples" / "design_desk.toml"
ASKED = 4.5
FIGURES = ("amplification", "leg_clearance", "shaft_clearance", "shortest_leg", "longest_leg", "singular_distance")


def proofs(names: list[str]) -> None:
    """Print bounds and sampled worst values of shipped machines."""
    print("machine        figure              bound      sampled    boxes    s")
    for name in names:
        design = Unknowns.of(Machine.load(name), {}).start
        axes, start = design.base_axes(), time.process_time()
        proof, dense = prove(design, axes), dense_worst(design, axes)
        seconds = time.process_time() - start
        for figure in FIGURES:
            if figure in dense:
                line = f"{name:<14} {figure:<18} {proof.proven[figure]:9.5f}  {dense[figure]:9.5f}"
                print(f"{line}  {proof.boxes:8,}  {seconds:5.1f}" if figure == FIGURES[0] else line)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="folder of the search; one that was interrupted goes on there")
    parser.add_argument("-j", "--workers", type=int, help="processes; one for each core if left out")
    options = parser.parse_args()
    proofs(["desk", "steep", "bench-general"])
    with tempfile.TemporaryDirectory() as folder:
        out, start = options.out or Path(folder), time.perf_counter()
        front = design_machines(DesignFile.load(DESIGN), out, options.workers)
        write_front(front, out)
        seconds = time.perf_counter() - start
    content = to_dict(front)
    print(f"\n{content['designs']:,} evaluations, {len(content['members'])} designs on the front, {seconds:.0f} s")
    for member in content["members"]:
        parts = ", ".join(f"{part['job']} {part['verdict']}" for part in member["parts"])
        kept = ", ".join(f"{key} {member['proven'][key]:.4g}" for key in ("footprint_mm", "clearance_mm"))
        print(f"  amplification {member['proven']['amplification']:.3f} (proven), {kept}; {parts}")
    best = min((member["proven"]["amplification"] for member in content["members"]), default=float("inf"))
    for member in content["dropped"]:
        print(f"  not kept: {'; '.join(member['why'])}")
    print(f"\nforce amplification at desk's needs: asked {ASKED}, reached {best:.3f} (desk 5.11, proven alike)")
    if options.out is None:
        print("needs: " + json.dumps(content["needs"]))


if __name__ == "__main__":
    main()
