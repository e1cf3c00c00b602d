"""Modes: resonances narrower than a line, a roving hammer, a hit at a record's start."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.signal import dlsim, dlti, find_peaks

from case_kinds.checks import Chain, chain_of_masses, check_modes, check_shape
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import START_NS, Entry, Topic, double, write_log
from case_kinds.product import MismatchError, Product, expect
from case_kinds.universal import (
    Function,
    assert_reads,
    binary_dataset,
    ieee,
    response_functions,
    text_dataset,
    write_sets,
)

THREE_HZ = (51.5, 142.2, 278.7)
THREE_SHAPES = np.array([[0.9, 0.5, -0.4], [0.7, -0.6, 0.8], [0.4, -0.9, -0.7]])


def _narrow_chain(frequencies_hz: Sequence[float], damping: float) -> Chain:
    count = len(frequencies_hz)
    shapes = np.resize(THREE_SHAPES, (3, count)) if count > 3 else THREE_SHAPES[:, :count]
    return Chain(np.array(frequencies_hz), np.full(count, damping), shapes)


# Resonances narrower than a line


def _narrow(chain: Chain, step_hz: float, lines: int, *, noise: float = 0.0, points: int = 3,
            binary: bool = False) -> Callable[[Path], Path]:  # fmt: skip
    def write(folder: Path) -> Path:
        frequency = step_hz * np.arange(lines)
        random = np.random.default_rng(11)
        values = []
        for point in range(points):
            clean = chain.accelerance(frequency, point, 0)
            scatter = random.standard_normal((2, lines)) / np.sqrt(2)
            values.append(clean * (1 + noise * (scatter[0] + 1j * scatter[1])))
        functions = response_functions(values, step_hz)
        sets = [binary_dataset(each, 1, 2, ieee(each, "<")) if binary else text_dataset(each) for each in functions]
        path = write_sets(folder / "narrow.uff", *sets)
        assert_reads(path, functions)
        return path

    return write


def _check_narrow(frequencies_hz: Sequence[float], damping: float, step_hz: float) -> Check:
    # A damping ratio is asked for where the half-power width holds a line.
    judged = [2 * damping * hz >= step_hz for hz in frequencies_hz]

    def check(product: Product, path: Path) -> None:
        check_modes(product, path, frequencies_hz, [damping] * len(frequencies_hz), judged=judged)

    return check


def resonances_narrower_than_a_line() -> list[Case]:
    """Damping so low that a resonance falls between two lines."""
    kind = "resonances_narrower_than_a_line"
    rows = [
        (name, given(kind, f"{name}.uff"), _check_narrow(THREE_HZ, float(name.removeprefix("zeta_")), 1.0))
        for name in ("zeta_0.001", "zeta_0.0002")
    ]
    other = (33.37, 71.81, 188.46)
    made: list[tuple[str, Sequence[float], float, float, int, dict]] = [
        ("zeta_0.0005", THREE_HZ, 0.0005, 1.0, 401, {}),
        ("zeta_0.0001_lines_of_2_Hz", THREE_HZ, 0.0001, 2.0, 201, {}),
        ("zeta_0.0005_lines_of_4_Hz_binary", (107.3, 391.9, 702.6), 0.0005, 4.0, 257, {"binary": True}),
        ("zeta_0.002_lines_of_half_a_Hz", other, 0.002, 0.5, 513, {}),
        ("zeta_0.001_with_1_percent_noise", THREE_HZ, 0.001, 1.0, 401, {"noise": 0.01}),
        ("zeta_0.0003_with_1_percent_noise", other, 0.0003, 0.5, 513, {"noise": 0.01}),
        ("one_point_only", THREE_HZ, 0.0005, 1.0, 401, {"points": 1}),
    ]
    for name, frequencies_hz, damping, step_hz, lines, options in made:
        write = _narrow(_narrow_chain(frequencies_hz, damping), step_hz, lines, **options)
        rows.append((name, write, _check_narrow(frequencies_hz, damping, step_hz)))
    return [Case(kind=kind, name=name, write=write, check=check) for name, write, check in rows]


# A roving hammer

GIVEN_SHAPES = (
    (39.354, {"1": 0.844, "2": 1.0, "3": 0.935}),
    (61.274, {"1": 0.82, "2": 0.019, "3": -1.0}),
    (99.048, {"1": -0.316, "2": 1.0, "3": -0.332}),
)
FIVE = ([3.0, 2.0, 2.0, 1.5, 1.0], [9e5, 6e5, 6e5, 4e5, 3e5], [0.006, 0.008, 0.01, 0.012, 0.012])


def _roving(response: int, hammered: Sequence[int], *, noise: float = 0.0, binary: bool = False,
            turned: Sequence[int] = (), node: int = 1) -> Callable[[Path], Path]:  # fmt: skip
    """Five masses, one accelerometer at one of them, a hammer at some; at `turned` ones it hits against the axis."""

    def write(folder: Path) -> Path:
        chain = chain_of_masses(*FIVE)
        frequency = 0.25 * np.arange(801)
        random = np.random.default_rng(3)
        functions = []
        for point in hammered:
            values = chain.accelerance(frequency, response, point) * (-1 if point in turned else 1)
            scatter = random.standard_normal((2, frequency.size)) / np.sqrt(2)
            values = values + noise * np.sqrt(np.mean(np.abs(values) ** 2)) * (scatter[0] + 1j * scatter[1])
            direction = -3 if point in turned else 3
            [made] = response_functions([values], 0.25)
            functions.append(replace(made, response=(node + response, 3), reference=(node + point, direction)))
        return _written(folder, functions, binary=binary)

    return write


def _written(folder: Path, functions: Sequence[Function], *, binary: bool) -> Path:
    sets = [binary_dataset(each, 2, 2, ieee(each, ">")) if binary else text_dataset(each) for each in functions]
    path = write_sets(folder / "roving.uff", *sets)
    assert_reads(path, functions)
    return path


def _check_roving(hammered: Sequence[int], *, node: int = 1, least_mac: float = 0.999,
                  turned: Sequence[int] = (), within: float = 1e-3) -> Check:  # fmt: skip
    chain = chain_of_masses(*FIVE)

    def check(product: Product, path: Path) -> None:
        modes = _roving_modes(product, path, list(chain.frequencies_hz), len(hammered), within)
        for index, mode in enumerate(modes):
            signs = {str(part.get("point")): np.sign(part.get("direction", [0, 0, 1])[2]) for part in mode["shape"]}
            truth = {}
            for point in hammered:
                name = str(node + point)
                # A hammer that hits against the axis: the component may be told along either sense.
                sense = signs.get(name, 1.0) if point in turned else 1.0
                truth[name] = float(sense * chain.shapes[point, index])
            check_shape(mode, truth, least_mac=least_mac)

    return check


def _roving_modes(
    product: Product, path: Path, frequencies_hz: list[float], points: int, within: float
) -> list[dict]:
    """Modes with a component a hammer point, by the option that a sentence names where it takes one."""
    modes = check_modes(product, path, frequencies_hz, hz_within=within)
    named = re.search(r"(--[a-z-]*(?:rov|recipro|hammer)[a-z-]*)", product.said)
    if named and any(len(mode["shape"]) != points for mode in modes):
        product.notes.append(f"modes: only with {named[1]}")
        modes = check_modes(product, path, frequencies_hz, None, named[1], hz_within=within)
    return modes


def _check_given_roving(product: Product, path: Path) -> None:
    modes = _roving_modes(product, path, [hz for hz, _ in GIVEN_SHAPES], 3, 2e-4)
    for mode, (_, truth) in zip(modes, GIVEN_SHAPES, strict=True):
        check_shape(mode, truth)


def roving_hammer() -> list[Case]:
    """One response and many hammer points: shapes over the hammer points, by reciprocity."""
    kind = "roving_hammer"
    every = range(5)
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("one_response_three_hammer_points",
             given(kind, "one_response_three_hammer_points.uff"), _check_given_roving),
            ("five_points_response_at_the_end", _roving(4, every), _check_roving(every)),
            ("points_numbered_from_101", _roving(0, every, node=101), _check_roving(every, node=101)),
            ("with_noise_of_1_percent",
             _roving(4, every, noise=0.01), _check_roving(every, least_mac=0.99, within=5e-3)),
            ("binary_in_another_order",
             _roving(2, [3, 0, 4, 2, 1], binary=True), _check_roving(every)),
            ("no_hit_at_the_response", _roving(4, [0, 1, 2, 3]), _check_roving([0, 1, 2, 3])),
            ("one_hit_against_the_axis", _roving(4, every, turned=[1]), _check_roving(every, turned=[1])),
        )
    ]  # fmt: skip


# A hit at the start of the record


def _hit(rate_hz: float, seconds: float, hits_s: Sequence[float], frequencies_hz: Sequence[float],
         damping: float = 0.01) -> np.ndarray:  # fmt: skip
    """Time, force of half-sine hits and acceleration of modes in parallel, each exact for the piecewise-linear force.

    A mode's response is marched with the ramp-invariant recursion of its transition matrix (Van Loan 1978).
    """
    samples = round(rate_hz * seconds)
    time = np.arange(samples) / rate_hz
    width_s = 6.5 / rate_hz
    force = np.zeros(samples)
    for hit_s in hits_s:
        inside = (time >= hit_s) & (time <= hit_s + width_s)
        force[inside] += 50 * np.sin(np.pi * (time[inside] - hit_s) / width_s)
    response = np.zeros(samples)
    for number, hz in enumerate(frequencies_hz):
        response += (1 + 0.3 * number) * _mode_acceleration(force, rate_hz, hz, damping)
    noise = np.random.default_rng(5).standard_normal((2, samples))
    return np.column_stack([time, force + 0.01 * noise[0], response + 0.01 * noise[1]])


def _mode_acceleration(force: np.ndarray, rate_hz: float, hz: float, damping: float) -> np.ndarray:
    omega = 2 * np.pi * hz
    # State, and the force with its slope, in one transition matrix.
    whole = np.zeros((4, 4))
    whole[:2, :2] = [[0, 1], [-(omega**2), -2 * damping * omega]]
    whole[1, 2], whole[2, 3] = 1.0, 1.0
    step = expm(whole / rate_hz)
    slope = np.append(np.diff(force), 0.0) * rate_hz
    inputs = np.column_stack([force, slope])
    system = dlti(step[:2, :2], step[:2, 2:], whole[1:2, :2], np.array([[1.0, 0.0]]), dt=1 / rate_hz)
    return dlsim(system, inputs)[1][:, 0]


def _assert_peaks(table: np.ndarray, rate_hz: float, frequencies_hz: Sequence[float]) -> None:
    """The FFT's ratio peaks where the modes are."""
    ratio = np.abs(np.fft.rfft(table[:, 2]) / np.fft.rfft(table[:, 1]))
    lines = np.fft.rfftfreq(len(table), 1 / rate_hz)
    _assert_tallest(ratio, lines, frequencies_hz)


