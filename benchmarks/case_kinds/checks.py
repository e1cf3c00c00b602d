"""Checks that several kinds share: a rate, a tone, values, and modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from case_kinds.product import Product, channel, expect

FALSE_PEAK_SHARE = 1e-3
"""A named peak below the tone by more than this (30 dB) may be noise or leakage; above it, it's invented."""


def check_rate(product: Product, path: Path, name: str, hz: float, *, samples: int, within: float = 1e-3) -> dict:
    """``info`` lists the channel at its rate, with its samples; its entry is given."""
    entry = channel(product.info(path), name)
    found = entry["rate_hz"]
    expect(found is not None and abs(found - hz) <= within * hz, f"rate {found} Hz instead of {hz:g}")
    expect(entry["samples"] == samples, f"{entry['samples']} samples instead of {samples}")
    return entry


def check_tone(product: Product, path: Path, name: str, hz: float, *options: str) -> dict:
    """``psd`` has its highest line at the tone and names no other peak that stands up to it; gives its document."""
    document = product.ask("psd", path, *options)
    entry = channel(document, name)
    lines, density = np.array(document["frequency_hz"]), np.array(entry["psd"], dtype=float)
    spacing = lines[1] - lines[0]
    # The offset is no peak, and a window spreads it over two lines.
    highest = lines[2:][np.argmax(density[2:])]
    expect(abs(highest - hz) <= 1.5 * spacing, f"the highest line is at {highest:g} Hz instead of {hz:g}")
    top = float(np.max(density[2:]))
    false = [
        peak["frequency_hz"]
        for peak in entry["peaks"]
        if abs(peak["frequency_hz"] - hz) > 2 * spacing and peak["psd"] > FALSE_PEAK_SHARE * top
    ]
    expect(not false, f"false peaks at {', '.join(f'{each:g}' for each in false)} Hz beside {hz:g}")
    return document


def check_values(product: Product, path: Path, name: str, truth: np.ndarray, *, within: float = 1e-5) -> None:
    """Samples are those that were written, none more and none less."""
    found = product.values(path, name)
    expect(found.size == truth.size, f"{found.size} samples of {name} instead of {truth.size}")
    scale = float(np.max(np.abs(truth))) or 1.0
    worst = float(np.max(np.abs(found - truth)))
    expect(worst <= within * scale, f"{name} is off by {worst:.3g}; largest true value {scale:.3g}")


@dataclass(frozen=True, slots=True)
class Chain:
    """Modes in closed form: frequencies, damping ratios, mass-normalised shapes over the points (points x modes)."""

    frequencies_hz: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray

    def accelerance(self, lines_hz: np.ndarray, response: int, reference: int) -> np.ndarray:
        """Sum of modes, [(m/s^2)/N]: Ewins, Modal Testing, 2nd ed., eq. 2.63 times -omega^2."""
        omega = 2 * np.pi * lines_hz[:, None]
        omega_r = 2 * np.pi * self.frequencies_hz
        residues = self.shapes[response] * self.shapes[reference]
        terms = residues / (omega_r**2 - omega**2 + 2j * self.damping * omega_r * omega)
        return -(omega[:, 0] ** 2) * terms.sum(axis=1)


def chain_of_masses(masses: Sequence[float], stiffnesses: Sequence[float], damping: Sequence[float]) -> Chain:
    """Masses between springs, the first to ground; damping ratios by mode."""
    mass = np.array(masses)
    springs = np.array([*stiffnesses, 0.0])
    stiffness = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    scaled = stiffness / np.sqrt(mass[:, None] * mass[None, :])
    squares, vectors = np.linalg.eigh(scaled)
    return Chain(np.sqrt(squares) / (2 * np.pi), np.array(damping), vectors / np.sqrt(mass)[:, None])


def check_modes(
    product: Product,
    path: Path,
    frequencies_hz: Sequence[float],
    damping: Sequence[float] | None = None,
    *options: str,
    hz_within: float = 1e-3,
    damping_within: float = 0.1,
    judged: Sequence[bool] | None = None,
) -> list[dict]:
    """``modes`` finds these and no other; damping within its share where `judged`; its modes are given."""
    modes = sorted(product.ask("modes", path, *options)["modes"], key=lambda mode: mode["frequency_hz"])
    found = [mode["frequency_hz"] for mode in modes]
    listed = ", ".join(f"{each:.3f}" for each in found) or "none"
    right = len(found) == len(frequencies_hz) and np.allclose(found, frequencies_hz, rtol=hz_within, atol=0)
    expect(bool(right), f"modes {listed} Hz instead of {', '.join(f'{each:.3f}' for each in frequencies_hz)}")
    for index, truth in enumerate(damping if damping is not None else ()):
        if judged is None or judged[index]:
            share = modes[index]["damping_ratio"]
            expect(abs(share - truth) <= damping_within * truth, f"damping {share:.3g} instead of {truth:.3g}")
    return modes


def check_shape(mode: dict, truth: dict[str, float], *, least_mac: float = 0.999) -> None:
    """A mode's shape over points, by its modal assurance criterion with the truth."""
    parts = {}
    for part in mode["shape"]:
        key = part.get("point") or part["channel"].partition(":")[0]
        parts[str(key).split()[-1]] = part["real"] + 1j * part["imag"]
    expect(set(parts) == set(truth), f"shape over points {sorted(parts)} instead of {sorted(truth)}")
    found = np.array([parts[key] for key in truth])
    wanted = np.array(list(truth.values()))
    mac = abs(np.vdot(found, wanted)) ** 2 / (np.vdot(found, found).real * np.vdot(wanted, wanted).real)
    expect(mac >= least_mac, f"shape at {mode['frequency_hz']:.2f} Hz has a MAC of {mac:.3f} with the truth")
