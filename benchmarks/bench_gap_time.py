"""The diagnosis of five bodies, five sensors and 25 000 samples with the whole catalogue: time and memory.

Each hidden effect is diagnosed in a process of its own that has compiled nothing in it before, by the command
``chladni gap``: what is timed is what a user waits for. Beside it stands how long Python takes to add ten million
numbers right after, since the speed of a shared machine varies by hours.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import chladni
from chladni.io.mcap.writer import write_mcap
from chladni.models.core.model import Model
from chladni.models.excitations.multisine import Multisine
from chladni.models.files.model_file import load_model, write_model

SAMPLES, RATE_HZ, NOISE = 25_000, 1024.0, 0.01
MODEL = """format = "chladni.model/1"
name = "tower"
kind = "structure"
""" + "".join(
    f"""
[[body]]
name = "floor{place}"
mass = {mass}

[[joint]]
name = "storey{place}"
between = ["{'ground' if place == 1 else f'floor{place - 1}'}", "floor{place}"]
stiffness = {stiffness}
damping = {damping}

[[output]]
name = "acc{place}"
measures = "acceleration"
at = "floor{place}"
channel = "/daq.acc{place}"
"""
    for place, mass, stiffness, damping in (
        (1, 6.0, 4e5, 60.0), (2, 5.0, 5e5, 60.0), (3, 4.0, 4e5, 50.0), (4, 3.0, 3e5, 40.0), (5, 2.0, 2e5, 30.0)
    )
) + """
[[input]]
name = "shaker"
kind = "force"
at = "floor5"
channel = "/daq.shaker"

[tolerance]
default = 0.05
"""  # fmt: skip
HIDDEN = (
    None,
    ("coulomb_friction", "storey3", {"force": 15.0}, "bristle"),
    ("hardening_stiffness", "storey5", {"cubic": 2e11}, None),
    ("delay", "shaker", {"delay": 2e-3}, None),
    ("gain_error", "acc2", {"gain": 1.1}, None),
    ("backlash", "storey2", {"gap": 4e-5}, None),
)


def write_log(model: Model, hidden: tuple | None, path: Path) -> None:
    """Simulate the machine, parameters a few per cent off, and measure it."""
    rng = np.random.default_rng(3)
    off = {name: one.value * float(np.exp(0.03 * rng.standard_normal())) for name, one in model.parameters.items()}
    machine = model.with_values(off)
    if hidden is not None:
        word, site, values, variant = hidden
        machine = machine.with_effects([chladni.attached(word, site, values, variant=variant)])
    push = Multisine(rms=60.0, period_s=6.0, band_hz=(2.0, 150.0))
    run = chladni.simulate(machine, push, duration_s=SAMPLES / RATE_HZ, sample_rate_hz=RATE_HZ, seed=2)
    measured = run.outputs.values
    noise = NOISE * measured.std(axis=1, keepdims=True) * rng.standard_normal(measured.shape)
    log = replace(
        run.outputs,
        values=np.vstack([run.inputs.values, measured + noise])[:, :SAMPLES],
        channels=run.inputs.channels + run.outputs.channels,
    )
    write_mcap(log, path, layout="batches")


def yardstick() -> float:
    """Seconds in which this machine adds ten million numbers in Python."""
    begun, total = time.perf_counter(), 0
    for number in range(10_000_000):
        total += number
    return time.perf_counter() - begun


def diagnose(model: Path, log: Path) -> tuple[dict, float, float]:
    """Answer of the command, its seconds, and its peak memory in GB."""
    command = [sys.executable, "-m", "chladni", "gap", str(model), str(log), "--json", "-"]
    begun = time.perf_counter()
    answer = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    seconds = time.perf_counter() - begun
    # The largest of all children so far: it only rises, and the last one is the answer.
    return json.loads(answer.stdout), seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tower.toml"
        path.write_text(MODEL)
        model = load_model(path)
        write_model(model, path)
        print(f"five bodies, five sensors, {SAMPLES} samples, {os.cpu_count()} cores\n")
        print("| hidden | answer | time | peak memory so far | yardstick |\n| --- | --- | ---: | ---: | ---: |")
        for hidden in HIDDEN:
            log = Path(folder) / "log.mcap"
            write_log(model, hidden, log)
            answer, seconds, memory = diagnose(path, log)
            named = ", ".join(f"{one['effect']} at {one['site']}" for one in answer["causes"]) or answer["verdict"]
            told = "nothing" if hidden is None else f"{hidden[0]} at {hidden[1]}"
            print(f"| {told} | {named} | {seconds:.1f} s | {memory:.2f} GB | {yardstick():.2f} s |", flush=True)


if __name__ == "__main__":
    main()
