"""Modes that the data need, told from poles that only follow noise."""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.special import betainc, betaln

from chladni.modal.experimental.judged_lines import JudgedLines
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.errors import SetupError
from chladni.signals.value import Value, require_shape

# Half-power half-widths on either side of a mode in which it is weighed against what else could explain the lines.
REACH = 8.0
FEWEST_LINES, MOST_LINES = 12, 128
# Modes elsewhere bend the functions here no more than a parabola does.
BACKGROUND = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class SignificanceRules:
    """What a mode must show.

    Attributes
    ----------
    false_alarm
        Largest probability that noise alone gives a mode so strong anywhere in the band.
    contribution
        Least magnitude of the mode on the lines nearest to it over what the functions have there, root mean square
        over the functions that it is strongest in.
    damping
        Highest damping ratio.
    """

    false_alarm: float = 1e-4
    contribution: float = 0.05
    damping: float = 0.2

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm < 1:
            raise SetupError(f"false-alarm probability {self.false_alarm} must be above 0 and below 1")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeSignificance(Value):
    """How much the data need each mode.

    Attributes
    ----------
    gain
        ``[mode]`` what the mode takes off the weighted sum of squares near it, for each of its parameters, over the
        mean square that is left: 1 on average for a pole in noise.
    log_false_alarm
        ``[mode]`` natural logarithm of the probability that noise alone gives a mode so strong in the band.
    contribution
        ``[mode]`` magnitude of the mode over that of the functions on the lines nearest to it.
    width
        ``[mode]`` half-power width in lines.
    """

    gain: Real
    log_false_alarm: Real
    contribution: Real
    width: Real

    def __post_init__(self) -> None:
        for name in ("log_false_alarm", "contribution", "width"):
            require_shape(name, getattr(self, name), self.gain.shape, "modes")
        self._freeze()

    def select(self, modes: Mask) -> "ModeSignificance":
        """Give it of some of the modes."""
        columns = (self.gain, self.log_false_alarm, self.contribution, self.width)
        gain, log_false_alarm, contribution, width = (column[modes] for column in columns)
        return ModeSignificance(gain=gain, log_false_alarm=log_false_alarm, contribution=contribution, width=width)

    def passes(self, rules: SignificanceRules) -> Mask:
        """``[mode]`` whether the data need it by these rules."""
        return np.asarray(
            (self.log_false_alarm <= np.log(rules.false_alarm)) & (self.contribution >= rules.contribution)
        )


def mode_significance(
    lines: JudgedLines, poles: Complex, participation: Complex, *, modes: Index | None = None
) -> ModeSignificance:
    """Weigh each mode against a fit of the lines near it that has all modes but this one.

    Parameters
    ----------
    lines
        What was measured.
    poles
        ``[mode]`` in rad/s.
    participation
        ``[mode, reference]``.
    modes
        Which of them to weigh; None for all.

    Notes
    -----
    In the lines within some half-widths of the mode all near modes and a parabola are fitted, once with the mode and
    once without. The line nearest to the mode isn't among them: any line that stands alone has a pole on top of it,
    while a resonance, however narrow, has flanks that fall with the distance. The gain is an F statistic, whose noise
    is that of the same lines where that is more than the stated std and what a linear model may be off: neither a std
    that is too small nor a model that explains the functions badly makes a mode significant. The mode's pole was
    looked for, so that the probability of one place is multiplied by the number of places: the band over the mode's
    width (Gross & Vitells 2010, Eur. Phys. J. C 70, 525, on the look-elsewhere effect). Lines that a window ties
    together count as fewer.
    """
    weighed = range(poles.size) if modes is None else modes.tolist()
    found = [_one(lines, poles, participation, mode) for mode in weighed]
    columns = np.array(found, dtype=np.float64).reshape(len(weighed), 4).T
    return ModeSignificance(gain=columns[0], log_false_alarm=columns[1], contribution=columns[2], width=columns[3])


def _one(lines: JudgedLines, poles: Complex, participation: Complex, mode: int) -> tuple[float, float, float, float]:
    half_width_hz = -poles.real / (2 * pi)
    own_hz = poles[mode].imag / (2 * pi)
    width = float(2 * half_width_hz[mode] / lines.step_hz)
    places = _beside(lines, own_hz, REACH * half_width_hz[mode])
    near = np.abs(poles.imag / (2 * pi) - own_hz) <= np.ptp(lines.frequency_hz[places]) / 2 + 2 * half_width_hz
    order = np.concatenate([[mode], np.setdiff1d(np.flatnonzero(near), [mode])])
    fit = _local_fit(lines, places, poles[order], participation[order])
    parameters = 2 * (fit.taken.size + participation.shape[1])
    if fit.freedom <= 0:
        return 0.0, 0.0, fit.contribution, width
    noise = max(fit.left / fit.freedom, 1.0)
    gain = float(fit.taken.sum() / (parameters * noise))
    independent = lines.correlated_lines
    # How many modes of this width the band has room for.
    trials = max(lines.frequency_hz.size / max(width, 1.0), 1.0)
    chance = log_f_tail(gain / independent, parameters, fit.freedom / independent) + np.log(trials)
    return gain, min(float(chance), 0.0), fit.contribution, width