def _assert_tallest(ratio: np.ndarray, lines: np.ndarray, frequencies_hz: Sequence[float]) -> None:
    found = _tallest(ratio, lines, len(frequencies_hz), max(frequencies_hz))
    assert np.allclose(found, frequencies_hz, atol=2 * (lines[1] - lines[0])), (found, frequencies_hz)


def _tallest(ratio: np.ndarray, lines: np.ndarray, number: int, highest_hz: float) -> np.ndarray:
    below = lines <= 1.3 * highest_hz
    ratio = np.where(below, ratio, 0.0)
    peaks, _ = find_peaks(ratio, distance=max(1, round(20 / (lines[1] - lines[0]))))
    chosen = peaks[np.argsort(ratio[peaks])[::-1][:number]]
    return np.sort(lines[chosen])


def _hit_csv(rate_hz: float, seconds: float, hits_s: Sequence[float], frequencies_hz: Sequence[float],
             force_label: str = "force [N]", scale: float = 1.0) -> Callable[[Path], Path]:  # fmt: skip
    def write(folder: Path) -> Path:
        table = _hit(rate_hz, seconds, hits_s, frequencies_hz)
        _assert_peaks(table, rate_hz, frequencies_hz)
        rows = (f"{time:.7f},{scale * force:.4f},{response:.4f}" for time, force, response in table)
        path = folder / "hit.csv"
        path.write_text("\n".join([f"time [s],{force_label},a [m/s^2]", *rows]) + "\n")
        return path

    return write


