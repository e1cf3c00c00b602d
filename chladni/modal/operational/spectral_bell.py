"""The spectrum of one mode under white noise as a window shows it, fitted to lines."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from chladni.modal.fit.lag_window import LagWindow
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError
from chladni.spectral.leakage import leakage, named_window
from chladni.spectral.windows import noise_bandwidth_bins

# Scoring converges in a handful of steps; one that hasn't after so many never will.
MOST_STEPS = 60
LEAST_LINES = 6
SMALL_STEP = 1e-9
# The power of a window's transform is taken this far, in lines, and in so many steps a line.
KERNEL_LINES, GRID_STEPS = 12, 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bell:
    """A fitted mode: natural frequency, damping ratio and their covariance.

    Attributes
    ----------
    frequency_hz, damping_ratio
        Of the mode.
    covariance
        ``[2, 2]`` of both.
    power, power_std
        Density that a line at the top shows, and one sigma of it: is there a mode at all?
    floor
        Density under the bell; it may scatter below zero.
    lines
        Number of lines fitted.
    """

    frequency_hz: float
    damping_ratio: float
    covariance: Real
    power: float
    power_std: float
    floor: float
    lines: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BellData:
    """Lines of the spectrum of one modal coordinate.

    Attributes
    ----------
    frequency_hz, power
        ``[line]`` consecutive lines around the mode.
    lag_window
        How the window of the segments shortens correlations.
    window
        Its name.
    record_s
        Length of a record whose lines, without any window, would scatter as much.
    derivatives
        How often the response is the derivative of a displacement: 2 for accelerations.
    """

    frequency_hz: Real
    power: Real
    lag_window: LagWindow
    window: str
    record_s: float
    derivatives: int

    @property
    def spacing_hz(self) -> float:
        """Distance of the lines."""
        return 1 / self.lag_window.segment_s


def fit_bell(data: BellData, *, frequency_hz: float, half_width_hz: float) -> Bell:
    """Fit the spectrum of one mode driven by white noise, and a floor, to lines.

    Parameters
    ----------
    data
        Lines around the mode.
    frequency_hz, half_width_hz
        Where to start: the top, and half of the half-power bandwidth.

    Returns
    -------
    Bell
        By the likelihood of averaged spectra (Whittle 1953): with mu the expected line, sum(G/mu + ln mu) is least.

    Raises
    ------
    EstimateError
        When the lines hold no bell: the fit doesn't settle, or there are too few lines.

    Notes
    -----
    The expected line is the spectrum of the mode convolved with the power of the window's transform, so that there is
    no bias from the resolution (Brincker, Zhang & Andersen 2001 and Jacobsen et al. 2006 read the damping from the
    correlation function, which the window shortens). The covariance of two sums over lines, a and b, is

        (1/T) integral of S(f)^2 W_a(f) W_b(f) df,   W_a(f) = sum_k a_k W(f - f_k),

    with the spectrum S as it was before the window W (Brillinger 1981, section 5.10): a mode narrower than a line
    makes lines and segments alike, and then more lines are no more information.
    """
    # Four unknowns, and something left over to tell a bell from a slope.
    if data.power.size < LEAST_LINES:
        raise EstimateError(f"{data.power.size} lines are too few for a mode; ask for a finer resolution")
    theta, expected = _scored(data, _start(data, frequency_hz, half_width_hz))
    outside = not data.frequency_hz[0] <= theta[1] * data.spacing_hz <= data.frequency_hz[-1]
    weighted = expected.slopes / expected.power[:, np.newaxis]
    if outside or np.linalg.matrix_rank(weighted) < theta.size:
        raise _no_mode(data)
    # The likelihood takes lines as independent; what they really share goes between two of its own covariances.
    information = np.linalg.inv(weighted.T @ weighted)
    score = _score_covariance(data, theta, weighted / expected.power[:, np.newaxis])
    covariance = information @ score @ information
    half_width_hz = float(np.exp(theta[2])) * data.spacing_hz
    frequency_hz = float(np.hypot(theta[1] * data.spacing_hz, half_width_hz))
    to_modal = _to_modal(theta, data.spacing_hz)
    return Bell(
        frequency_hz=frequency_hz,
        damping_ratio=half_width_hz / frequency_hz,
        covariance=to_modal @ covariance[1:3, 1:3] @ to_modal.T,
        power=float(np.exp(theta[0])),
        power_std=float(np.exp(theta[0]) * np.sqrt(covariance[0, 0])),
        floor=float(np.exp(theta[0]) * theta[3]),
        lines=data.power.size,
    )


def own_half_width(shown: float, lag_window: LagWindow) -> float:
    """Half of the half-power width of a mode, in lines, whose bell has the half width `shown` in the spectra."""
    own, widened = _widening(replace(lag_window, segment_s=1.0))
    # The window adds nothing that counts to a bell wider than the table; one narrower than any has no width to tell.
    return float(np.interp(shown, widened, own)) if shown < widened[-1] else shown * float(own[-1] / widened[-1])


@lru_cache(maxsize=8)
def _widening(lag_window: LagWindow) -> tuple[Real, Real]:
    """Half widths of modes in lines, and those that the window shows."""
    own = np.geomspace(0.01, 16.0, 60)
    offsets = np.arange(0.0, 32.0, 1 / 16)
    bells = [_bell(lag_window, 0.0, float(width), offsets)[0].real for width in own]
    shown = [float(np.interp(0.5, (bell / bell[0])[::-1], offsets[::-1])) for bell in bells]
    return own, np.asarray(shown, dtype=np.float64)


# theta: log of the power at the top, damped frequency in lines, log of the half width in lines, floor over the power.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Expected:
    """Lines that are expected, ``[line]``, and their derivatives by theta, ``[line, 4]``."""

    power: Real
    slopes: Real


def _start(data: BellData, frequency_hz: float, half_width_hz: float) -> Real:
    top = float(data.power.max())
    # Half of the lowest line: with no floor at all, steps would begin at the edge of what is allowed.
    floor = 0.5 * float(data.power.min())
    width = max(half_width_hz / data.spacing_hz, 0.05)
    return np.array([np.log(top), frequency_hz / data.spacing_hz, np.log(width), floor / top])


def _scored(data: BellData, theta: Real) -> tuple[Real, _Expected]:
    """Fisher scoring with halved steps, until a step gains nothing."""
    expected = _expected(data, theta)
    best = _deviance(data, expected)
    for _ in range(MOST_STEPS):
        weighted = expected.slopes / expected.power[:, np.newaxis]
        step = np.linalg.lstsq(weighted, (data.power - expected.power) / expected.power, rcond=1e-12)[0]
        # No step doubles a width or crosses more than it: far from the answer the slopes mislead.
        width = np.exp(theta[2])
        step /= max(1.0, abs(step[2]) / 0.7, abs(step[1]) / max(width, 0.5))
        found = np.inf
        for halving in range(20):
            trial = theta + 0.5**halving * step
            at_trial = _expected(data, trial)
            found = _deviance(data, at_trial)
            if found <= best:
                break
        if not best - found >= SMALL_STEP * data.power.size:
            return theta, expected
        theta, expected, best = trial, at_trial, found
    raise _no_mode(data)


def _no_mode(data: BellData) -> EstimateError:
    return EstimateError(f"no mode fits the spectrum near {data.frequency_hz[np.argmax(data.power)]:.4g} Hz")


def _deviance(data: BellData, expected: _Expected) -> float:
    if not np.all(expected.power > 0):
        return float(np.inf)
    # Against lines that fit exactly, so that rounding stays small beside what is left.
    ratio = data.power / expected.power
    return float(np.sum(ratio - np.log(np.maximum(ratio, np.finfo(float).tiny)) - 1))


def _expected(data: BellData, theta: Real) -> _Expected:
    line, damped, width = data.frequency_hz / data.spacing_hz, float(theta[1]), float(np.exp(theta[2]))
    bell, by_pole = _bell(data.lag_window, damped, width, line)
    # What a line shows comes from here on average: near the line of a wide mode, near the top of a narrow one.
    tilt = bell.imag / bell.real
    origin = damped - width * tilt
    smooth, by_origin, by_damped, by_width = _smooth_part(origin, damped, width, data.derivatives)
    # Over what a line right on the top would show, so that the power doesn't change with where the lines lie.
    top, top_by_pole = _bell(data.lag_window, 0.0, width, np.zeros(1))
    height = bell.real / top.real
    tilted = [(slope.imag - tilt * slope.real) / bell.real for slope in (1j * by_pole, -by_pole)]
    slope_damped = (1j * by_pole).real / bell.real + by_origin * (1 - width * tilted[0]) + by_damped
    slope_width = (top_by_pole.real / top.real - by_pole.real / bell.real) + by_width
    slope_width = slope_width + by_origin * (-tilt - width * tilted[1])
    shape, power = height * smooth, np.exp(theta[0])
    slopes = [shape + theta[3], shape * slope_damped, shape * width * slope_width, np.ones(line.size)]
    return _Expected(power=power * (shape + theta[3]), slopes=power * np.stack(slopes, axis=1))


def _smooth_part(origin: Real, damped: float, width: float, derivatives: int) -> tuple[Real, ...]:
    """What the spectrum of a mode is besides its Lorentzian, 1 at the top, and its logarithm's slopes.

    S = omega^(2 p) / (((omega - omega_d)^2 + sigma^2) ((omega + omega_d)^2 + sigma^2)); only the first factor changes
    much within a line and is seen through the window in full. The slopes are by omega, omega_d and sigma.
    """
    here, there = (2 * damped) ** 2 + width**2, (origin + damped) ** 2 + width**2
    away = 2 * (origin + damped) / there
    value = (origin / damped) ** (2 * derivatives) * here / there
    # Where omega is 0 the power doesn't change with it: it is 0, or has no such factor.
    by_origin = 2 * derivatives * np.divide(1.0, origin, out=np.zeros_like(origin), where=origin != 0) - away
    by_damped = -2 * derivatives / damped + 8 * damped / here - away
    return value, by_origin, by_damped, 2 * width / here - 2 * width / there


def _bell(lag_window: LagWindow, damped: float, width: float, line: Real) -> tuple[Complex, Complex]:
    """``[line]`` 1/(2 pi (width + j (line - damped))) as the window shows it, and its slope by -width + j damped.

    In lines; the real part is a Lorentzian.
    """
    pole = np.array([2 * np.pi * complex(-width, damped)])
    s = np.asarray(2j * np.pi * line, dtype=np.complex128)
    value, slope = replace(lag_window, segment_s=1.0).decay_transform(s, pole)
    return value[0], 2 * np.pi * slope[0]


def _score_covariance(data: BellData, theta: Real, coefficients: Real) -> Real:
    """``[4, 4]`` covariance of the sums over lines with these coefficients, ``[line, 4]``."""
    line, step = _integration_lines(data, theta)
    damped, width = float(theta[1]), float(np.exp(theta[2]))
    lorentz = 1 / (1 + ((line - damped) / width) ** 2)
    # Of an endless segment the transform of the decay has the top 1/(2 pi width).
    before = lorentz / (2 * np.pi * width) / _bell(data.lag_window, 0.0, width, np.zeros(1))[0].real
    smooth = _smooth_part(line, damped, width, data.derivatives)[0]
    spectrum = np.exp(theta[0]) * (before * smooth + theta[3])
    sums = _seen_by(data, coefficients, line)
    weights = step * spectrum**2 / (data.record_s * data.spacing_hz)
    return np.asarray(sums.T @ (weights[:, np.newaxis] * sums), dtype=np.float64)


def _seen_by(data: BellData, coefficients: Real, line: Real) -> Real:
    """``[place, 4]`` sums over the data's lines of coefficients times the power of the window at that place.

    On a fine grid it's a convolution: a matrix of places and lines would take gigabytes for a wide bell.
    """
    window = named_window(data.window)
    offsets = np.arange(-KERNEL_LINES * GRID_STEPS, KERNEL_LINES * GRID_STEPS + 1) / GRID_STEPS
    kernel = leakage(window, offsets) / noise_bandwidth_bins(window)
    combed = np.zeros((GRID_STEPS * (data.power.size - 1) + 1, coefficients.shape[1]))
    combed[::GRID_STEPS] = coefficients
    first = round(data.frequency_hz[0] / data.spacing_hz) - KERNEL_LINES
    grid = first + np.arange(len(combed) + kernel.size - 1) / GRID_STEPS
    columns = [np.interp(line, grid, np.convolve(column, kernel), left=0.0, right=0.0) for column in combed.T]
    return np.stack(columns, axis=1)


def _integration_lines(data: BellData, theta: Real) -> tuple[Real, Real]:
    """Places in lines, dense around the mode, and the weight of each for the trapezoidal rule."""
    first, last = data.frequency_hz[[0, -1]] / data.spacing_hz
    # Squares of the window's power have no detail finer than a quarter of a line.
    even = np.arange(first - 4, last + 4, 0.25)
    dense = theta[1] + np.exp(theta[2]) * np.sinh(np.linspace(-12, 12, 601))
    line = np.unique(np.concatenate([even, dense[(dense > even[0]) & (dense < even[-1])]]))
    gaps = np.diff(line)
    return line, np.concatenate([[gaps[0]], gaps[1:] + gaps[:-1], [gaps[-1]]]) / 2


def _to_modal(theta: Real, spacing_hz: float) -> Real:
    """Derivatives of natural frequency and damping ratio by damped frequency (lines) and log half width."""
    damped, width = theta[1], np.exp(theta[2])
    natural = np.hypot(damped, width)
    ratio = width / natural
    return np.array(
        [
            [spacing_hz * damped / natural, spacing_hz * width**2 / natural],
            [-ratio * damped / natural**2, ratio * (1 - ratio**2)],
        ]
    )