def log_f_tail(ratio: float, upper: float, lower: float) -> float:
    """Natural logarithm of the probability that an F statistic exceeds `ratio`, far beyond what a float can hold.

    The tail is a regularised incomplete beta function I_x(b, a) with x = b/(b + a ratio), a, b half the degrees of
    freedom. Where it underflows, the series of NIST DLMF 8.17.8 is bounded by a geometric one: terms shrink at least
    as fast as the first two.
    """
    a, b = upper / 2, lower / 2
    x = b / (b + a * ratio)
    tail = float(betainc(b, a, x))
    if tail > 1e-280:
        return float(np.log(tail))
    shrinking = x * max(a + b, b + 1) / (b + 1)
    return float(b * np.log(x) + a * np.log1p(-x) - np.log(b) - betaln(a, b) - np.log1p(-shrinking))


def _beside(lines: JudgedLines, own_hz: float, reach_hz: float) -> Index:
    """Lines around a mode, without the nearest."""
    distance = np.abs(lines.frequency_hz - own_hz)
    count = max(int(np.count_nonzero(distance <= reach_hz)), FEWEST_LINES)
    nearest = np.sort(np.argsort(distance, kind="stable")[1 : count + 1])
    # Of a mode hundreds of lines wide a part of the lines says enough, but from all of its width: the middle alone is
    # a parabola.
    return nearest[:: -(-nearest.size // MOST_LINES)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _LocalFit:
    """Squares that the first mode takes off each response, squares left, degrees of freedom, share of the peak."""

    taken: Real
    left: float
    freedom: float
    contribution: float


def _local_fit(lines: JudgedLines, places: Index, poles: Complex, participation: Complex) -> _LocalFit:
    design = _design(lines, places, poles, participation)
    weight = lines.weight[:, :, places]
    values = lines.values[:, :, places]
    # [response, row] with rows running over references, lines, real and imaginary part.
    squares = np.repeat((weight**2).reshape(weight.shape[0], -1), 2, axis=1)
    data = np.ascontiguousarray(values.reshape(values.shape[0], -1)).view(np.float64)
    columns = design.shape[1]
    upper = np.triu_indices(columns)
    gram = np.empty((weight.shape[0], columns, columns))
    gram[:, upper[0], upper[1]] = squares @ (design[:, upper[0]] * design[:, upper[1]])
    gram[:, upper[1], upper[0]] = gram[:, upper[0], upper[1]]
    right = (squares * data) @ design
    inverse = np.linalg.pinv(gram, rcond=1e-13, hermitian=True)
    answer = np.einsum("ipq,iq->ip", inverse, right)
    own = answer[:, :2]
    taken = np.einsum("ip,ipq,iq->i", own, np.linalg.pinv(inverse[:, :2, :2], hermitian=True), own)
    left = np.sum(squares * (data - answer @ design.T) ** 2)
    # A response whose lines are all masked has no row.
    freedom = np.sum(np.maximum(np.count_nonzero(squares, axis=1) - columns, 0))
    distance = np.abs(2 * pi * lines.frequency_hz[places] - poles[0].imag)
    at_peak = distance <= max(-float(poles[0].real), float(distance.min()))
    peak_rows = np.repeat(np.tile(at_peak, values.shape[1]), 2)
    mode = np.sum(squares[:, peak_rows] * (own @ design[:, :2].T)[:, peak_rows] ** 2, axis=1)
    whole = np.sum(squares[:, peak_rows] * data[:, peak_rows] ** 2, axis=1)
    # A local mode is clear in some responses and nothing in all others.
    share = float(np.max(mode / np.maximum(whole, 1e-300)))
    return _LocalFit(
        taken=np.maximum(taken, 0.0), left=float(left), freedom=float(freedom), contribution=float(np.sqrt(share))
    )


def _design(lines: JudgedLines, places: Index, poles: Complex, participation: Complex) -> Real:
    """``[row, column]``: real and imaginary part of each mode's shape, then the parabola of each reference."""
    s = 2j * pi * lines.frequency_hz[places]
    direct = participation[:, :, None] / (s - poles[:, None])[:, None, :]
    partner = participation.conj()[:, :, None] / (s - poles.conj()[:, None])[:, None, :]
    modes = np.stack([direct + partner, 1j * (direct - partner)], axis=1)
    # Each mode in units of its highest line, or the weak ones would sink in rounding.
    modes = modes / np.abs(modes).max(axis=(1, 2, 3), keepdims=True)
    centred = (s.imag - s.imag.mean()) / max(np.ptp(s.imag), 1e-300)
    power = centred ** np.arange(BACKGROUND)[:, None]
    references = participation.shape[1]
    smooth = np.zeros((references, BACKGROUND, 2, references, s.size), dtype=complex)
    for reference in range(references):
        smooth[reference, :, 0, reference] = power
        smooth[reference, :, 1, reference] = 1j * power
    rows = references * s.size
    complex_columns = np.concatenate([modes.reshape(-1, rows), smooth.reshape(-1, rows)])
    return np.ascontiguousarray(np.ascontiguousarray(complex_columns).view(np.float64).T)
