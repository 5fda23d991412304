"""Jogs in LinuxCNC without a screen: from many poses, every axis to both of its limits at full speed, and back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from linuxcnc_runs import play
from pentapod.machine import Machine
from pentapod.planning.limits.margins import Margins

# Stands in for the screen, in place of `headless`; runs in LinuxCNC's own Python.
DRIVER = '''#!/usr/bin/python3
import json, os, subprocess, sys, time
import linuxcnc

job = json.load(open("jogs.json"))
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
said, done = [], []

def poll():
    message = errors.poll()
    while message:
        said.append(message[1])
        message = errors.poll()
    status.poll()
    if status.task_state != linuxcnc.STATE_ON:
        finish("FAILED: the machine went off: " + "; ".join(said[-5:]))

def finish(word):
    recorder.terminate()
    recorder.wait()
    json.dump({"said": said, "done": done}, open("said.json", "w"))
    print(word, flush=True)
    sys.exit(word != "DONE")

def switch(change, value):
    change(value)
    command.wait_complete(5.0)

def stand(limit):
    """Wait until nothing moves any more; False where that takes too long."""
    start, still, last = time.monotonic(), 0, None
    while time.monotonic() - start < limit:
        time.sleep(0.01)
        poll()
        still = still + 1 if status.position == last else 0
        last = status.position
        if still > 15 and time.monotonic() - start > 0.12:
            return True
    return False

def move(text, limit=30.0):
    """A typed block; True where it was run to its end."""
    switch(command.mode, linuxcnc.MODE_MDI)
    before = len(said)
    command.mdi(text)
    command.wait_complete(0.2)
    stand(limit)
    poll()
    whole = status.queue == 0 and len(said) == before
    if not whole:
        command.abort()
        command.wait_complete(1.0)
        stand(5.0)
    return whole

switch(command.state, linuxcnc.STATE_ESTOP_RESET)
switch(command.state, linuxcnc.STATE_ON)
switch(command.mode, linuxcnc.MODE_MANUAL)
switch(command.teleop_enable, 0)
command.home(-1)
while True:
    time.sleep(0.01)
    status.poll()
    if sum(status.homed[:5]) == 5:
        break
switch(command.teleop_enable, 1)
recorder = subprocess.Popen(["halsampler", "-t", "played.txt"])
time.sleep(0.2)
for step in job:
    if "move" in step:
        done.append(["move", move(step["move"]), list(status.position[:5])])
        continue
    switch(command.mode, linuxcnc.MODE_MANUAL)
    switch(command.teleop_enable, 1)
    poll()
    start = status.position[step["axis"]]
    command.jog(linuxcnc.JOG_CONTINUOUS, 0, step["axis"], step["speed"])
    stopped = stand(step.get("seconds", 30.0))
    command.jog(linuxcnc.JOG_STOP, 0, step["axis"])
    stand(2.0)
    done.append(["jog", stopped, list(status.position[:5]), status.position[step["axis"]] - start])
finish("DONE")
'''
PINS = ("motion.motion-enabled", "b"), ("pentapod.refusals", "u"), ("pentapod.margin.leg-gap", "f")


def script(poses: np.ndarray, speeds: np.ndarray, feed: float = 3000.0) -> list[dict[str, object]]:
    """Steps from pose (XYZAB rows, mm and degrees) to pose, each axis to both limits and back from there."""
    steps: list[dict[str, object]] = []
    for pose in poses:
        block = " ".join(f"{letter}{value:.5f}" for letter, value in zip("XYZAB", pose, strict=True))
        steps.append({"move": f"G1 F{feed} {block}"})
        for axis, speed in enumerate(speeds):
            steps += [{"axis": axis, "speed": speed}, {"axis": axis, "speed": -speed}]
            steps.append({"move": f"G1 F{feed} {'XYZAB'[axis]}{pose[axis]:.5f}"})
    return steps


def run_jogs(folder: Path, steps: list[dict[str, object]], seconds: float) -> tuple[np.ndarray, dict[str, list]]:
    """Play steps in a folder of the post; what was recorded, and what was said and done."""
    (folder / "headless").write_text(DRIVER, encoding="utf-8")
    (folder / "jogs.json").write_text(json.dumps(steps), encoding="utf-8")
    lines = [
        f"loadrt sampler depth=60000 cfg=fffff{''.join(kind for _, kind in PINS)}s",
        "addf sampler.0 servo-thread",
        *(f"net command{k + 1} joint.{k}.pos-cmd => sampler.0.pin.{k}" for k in range(5)),
        *(f"net watched{k} {pin} => sampler.0.pin.{5 + k}" for k, (pin, _) in enumerate(PINS)),
        f"net kind-of-motion motion.motion-type => sampler.0.pin.{5 + len(PINS)}",
    ]
    (folder / "record.hal").write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = play(folder, seconds=seconds)
    return table, json.loads((folder / "said.json").read_text(encoding="utf-8"))


def judged(machine: Machine, component, table: np.ndarray) -> dict[str, float]:
    """Least margins over all samples (planner's formulas, not the module's), and the largest acceleration of a leg."""
    table = table[table[:, 0] > 1.0]  # homing comes before
    legs = table[:, :5]
    acceleration = float(np.abs(np.diff(legs, 2, axis=0)).max()) / 1e-6
    moved = np.concatenate([[True], (np.diff(legs, axis=0) != 0.0).any(axis=1)])
    p, i = machine.robot.pose(1e-3 * legs[moved], component)
    assert np.isfinite(p).all()
    margins = Margins.of(machine, component)
    own = margins.own(p + machine.tool_length * i, -i).min(axis=0)
    worst = int(np.argmin(own))
    w, s = machine.robot.singularity_margins(list(p.T), list(i.T), component, margins_arithmetic())
    return {
        "least": float(own.min()), "limit": margins.own_limits[worst].name, "w": float(w.min()),
        "s_mm": 1e3 * float(s.min()), "acceleration": acceleration,
        "enabled": float(table[:, 5].min()), "refusals": float(table[-1, 6] - table[0, 6]), "samples": len(table),
    }  # fmt: skip


def margins_arithmetic():
    from pentapod.kinematics.arithmetic import NUMPY

    return NUMPY
