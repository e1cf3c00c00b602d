"""How much something hidden matters: over the noise, behind what tuning takes up, and behind its like elsewhere."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.fft import rfft
from scipy.optimize import least_squares
from scipy.signal.windows import hann

from chladni_withheld.networks.draft import Filter
from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.network import GROUND, Matrix, Spectrum
from chladni_withheld.networks.scene import Scene

_TRIES = 12
_LINES = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """The model's numbers that follow a change best, what is left of it ``[output, sample]``, and the cost."""

    numbers: dict[str, float]
    left: Matrix
    cost: float


@dataclass(frozen=True, kw_only=True)
class Yardstick:
    """Outputs and noise by which changes of a log are measured.

    Attributes
    ----------
    view
        Linear response at the true numbers.
    steps
        One sigma of each number of the model, in the number's unit.
    outputs, noise
        RMS of each output and of its noise, ``[output]``.
    """

    view: LinearView
    steps: dict[str, float]
    outputs: Matrix
    noise: Matrix

    @cached_property
    def share(self) -> float:
        """Pooled noise over the outputs."""
        return float(np.sqrt(np.mean((self.noise / self.outputs) ** 2)))

    @cached_property
    def weights(self) -> Matrix:
        """What turns a change ``[output, sample]`` into one over the pooled noise."""
        weights: Matrix = 1 / (self.outputs * self.share)
        return weights[:, np.newaxis]

    def ratio(self, change: Matrix) -> float:
        """Pooled RMS of a change over the pooled noise."""
        return float(np.sqrt(np.mean((change * self.weights) ** 2)))

    def tuned(self, change: Matrix, within: float = np.inf) -> Tuning:
        """Tune the model's numbers to a change of the log, each at the price of its tolerance, `within` some sigma.

        A price of one for a sigma's square is little beside thousands of samples: without a bound, what is left is
        what wrong numbers would leave as well, and less than what numbers inside their tolerances would.
        Levenberg and Marquardt's steps over the exact linear response: a spring's few per cent shift a sharp
        resonance farther than a straight line follows. Numbers that are wrong by far may not be reached.
        """
        numbers = self.view.network.numbers()
        fit = Tuning(numbers=numbers, left=change, cost=self._cost(numbers, change))
        normal, slope = self._normal(fit)
        caution = 1e-2
        for _ in range(_TRIES):
            pull = slope - self._sigmas(fit.numbers)
            damped: Matrix = normal + np.diag(1 + caution * np.diag(normal))
            step: Matrix = np.linalg.solve(damped, pull).astype(np.float64)
            tried = self._tried(change, fit, step, within)
            caution *= 0.1 if tried.cost < fit.cost else 6.0
            if tried.cost >= fit.cost:
                continue
            done = tried.cost > 0.98 * fit.cost
            fit = tried
            if done:
                break
            normal, slope = self._normal(fit)
        return fit

    def _with(self, numbers: dict[str, float]) -> LinearView:
        return replace(self.view, network=self.view.network.with_numbers(numbers))

    def _cost(self, numbers: dict[str, float], left: Matrix) -> float:
        return float(np.sum((left * self.weights) ** 2) + np.sum(self._sigmas(numbers) ** 2))

    def _normal(self, fit: Tuning) -> tuple[Matrix, Matrix]:
        """Normal matrix of the changes by one sigma of each number, and their product with what is left."""
        sizes = np.array(list(self.steps.values()))
        changes = self._with(fit.numbers).by_numbers(list(self.steps))
        by_step = (changes * (self.weights * sizes[:, np.newaxis, np.newaxis])).reshape(len(sizes), -1)
        return by_step @ by_step.T, by_step @ (fit.left * self.weights).ravel()

    def _sigmas(self, numbers: dict[str, float]) -> Matrix:
        true = self.view.network.numbers()
        return np.array([(numbers[name] - true[name]) / step for name, step in self.steps.items()])

    def _tried(self, change: Matrix, fit: Tuning, step: Matrix, within: float) -> Tuning:
        """Go along a step; no number falls below a third of what it was."""
        off = (self._sigmas(fit.numbers) + step).clip(-within, within)
        true = self.view.network.numbers()
        numbers = {
            name: max(true[name] + sigmas * sigma, fit.numbers[name] / 3)
            for sigmas, (name, sigma) in zip(off.tolist(), self.steps.items(), strict=True)
        }
        left = change - (self._with(numbers).log() - self._log)
        return Tuning(numbers=numbers, left=left, cost=self._cost(numbers, left))

    @cached_property
    def _log(self) -> Matrix:
        return self.view.log()

    def elsewhere(self, change: Matrix, directions: Sequence[Matrix]) -> list[float]:
        """What is left of a change when any force whatever acts along another direction, over the noise, of each.

        A force that nobody knows is free on each frequency line, where several outputs still bind it by its
        transfer functions; with one output nothing is left. A window keeps the log's ends out of it.
        """
        view = self.view
        window = hann(change.shape[1], sym=False)
        spectra = rfft(change * self.weights * window, view.length // view.per_sample)
        lines = min(spectra.shape[1], view.below_half)
        total = np.sum(np.abs(spectra[:, :lines]) ** 2)
        left = []
        for direction in directions:
            transfer = view.by_force(direction)[:, :lines] * self.weights
            transfer += self._in_the_way(direction)
            along = np.abs(np.sum(transfer.conj() * spectra[:, :lines], axis=0)) ** 2
            size = np.sum(np.abs(transfer) ** 2, axis=0)
            explained = np.sum(along / np.where(size > 0, size, 1.0))
            left.append(self.ratio(change) * float(np.sqrt(max(1 - explained / total, 0.0))))
        return left

    def _in_the_way(self, direction: Matrix) -> Matrix:
        """What a joint's own force sensor shows of a force along the joint."""
        shown = [
            sensor.measures == "force" and np.array_equal(self.view.network.place(sensor), direction)
            for sensor in self.view.network.sensors
        ]
        return np.array(shown, dtype=np.float64)[:, np.newaxis] * self.weights


def port_directions(view: LinearView) -> dict[str, Matrix]:
    """Directions of all joints and bodies, by their names."""
    network = view.network
    joints = {joint.name: network.joint_direction(number) for number, joint in enumerate(network.joints)}
    return joints | {body: network.direction(GROUND, number) for number, body in enumerate(network.bodies)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A family of filters: its response at s = j omega by parameters, and where a fit of these begins."""

    response: Callable[[Spectrum, Matrix], Spectrum]
    starts: tuple[tuple[float, ...], ...]


# Times are in samples, so s is too: omega over the rate.
_LATE = Form(response=lambda s, x: np.exp(-s * x[0]), starts=((0.3,), (-0.3,), (2.0,), (-2.0,), (6.0,)))
_FIRST = Form(response=lambda s, x: 1 / (1 + s * np.exp(x[0])), starts=((-1.0,), (1.0,), (3.0,)))
_SECOND = Form(
    response=lambda s, x: 1 / (1 + 2 * x[1] * s * np.exp(x[0]) + (s * np.exp(x[0])) ** 2),
    starts=((-2.0, 0.5), (-0.5, 0.1), (-0.5, 1.0), (1.0, 0.7)),
)
_HIGH = Form(response=lambda s, x: s / (s + np.exp(x[0])), starts=((-7.0,), (-4.0,), (-2.0,)))
INPUT_FORMS: Mapping[str, tuple[Form, ...]] = {"delay": (_LATE,), "lag": (_FIRST, _SECOND)}
OUTPUT_FORMS: Mapping[str, tuple[Form, ...]] = {
    "time_offset": (_LATE,), "mounting_resonance": (_SECOND,), "ac_coupling": (_HIGH,)
}  # fmt: skip


def as_other_filter(scene: Scene, word: str, site: str, response: Filter) -> tuple[float, str]:
    """Share of a filter's change that the nearest filter of another word leaves, and that word."""
    energy, forms = _energy(scene, site)
    lines = np.unique(np.linspace(1, len(energy) - 1, min(_LINES, len(energy) - 1)).astype(int))
    omega, weights = scene.view.omega[lines], np.sqrt(energy[lines])
    true = response(omega)
    whole = np.sum((weights * np.abs(true - 1)) ** 2)
    s = 1j * omega / scene.grid.rate_hz
    left = {
        other: min(_left(form, s, true, weights) for form in family)
        for other, family in forms.items()
        if other != word
    }
    nearest = min(left, key=left.__getitem__)
    return float(np.sqrt(left[nearest] / whole)), nearest


def _energy(scene: Scene, site: str) -> tuple[Matrix, Mapping[str, tuple[Form, ...]]]:
    """Energy on the lines that a signal's filter changes: an output's own, or of all outputs by an input."""
    view, names = scene.view, [drive.name for drive in scene.network.drives]
    size = scene.outputs_rms[:, np.newaxis]
    if site not in names:
        row = [sensor.name for sensor in scene.network.sensors].index(site)
        energy: Matrix = np.abs(view.outputs[row, : view.below_half]) ** 2
        return energy, OUTPUT_FORMS
    number = names.index(site)
    by_unit = view.by_force(-scene.network.forces()[:, number]) / size
    energy = np.sum(np.abs(by_unit * view.inputs[number, : view.below_half]) ** 2, axis=0)
    return energy, INPUT_FORMS


def _left(form: Form, s: Spectrum, true: Spectrum, weights: Matrix) -> float:
    def rest(x: Matrix) -> Matrix:
        with np.errstate(over="ignore", invalid="ignore"):
            difference = weights * (form.response(s, x) - true)
        stacked = np.concatenate([difference.real, difference.imag])
        worst = 1e6 * float(weights.max())
        finite: Matrix = np.nan_to_num(stacked, nan=worst, posinf=worst)
        return finite

    return min(2 * float(least_squares(rest, start, max_nfev=40).cost) for start in form.starts)
