"""What a machine answers otherwise at higher levels than at the lowest one, line by line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from chladni.gap.calibration import ALIKE
from chladni.gap.comparison.levels import level_of
from chladni.gap.comparison.linear_approximation import excited_alone, moving_inputs, period_spectra
from chladni.gap.comparison.outside_band import even_functions, odd_functions
from chladni.gap.comparison.periodicity import steady_periods
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value
from chladni.spectral.forms import MOTION_ORDER


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelChange(Value):
    """Responses at several levels of one excitation, and how they differ from the lowest one's.

    Attributes
    ----------
    outputs, order
        Names of the sensors; how often displacement was differentiated to give what they measure (2: acceleration).
    force_name, level
        Name of the input, and ``[level]`` its RMS, the lowest first.
    frequency_hz
        ``[line]`` excited at every level.
    response
        ``[level, output, line]`` output over input.
    noise
        ``[level, output, line]`` variance of `response`, from the scatter between periods.
    force
        ``[level, line]`` spectrum of the input over one period.
    lines
        ``[line]`` index of each line in the spectrum of a period.
    period_samples
        Of every level.
    """

    outputs: tuple[str, ...]
    order: int
    force_name: str
    level: Real
    frequency_hz: Real
    response: Complex
    noise: Real
    force: Complex
    lines: Index
    period_samples: int

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def change(self) -> Complex:
        """``[level, output, line]`` response of each higher level minus that of the lowest."""
        return np.asarray(self.response[1:] - self.response[0])

    def forces_of(self, direction: Real) -> tuple[Complex, int]:
        """What functions of one motion would add to the input's share, level by level.

        With a law f(d) of the motion d at the place, the change is the path from there to the sensors times
        ``F[f(d)]/U`` minus the same of the lowest level: what the law did there is in that response already.

        Parameters
        ----------
        direction
            ``[output]`` weights whose sum of outputs is the motion: 1 and -1 for that between two.

        Returns
        -------
        forces
            ``[level - 1, function, line]``, of unit RMS for each function; none where nothing moves.
        odd
            How many of them, the first ones, are odd.
        """
        displacement, velocity = self._motion(direction)
        size, speed = displacement[-1].std(), velocity[-1].std()
        if size == 0:
            return np.zeros((self.level.size - 1, 0, self.lines.size), dtype=np.complex128), 0
        # One scale for all levels: a law knows nothing of levels.
        d, s = displacement / size, velocity / speed
        odd = odd_functions(d, s)
        functions = np.concatenate([odd, even_functions(d)])
        spectra = fft.rfft(functions, axis=-1)[..., self.lines] / self.force
        added = np.moveaxis(spectra[:, 1:] - spectra[:, :1], 0, 1)
        rms = np.sqrt(np.mean(np.abs(added) ** 2, axis=(0, 2)))
        # A motion that never leaves a dead zone has no force from beyond it.
        used = rms > 0
        return added[:, used] / rms[used, None], int(used[: len(odd)].sum())

    def _motion(self, direction: Real) -> tuple[Real, Real]:
        """``[level, sample]`` displacement and velocity on the excited lines."""
        omega = 2 * np.pi * self.frequency_hz
        measured = np.einsum("o,lok->lk", direction, self.response) * self.force
        whole = np.zeros((self.level.size, self.period_samples // 2 + 1), dtype=np.complex128)
        whole[:, self.lines] = measured / (1j * omega) ** self.order
        displacement = fft.irfft(whole, self.period_samples, axis=1)
        whole[:, self.lines] *= 1j * omega
        return displacement, fft.irfft(whole, self.period_samples, axis=1)


def level_change(measurements: Sequence[Measurement]) -> LevelChange:
    """Hold measurements of one machine at several levels against the lowest.

    Parameters
    ----------
    measurements
        In any order, with one periodic input that moves, of one period length (see `with_period`), and two steady
        periods or more; the same sensors, all of them displacements, velocities or accelerations.

    Raises
    ------
    EstimateError
        When a measurement isn't such, or the levels don't differ.
    """
    names = {name for one in measurements for name in moving_inputs(one)}
    for one in measurements:
        _require_periodic(one)
        _require_alike(one, measurements[0])
    if len(names) != 1:
        raise EstimateError(f"one input must move at all levels, not {', '.join(sorted(names)) or 'none'}")
    (name,) = names
    ordered = sorted(measurements, key=lambda one: level_of(one, name))
    level = np.array([level_of(one, name) for one in ordered])
    if len(ordered) < 2 or level[-1] < ALIKE * level[0]:
        raise EstimateError(
            f"{name} has {', '.join(f'{one:.3g}' for one in level)} RMS: a change with level needs logs whose "
            f"levels differ by {ALIKE - 1:.0%} or more"
        )
    lines = np.flatnonzero(np.all([one[1] for one in map(excited_alone, ordered) if one is not None], axis=0))
    found = [_responses(one, name, lines) for one in ordered]
    first = ordered[0]
    return LevelChange(
        outputs=first.output_names,
        order=MOTION_ORDER[first.output_units[0]],
        force_name=name,
        level=level,
        frequency_hz=lines * first.sample_rate_hz / int(first.period_samples or 1),
        response=np.array([one[0] for one in found]),
        noise=np.array([one[1] for one in found]),
        force=np.array([one[2] for one in found]),
        lines=lines,
        period_samples=int(first.period_samples or 1),
    )


def _require_periodic(one: Measurement) -> None:
    if period_spectra(one) is None:
        raise EstimateError(
            f"{one.log}: its input doesn't repeat, or for less than two steady periods; excite with a periodic "
            "multisine, so that what changes with level is told from noise"
        )
    units = set(one.output_units)
    if len(units) != 1 or not units <= set(MOTION_ORDER):
        raise EstimateError(
            f"{one.log}: outputs are in {', '.join(sorted(units))}; motions between sensors take one unit of "
            f"{', '.join(MOTION_ORDER)}"
        )


def _require_alike(one: Measurement, first: Measurement) -> None:
    for what, ours, theirs in (
        ("outputs", ", ".join(one.output_names), ", ".join(first.output_names)),
        ("units", ", ".join(one.output_units), ", ".join(first.output_units)),
        ("period [samples]", str(one.period_samples), str(first.period_samples)),
        ("sample rate [Hz]", f"{one.sample_rate_hz:g}", f"{first.sample_rate_hz:g}"),
    ):
        if ours != theirs:
            raise EstimateError(
                f"{what} of {one.log}: {ours}; of {first.log}: {theirs}; levels are compared line by line, so "
                "they need the same"
            )


def _responses(one: Measurement, name: str, lines: Index) -> tuple[Complex, Real, Complex]:
    """Response and its variance ``[output, line]``, and the input's spectrum ``[line]``."""
    signals = np.concatenate([one.inputs[[one.input_names.index(name)]], one.outputs])
    spectra = fft.rfft(steady_periods(signals, one), axis=2)[:, :, lines]
    mean = spectra.mean(axis=1)
    response = mean[1:] / mean[0]
    # Scatter of the force is in the residual about the response too, as it should be.
    scatter = spectra[1:] - response[:, None] * spectra[0]
    count = spectra.shape[1]
    noise = np.sum(np.abs(scatter) ** 2, axis=1) / (count * (count - 1)) / np.abs(mean[0]) ** 2
    return response, noise, mean[0]