def _hit_mcap(folder: Path) -> Path:
    table = _hit(4096, 2.0, [0.0005], [95, 260])
    _assert_peaks(table, 4096, [95, 260])
    topics = [Topic(f"/{name}", "p/msg/S", b"float64 value\n") for name in ("force", "a")]
    entries = [
        Entry(topic, START_NS + round(index * 1e9 / 4096), double(float(row[column])))
        for index, row in enumerate(table)
        for column, topic in enumerate(topics, start=1)
    ]
    return write_log(folder / "hit.mcap", entries)


def _check_hit(frequencies_hz: Sequence[float], reference: tuple[str, ...] = ("force", "/daq.force")) -> Check:
    def check(product: Product, path: Path) -> None:
        document = _transfer(product, path, reference)
        functions = document["functions"]
        expect(len(functions) >= 1, "no transfer function")
        lines = np.array(document["frequency_hz"])
        parts = [np.array(functions[0][key], dtype=float) for key in ("real", "imag")]
        # Lines that the force doesn't excite hold no number.
        found = _tallest(np.nan_to_num(np.hypot(*parts)), lines, len(frequencies_hz), max(frequencies_hz))
        close = found.size == len(frequencies_hz) and np.allclose(
            found, frequencies_hz, atol=2 * (lines[1] - lines[0])
        )
        expect(bool(close), f"peaks at {', '.join(f'{each:g}' for each in found) or 'none'} Hz, not {frequencies_hz}")

    return check


