"""Rows of the diagnosis that no campaign holds: sound machines, models that are ever more wrong, logs of others.

``sound``: chains of two to four bodies with nothing missing, their values off by less than a tolerance, driven by
what a converter holds or by a band-limited signal, with 0.3 and 1 % of noise. SciPy follows them: held forces
exactly, band-limited ones as straight lines on a grid that is 32 times finer. Each should be `none`.

``nominal``: one log of a machine with a cause, beside models whose values are 0, 1, 5 and 20 tolerances off. The
answer may weaken to `unknown`, or tell the wrong value beside the cause; it should never name another effect.

``logs``: measured logs, and made ones of machines that nobody here drew, each with the model that its folder or
``models`` holds. What is missing is known from their publications (``data/README.md``, ``answer.txt``).
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from typing import NamedTuple

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
SHARED = Path(__file__).parents[2] / "shared" / "data"
MODELS = {"mr_1A": "mr_damper"}
#: A name below this is a suggestion.
NAMED = 0.6
FRICTION = ("coulomb_friction", "stribeck_friction", "hysteresis")


class Known(NamedTuple):
    """What is right of a log: a name of each set, and whether `unknown` is right as well."""

    needed: tuple[set[str], ...]
    unknown: bool = True
    end_s: float | None = None


def among(words: Sequence[str], site: str) -> set[str]:
    """Each of these words at a site."""
    return {f"{word} at {site}" for word in words}


LOGS = {
    "diagnosis/a1_missing_ground_spring": Known((among(["missing_link"], "ground~wrist"),)),
    "diagnosis/arts_80lb": Known((among(FRICTION, "damper"), among(["backlash"], "damper"))),
    "diagnosis/b4_typo": Known((among([PARAMETER], "grip.stiffness"),), unknown=False),
    "diagnosis/bouc_wen_benchmark": Known((among(["hysteresis"], "spring"),), unknown=False),
    "diagnosis/c1_friction_and_light_mass": Known((among(FRICTION, "elbow"), among([PARAMETER], "tool.mass"))),
    "diagnosis/coupled_drives": Known(()),
    "diagnosis/g2_one_clock_200ppm": Known((among(["clock_drift", "time_offset"], "acc_tool"),)),
    "diagnosis/h1_soft_stinger": Known(()),
    "diagnosis/i2_all_warming": Known(
        tuple(among(["varying_stiffness"], joint) for joint in ("base", "shoulder", "elbow", "grip"))
    ),
    "diagnosis/p2_none_smooth_1pct": Known((), unknown=False),
    "diagnosis/w1_four_frictions": Known(
        tuple(among(FRICTION, joint) for joint in ("base", "shoulder", "elbow", "grip"))
    ),
    "diagnosis/wang_mr_damper_sign_right": Known((among(FRICTION, "damper"),), unknown=False),
    "diagnosis/x1_compressor": Known((among(["tonal_disturbance"], "column"),)),
    "emps": Known((among(FRICTION, "guide"),), unknown=False),
    "silverbox": Known((among(["hardening_stiffness"], "spring"),), unknown=False, end_s=60.0),
    "mr_1A": Known((among(FRICTION, "damper"),), unknown=False),
}


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


def of_log(name: str) -> tuple[str, str, str]:
    """Diagnose a log of others, and judge the answer."""
    folder = SHARED / name
    if folder.is_dir():
        model, log = folder / "model.toml", folder / "log.mcap"
    else:
        model, log = SHARED / "models" / f"{MODELS.get(name, name)}.toml", folder.with_suffix(".mcap")
    known = LOGS[name]
    found = chladni.diagnose_gap(model, log, end_s=known.end_s)
    return name, answer(found), against(known, found)


def against(known: Known, found: Diagnosis) -> str:
    """How an answer stands to what is known: each needed cause named and nothing else, or `unknown` where allowed."""
    named = {f"{one.effect} at {one.site}" for one in found.causes if one.probability >= NAMED}
    if named - set[str]().union(*known.needed):
        return "wrong"
    if not named and found.verdict != "none":
        return "rightly in doubt" if known.unknown else "missed"
    if not named and (known.needed or known.unknown):
        return "missed"
    return "right" if all(named & one for one in known.needed) else "half"


def rows(jobs: int, function, cases: list) -> Iterator:
    """Results as they come, of as many processes."""
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(function, cases)


def main() -> None:
    """Print a line a case, then the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["sound", "nominal", "logs"])
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
    elif arguments.what == "logs":
        for name, said, how in rows(arguments.jobs, of_log, list(LOGS)):
            counts[how] += 1
            print(f"{name}: {how}: {said}", flush=True)
    else:
        for word, off, found in rows(arguments.jobs, beside_nominal, list(product(range(len(CAUSES)), OFF))):
            counts[judged(word, found)] += 1
            print(f"{word}, {off:g} tolerances off: {answer(found)}", flush=True)
    print(", ".join(f"{said} {count}" for said, count in counts.most_common()))


if __name__ == "__main__":
    main()
