"""Nonlinear joints located between sensors, without a model: random chains with one nonlinear joint of four kinds.

``--cases 300`` runs so many chains; each has three sensors, so that a joint may have one at both sides, or not.
"""

import argparse
from collections import Counter
from contextlib import suppress

import numpy as np

import chladni
from chladni.gap.comparison.linear_approximation import best_linear_approximation
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.location.between_sensors import locate_between_sensors
from chladni.gap.location.sensor_location import SensorLocation
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

RATE_HZ, PERIOD, PERIODS, NOISE = 1024.0, 2048, 5, 1e-3
LINES = np.arange(8, 280)
LEVELS = (3.0, 25.0, 50.0)
KINDS = ("hardening_stiffness", "quadratic_damping", "one_sided_stop", "backlash")


def chain(rng: np.random.Generator, bodies: int) -> StructureModel:
    """Masses within a factor of two, stiffnesses within six, light damping."""
    masses, stiffnesses = rng.uniform(1.5, 3, bodies), 10 ** rng.uniform(5.1, 5.9, bodies)
    dampings = rng.uniform(0.8e-4, 3e-4, bodies) * stiffnesses
    return StructureModel(
        name="chain",
        structure=Structure(
            bodies=tuple(Body(name=f"b{i}", mass=float(masses[i])) for i in range(bodies)),
            joints=tuple(
                Joint(
                    name=f"j{i}", between=("ground" if i == 0 else f"b{i - 1}", f"b{i}"),
                    stiffness=float(stiffnesses[i]), damping=float(dampings[i]),
                )
                for i in range(bodies)
            ),
        ),
        inputs=(StructureInput(name="shaker", at="b0"),),
        outputs=tuple(StructureOutput(name=f"a{i}", measures="acceleration", at=f"b{i}") for i in range(bodies)),
    )  # fmt: skip


def sensors(rng: np.random.Generator, bodies: int) -> list[int]:
    """The shaken body and two more, next to each other in most cases."""
    if rng.random() < 0.6:
        first = int(rng.integers(1, bodies - 1))
        return [0, first, first + 1]
    return [0, *sorted(int(one) for one in rng.choice(np.arange(1, bodies), 2, replace=False))]


def run(model: StructureModel, rms: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Force as a sensor sees it, and ``[body, sample]`` accelerations; the first period is transient."""
    rng = np.random.default_rng([seed, 5])
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    spectrum[LINES] = np.exp(2j * np.pi * rng.random(LINES.size))
    one = np.fft.irfft(spectrum, PERIOD)
    seen = np.fft.irfft(spectrum * np.sinc(np.fft.rfftfreq(PERIOD)) ** 2, PERIOD)
    force, heard = (np.tile(rms * each / one.std(), PERIODS)[None] for each in (one, seen))
    return heard, Integrator(model.compile(), RATE_HZ).run(force).outputs


def effect(rng: np.random.Generator, kind: str, model: StructureModel, joint: int, seed: int):
    """Of a size that shows, by what the joint moves without it at the highest level."""
    _, outputs = run(model, LEVELS[-1], seed)
    spectra = np.fft.rfft(outputs[:, -PERIOD:])
    relative = spectra[joint] - (spectra[joint - 1] if joint else 0.0)
    omega = 2 * np.pi * np.fft.rfftfreq(PERIOD, 1 / RATE_HZ)
    moved = np.zeros_like(relative)
    moved[LINES] = -relative[LINES] / omega[LINES] ** 2
    d, s = (np.fft.irfft(one, PERIOD).std() for one in (moved, 1j * omega * moved))
    stiffness, damping = model.structure.joints[joint].stiffness, model.structure.joints[joint].damping
    values = {
        "hardening_stiffness": {"cubic": rng.uniform(0.05, 0.25) * stiffness / (3 * d**2)},
        "quadratic_damping": {"coefficient": rng.uniform(1, 4) * damping / s},
        "one_sided_stop": {"stiffness": rng.uniform(0.1, 0.5) * stiffness, "clearance": rng.uniform(0.3, 1) * d},
        "backlash": {"gap": rng.uniform(0.05, 0.15) * d},
    }[kind]
    return attached(kind, f"j{joint}", {name: float(value) for name, value in values.items()})


def case(seed: int) -> tuple[SensorLocation, tuple[str, ...], bool]:
    """What was found, the joint's ends, and whether both have a sensor."""
    rng = np.random.default_rng([seed, 77])
    bodies = int(rng.integers(4, 7))
    model, rows, joint = chain(rng, bodies), sensors(rng, bodies), int(rng.integers(0, bodies))
    machine = model.with_effects([effect(rng, str(rng.choice(KINDS)), model, joint, seed)])
    logs = []
    for rms in LEVELS:
        force, outputs = run(machine, rms, seed)
        kept = outputs[rows]
        scatter = np.random.default_rng([seed, round(rms)]).standard_normal(kept.shape)
        logs.append(
            with_period(
                Measurement(
                    log=f"{rms:g} N", sample_rate_hz=RATE_HZ, inputs=force,
                    outputs=kept + NOISE * kept.std(axis=1, keepdims=True) * scatter, input_names=("shaker",),
                    output_names=tuple(f"a{row}" for row in rows), output_units=("m/s^2",) * len(rows),
                )
            )
        )  # fmt: skip
    modes = chladni.identify_modes(best_linear_approximation(logs[0]))
    ends = tuple(f"a{end}" for end in (joint - 1, joint) if end >= 0)
    seen = all(int(one[1:]) in rows for one in ends)
    return locate_between_sensors(logs, modes, driving_point="a0"), ends, seen


def verdict(found: SensorLocation, ends: tuple[str, ...]) -> str:
    """Tell how the answer stands to the truth."""
    if found.located is None:
        return "not located"
    if found.located.names == ends:
        return "right"
    names = found.located.names
    if len(names) == len(ends) == 2 and names[0] <= ends[0] and ends[1] <= names[1]:
        return "between the two"
    return "next to it" if set(names) & set(ends) else "wrong"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1000)
    options = parser.parse_args()
    counted: Counter[tuple[str, str]] = Counter()
    for seed in range(options.seed, options.seed + options.cases):
        # Chains without a mode in the band at the lowest level have nothing that could stand in.
        with suppress(chladni.EstimateError):
            found, ends, seen = case(seed)
            least = "law explains half or more" if found.sites and found.sites[0].motion >= 0.5 else "less"
            counted[f"{'both sides' if seen else 'one side or none'}, {least}", verdict(found, ends)] += 1
    words = ("right", "between the two", "next to it", "wrong", "not located")
    print(f"| sensors at the joint | {' | '.join(words)} |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for row in sorted({row for row, _ in counted}):
        print(f"| {row} | {' | '.join(str(counted[row, word]) for word in words)} |")


if __name__ == "__main__":
    main()
