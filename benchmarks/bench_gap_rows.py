"""Two rows of the diagnosis that no campaign holds: sound machines, and a log beside models that are ever more wrong.

``sound``: chains of two to four bodies with nothing missing, their values off by less than a tolerance, driven by
what a converter holds or by a band-limited signal, with 0.3 and 1 % of noise. SciPy follows them: held forces
exactly, band-limited ones as straight lines on a grid that is 32 times finer. Each should be `none`.

``nominal``: one log of a machine with a cause, beside models whose values are 0, 1, 5 and 20 tolerances off. The
answer may weaken to `unknown`, or tell the wrong value beside the cause; it should never name another effect.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, dlsim

sys.path.insert(0, str(Path(__file__).parents[1]))

import chladni
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.diagnosis import PARAMETER, Diagnosis
from chladni.gap.records.measurement import Measurement
from chladni.models.structures.structure_parameters import DEFAULT_TOLERANCE
from tests.gap.made_log import RATE_HZ, chain

SAMPLES, BEFORE = 4000, 500
#: How often the log's grid is divided, and what SciPy has between two instants of that.
FOLLOWED = {"held": (1, "zoh"), "band-limited": (32, "foh")}
HOLDS, NOISES = tuple(FOLLOWED), (0.003, 0.01)
CAUSES = (
    ("coulomb_friction", "j1", {"force": 25.0}),
    ("hardening_stiffness", "j1", {"cubic": 3e12}),
    ("gain_error", "a1", {"gain": 1.2}),
    ("time_offset", "a2", {"offset": 1.5e-3}),
)
OFF = (0.0, 1.0, 5.0, 20.0)


def drawn(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses, stiffnesses and dampings with all modes below a third of the sample rate."""
    count = int(rng.integers(2, 5))
    masses, stiffnesses = rng.uniform(1.5, 4.0, count), rng.uniform(2e5, 7e5, count)
    return masses, stiffnesses, rng.uniform(0.02, 0.06, count) * np.sqrt(stiffnesses * masses)


def accelerations(masses, stiffnesses, dampings, fine: np.ndarray, finer: int, between: str) -> np.ndarray:
    """``[body, sample]`` of the log, of a force at the last body on a grid that is so many times finer."""
    count = len(masses)
    across = np.eye(count) - np.eye(count, k=-1)
    inverse = np.diag(1.0 / masses)
    spring, damper = (inverse @ across.T @ np.diag(one) @ across for one in (stiffnesses, dampings))
    a = np.block([[np.zeros((count, count)), np.eye(count)], [-spring, -damper]])
    force = inverse[:, -1:]
    b, c = np.vstack([np.zeros((count, 1)), force]), np.hstack([-spring, -damper])
    step = cont2discrete((a, b, c, force), 1.0 / (RATE_HZ * finer), method=between)
    return dlsim(step, fine[:, None])[1].T[:, BEFORE * finer :: finer]


def band_limited(finer: int, rng: np.random.Generator) -> np.ndarray:
    """Noise of 100 N with nothing above 0.35 of the log's sample rate, on a grid that is so many times finer."""
    count = SAMPLES + BEFORE
    cycles = np.fft.rfftfreq(count)
    lines = rng.standard_normal(cycles.size) + 1j * rng.standard_normal(cycles.size)
    lines *= (cycles > 0) & (cycles < 0.35)
    whole = np.zeros(count * finer // 2 + 1, dtype=complex)
    whole[: lines.size] = lines
    fine = np.fft.irfft(whole, count * finer)
    return 100.0 / fine.std() * fine


def noisy(outputs: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    """White noise of a share of each output's RMS."""
    return outputs + noise * outputs.std(axis=1, keepdims=True) * rng.standard_normal(outputs.shape)


def log_of(inputs: np.ndarray, outputs: np.ndarray) -> Measurement:
    """The log that was written."""
    names = tuple(f"a{place}" for place in range(len(outputs)))
    return Measurement(
        log="made", sample_rate_hz=RATE_HZ, inputs=inputs[None], outputs=outputs, input_names=("hammer",),
        output_names=names, output_units=("m/s^2",) * len(names),
    )  # fmt: skip


def sound(case: tuple[str, float, int]) -> tuple[str, str]:
    """Diagnose one machine with nothing missing."""
    hold, noise, seed = case
    rng = np.random.default_rng([seed, HOLDS.index(hold), NOISES.index(noise)])
    nominal = drawn(rng)
    real = [one * np.exp(DEFAULT_TOLERANCE * rng.uniform(-1, 1, one.size)) for one in nominal]
    finer, between = FOLLOWED[hold]
    fine = band_limited(finer, rng)
    outputs = accelerations(*real, fine, finer, between)
    log = log_of(fine[BEFORE * finer :: finer], noisy(outputs, noise, rng))
    return f"{hold}, {noise:.1%}", answer(diagnose(chain(*nominal, at=nominal[0].size - 1), [log]))


def beside_nominal(case: tuple[int, float]) -> tuple[str, float, Diagnosis]:
    """Diagnose the log of one cause with a model that is so many tolerances off in its middle joint's stiffness."""
    word, site, values = CAUSES[case[0]]
    rng = np.random.default_rng(case[0])
    masses, stiffnesses, dampings = np.array([2.0, 2.5, 3.0]), np.array([5e5, 6e5, 4e5]), np.array([40.0, 60.0, 50.0])
    machine = chain(masses, stiffnesses, dampings, at=2).with_effects((chladni.attached(word, site, values),))
    samples = band_limited(1, rng)
    series = chladni.TimeSeries.from_arrays(samples[None], sample_rate_hz=RATE_HZ, names=["hammer"], units=["N"])
    outputs = chladni.simulate(machine, series).outputs.values
    wrong = stiffnesses * np.exp(DEFAULT_TOLERANCE * case[1] * np.array([0.0, 1.0, 0.0]))
    log = log_of(samples, noisy(outputs, 0.01, rng))
    return f"{word} at {site}", case[1], diagnose(chain(masses, wrong, dampings, at=2), [log])


def answer(found: Diagnosis) -> str:
    """The verdict with its causes."""
    causes = ", ".join(f"{one.effect} at {one.site} {one.probability:.2f}" for one in found.causes)
    return f"{found.verdict}: {causes}" if causes else found.verdict


def judged(word: str, found: Diagnosis) -> str:
    """How an answer stands to the only effect there is."""
    named = {f"{one.effect} at {one.site}" for one in found.causes if one.effect != PARAMETER}
    return "another name" if named - {word} else "named" if named else "not named"


def rows(jobs: int, function, cases: list) -> Iterator:
    """Results as they come, of as many processes."""
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(function, cases)


def main() -> None:
    """Print a line a case, then the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["sound", "nominal"])
    parser.add_argument("--count", type=int, default=60, help="sound machines")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    counts: Counter[str] = Counter()
    if arguments.what == "sound":
        kinds = list(product(HOLDS, NOISES))
        cases = [(*kinds[place % len(kinds)], place) for place in range(arguments.count)]
        for kind, said in rows(arguments.jobs, sound, cases):
            counts[said.partition(":")[0]] += 1
            print(f"{kind}: {said}", flush=True)
    else:
        for word, off, found in rows(arguments.jobs, beside_nominal, list(product(range(len(CAUSES)), OFF))):
            counts[judged(word, found)] += 1
            print(f"{word}, {off:g} tolerances off: {answer(found)}", flush=True)
    print(", ".join(f"{said} {count}" for said, count in counts.most_common()))


if __name__ == "__main__":
    main()