def _transfer(product: Product, path: Path, names: Sequence[str]) -> dict:
    """``frf`` over the force, whatever this kind of file makes of its name."""
    channels = [entry["name"] for entry in product.info(path)["channels"]]
    chosen = [each for each in channels if any(name in each for name in names)]
    if not chosen:
        raise MismatchError(f"no force among {', '.join(channels)}")
    return product.ask("frf", path, "--reference", chosen[0])


def hit_at_the_start_of_the_record() -> list[Case]:
    """The hammer hits as the record begins, without the rest before it that a pretrigger leaves."""
    kind = "hit_at_the_start_of_the_record"
    return [
        Case(kind=kind, name=name, write=write, check=_check_hit(frequencies_hz))
        for name, write, frequencies_hz in (
            ("hit_1ms_after_start", given(kind, "hit_1ms_after_start.csv"), (180, 430)),
            ("at_the_first_sample", _hit_csv(5120, 1.0, [0.0], (180, 430)), (180, 430)),
            ("three_samples_in_at_12800_Hz", _hit_csv(12_800, 0.5, [3 / 12_800], (640, 1510)), (640, 1510)),
            ("in_lbf", _hit_csv(2048, 2.0, [0.002], (66, 210), "force [lbf]", 1 / 4.4482216), (66, 210)),
            ("one_at_the_start_two_later", _hit_csv(2560, 6.0, [0.001, 2.0, 4.0], (110, 340)), (110, 340)),
            ("in_a_log", _hit_mcap, (95, 260)),
        )
    ]


def cases() -> list[Case]:
    """Every case about modes and hits."""
    return [*resonances_narrower_than_a_line(), *roving_hammer(), *hit_at_the_start_of_the_record()]
