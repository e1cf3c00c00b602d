"""Modes picked by hand: poles clicked in the stabilisation chart, and the list of frequencies that repeats them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from chladni.apps.modal_channels import responses_alone
from chladni.apps.modes import (
    Band,
    FromFunctions,
    FromResponses,
    Method,
    Wanted,
    measured_functions,
    modes_of_response,
)
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.io.source import SeriesLike, log_or_series, response_of
from chladni.modal.checks.roving import over_hit_points
from chladni.modal.experimental.polyreference import with_form
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.synthesis import modal_fit
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.modal.shapes.mac import auto_mac
from chladni.signals.channel import Names, as_names
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.time_series import TimeSeries
from chladni.viewers.bench import picking_panel, serve_picking
from chladni.viewers.bench.picked import Picked

if TYPE_CHECKING:
    from chladni.viewers.bench.server import BenchServer
    from chladni.viewers.bench.theme import Ground

#: Functions and modes for these frequencies, or for an automatic choice.
Choose = Callable[[tuple[float, ...] | None], tuple[FrequencyResponse | None, ModeSet]]

# Digits of a frequency that is picked: enough to tell poles apart, few enough to be typed.
DIGITS = 6
# A start that asks for a mode where there is none is mended so often.
ROUNDS = 5


class ModePicking:
    """Modes that a person picks, and the frequencies that repeat them; a notebook shows its page.

    Each change identifies the modes anew, as `identify_modes` does with ``frequencies_hz=``: the same list gives the
    same modes, whoever asks.

    Attributes
    ----------
    shown
        What is picked: ``frequencies_hz``, rising, the `ModeSet` of them, its AutoMAC, and the synthesis of these
        modes alone.
    asked
        Frequencies asked for last; those of `shown` unless a fit is on its way or failed.

    Examples
    --------
    >>> picking = pick_modes("arm.mcap", references="/hammer.wrench.force.x")  # doctest: +SKIP
    >>> picking.take([24.7, 61.3]).modes.frequency_hz  # doctest: +SKIP
    """

    def __init__(self, choose: Choose, *, title: str, start_hz: Sequence[float] | None = None) -> None:
        self._choose = choose
        self.title = title
        found = self._first(start_hz)
        _diagram(found.modes)
        self.shown = found
        self.asked = found.frequencies_hz

    @property
    def modes(self) -> ModeSet:
        """Modes that are picked."""
        return self.shown.modes

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """What `identify_modes` takes as ``frequencies_hz=`` to give the same modes."""
        return self.shown.frequencies_hz

    def toggle(self, row: int) -> tuple[float, ...]:
        """Ask for the mode of a pole of the diagram, or for all but it when it's picked; `fit` then identifies them.

        Parameters
        ----------
        row
            Of ``modes.stabilisation``.

        Returns
        -------
        tuple of float
            The frequencies that are asked for now.
        """
        diagram = _diagram(self.shown.modes)
        mode = int(diagram.mode[row])
        if mode >= 0:
            # Both rise: the first frequency is the first mode's.
            gone = self.shown.frequencies_hz[mode]
            self.asked = tuple(one for one in self.asked if one != gone)
        else:
            self.asked = tuple(sorted({*self.asked, _short(float(diagram.frequency_hz[row]))}))
        return self.asked

    def take(self, frequencies_hz: Sequence[float]) -> Picked:
        """Pick just these.

        Raises
        ------
        EstimateError
            When there is no mode at one of them; what was picked stays.
        """
        self.asked = tuple(sorted(float(one) for one in frequencies_hz))
        try:
            self.accept(self.fit(self.asked))
        except EstimateError:
            self.give_up()
            raise
        return self.shown

    def fit(self, frequencies_hz: Sequence[float]) -> Picked:
        """Identify the modes of these frequencies; nothing is changed.

        Raises
        ------
        EstimateError
            When there is no mode at one of them.
        """
        wanted = tuple(frequencies_hz)
        if not wanted:
            return _emptied(self.shown)
        picked = self._fitted(wanted)
        if picked.modes.frequency_hz.size != len(wanted):
            raise EstimateError(_nothing_there(picked.modes, wanted))
        return picked

    def accept(self, picked: Picked) -> None:
        """Take what `fit` gave as what is picked."""
        self.shown = picked

    def give_up(self) -> None:
        """Ask for what is picked, and no more."""
        self.asked = self.shown.frequencies_hz

    def panel(self, *, ground: "Ground" = "light") -> Any:
        """Give the page as a Panel object, for a notebook or a dashboard of one's own."""
        return picking_panel(self, ground=ground)

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        return self.panel()._repr_mimebundle_(include, exclude)  # what notebooks call

    def _fitted(self, wanted: tuple[float, ...] | None) -> Picked:
        response, modes = self._choose(wanted)
        return Picked(
            frequencies_hz=wanted or tuple(_short(float(one)) for one in modes.frequency_hz),
            response=response,
            modes=modes,
            mac=auto_mac(modes),
            synthesis=_synthesis(response, modes),
        )

    def _first(self, start_hz: Sequence[float] | None) -> Picked:
        """Pick what was asked for, or what would be chosen automatically, so that the list gives just these modes."""
        found = self._fitted(None if start_hz is None else tuple(sorted(float(one) for one in start_hz)))
        for _ in range(ROUNDS):
            wanted = _answered(found.frequencies_hz, found.modes)
            if not wanted:
                return _emptied(found)
            again = self._fitted(wanted)
            if again.modes.frequency_hz.size == len(wanted):
                return again
            found = again
        raise EstimateError(_nothing_there(found.modes, found.frequencies_hz))


def pick_modes(
    source: SeriesLike | FrequencyResponse,
    *,
    references: Names | None = None,
    responses: Names | None = None,
    operational: bool = False,
    method: Method | None = None,
    band_hz: Band | None = None,
    count: int | None = None,
    frequencies_hz: Sequence[float] | None = None,
    resolution_hz: float | None = None,
    sample_rate_hz: float | None = None,
    frequency_hz: ArrayLike | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> ModePicking:
    """Pick modes by clicking at poles in the stabilisation chart; synthesis and MAC follow.

    Parameters
    ----------
    source, references, responses, operational, band_hz, resolution_hz, sample_rate_hz, frequency_hz, start_s, end_s
        As `identify_modes` takes them.
    method
        `PolyReferenceLeastSquares` (the default for frequency responses) or `CovarianceDrivenSubspace` (the default
        for responses alone); others have no stabilisation chart.
    count, frequencies_hz
        What is picked at the start: so many at most, or the modes nearest to these frequencies; an automatic choice
        otherwise.

    Returns
    -------
    ModePicking
        Its page is what a notebook shows. ``.modes`` holds what is picked, and ``.frequencies_hz`` the list that
        repeats it: ``identify_modes(source, frequencies_hz=picking.frequencies_hz)``, other arguments alike.

    Raises
    ------
    SetupError
        When the method has no stabilisation chart.
    LogError, EstimateError
        As `identify_modes` raises them.

    Examples
    --------
    >>> picking = pick_modes("arm.mcap", band_hz=(10, 400))  # doctest: +SKIP
    >>> picking  # the last word of a notebook's cell shows the chart  # doctest: +SKIP
    >>> chladni.identify_modes("arm.mcap", band_hz=(10, 400), frequencies_hz=picking.frequencies_hz)  # doctest: +SKIP
    """
    if count is not None and frequencies_hz is not None:
        raise SetupError("count and frequencies_hz exclude each other: the frequencies are the count")
    first = Wanted.of(bands_hz=None if band_hz is None else [band_hz], count=count, frequencies_hz=frequencies_hz)
    if isinstance(source, FrequencyResponse) or frequency_hz is not None:
        response = over_hit_points(response_of(source, frequency_hz=frequency_hz))
        return _of_response(response, method, first)
    return pick_modes_of(
        log_or_series(source, sample_rate_hz=sample_rate_hz),
        references=references,
        responses=None if responses is None else as_names(responses),
        operational=operational,
        method=method,
        wanted=first,
        averaging=Averaging(resolution_hz=resolution_hz),
        span=Span(start_s=start_s, end_s=end_s),
    )


@in_one_thread()
def pick_modes_of(
    source: Log | TimeSeries,
    *,
    references: Names | None,
    responses: Sequence[str] | None,
    operational: bool,
    method: Method | None,
    wanted: Wanted,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> ModePicking:
    """Read a log or a series once, and give the picking of its modes; see `pick_modes`."""
    title = source.path.name if isinstance(source, Log) else "modes"
    if operational or isinstance(method, FromResponses):
        subspace = CovarianceDrivenSubspace() if method is None else method
        if not isinstance(subspace, CovarianceDrivenSubspace):
            raise SetupError(
                f"{type(subspace).__name__} has no model orders, so there is no stabilisation chart to pick from; "
                "take ssi-cov"
            )
        if averaging.resolution_hz is not None:
            raise EstimateError("the subspace method has no lines, so a resolution says nothing to it; leave it out")
        samples, notes = responses_alone(source, responses, span, progress=progress)
        models = subspace.prepare(samples, band_hz=wanted.bands_hz[0] if wanted.bands_hz else None)

        def from_responses(frequencies_hz: tuple[float, ...] | None) -> tuple[None, ModeSet]:
            found = models.identify(count=None if frequencies_hz else wanted.count, frequencies_hz=frequencies_hz)
            return None, replace(found, provenance=found.provenance.with_notes(*notes))

        return ModePicking(from_responses, title=title, start_hz=wanted.frequencies_hz)
    _require_orders(method)
    # With a frequency named, a hammer's functions reach as far as they do when the list is given.
    asking = replace(wanted, count=None, frequencies_hz=wanted.frequencies_hz or (1.0,))
    functions = measured_functions(
        source, references, responses, wanted=asking, averaging=averaging, span=span, progress=progress
    )

    def from_functions(frequencies_hz: tuple[float, ...] | None) -> tuple[FrequencyResponse, ModeSet]:
        return functions.modes(method=method, wanted=_asking(wanted, frequencies_hz))

    return ModePicking(from_functions, title=title, start_hz=wanted.frequencies_hz)


def open_picking(picking: ModePicking, *, port: int = 0) -> "BenchServer":
    """Give a server of the page, bound to this computer only; its ``run`` ends when the selection is kept.

    Raises
    ------
    SetupError
        When Panel isn't installed, or the port is taken.
    """
    return serve_picking(picking, port=port)


def pick(diagram: Any, source: SeriesLike | FrequencyResponse, **options: Any) -> ModePicking:
    """See `StabilisationDiagram.pick`, which calls this with the frequencies of the modes taken from its poles."""
    taken = [float(np.median(diagram.frequency_hz[diagram.mode == mode])) for mode in range(diagram.mode.max() + 1)]
    return pick_modes(source, **({"frequencies_hz": taken} if taken else {}) | options)


def _of_response(response: FrequencyResponse, method: Method | None, first: Wanted) -> ModePicking:
    _require_orders(method)

    def choose(frequencies_hz: tuple[float, ...] | None) -> tuple[FrequencyResponse, ModeSet]:
        return response, modes_of_response(response, method=method, wanted=_asking(first, frequencies_hz))

    return ModePicking(in_one_thread()(partial(choose)), title="modes", start_hz=first.frequencies_hz)


def _diagram(modes: ModeSet) -> StabilisationDiagram:
    if modes.stabilisation is None:
        raise SetupError(
            "this method has no model orders, so there is no stabilisation chart to pick from; "
            "take plscf with an excitation, or ssi-cov for responses alone"
        )
    return modes.stabilisation


def _require_orders(method: Method | None) -> None:
    if method is not None and not isinstance(method, FromFunctions):
        raise SetupError(f"{type(method).__name__} works on responses alone; pick with operational=True")


def _asking(first: Wanted, frequencies_hz: tuple[float, ...] | None) -> Wanted:
    if frequencies_hz is None:
        return replace(first, frequencies_hz=None)
    return replace(first, count=None, frequencies_hz=frequencies_hz)


def _emptied(picked: Picked) -> Picked:
    """Give the same diagram without a mode."""
    none = picked.modes.select(np.zeros(0, dtype=np.intp))
    return Picked(
        frequencies_hz=(),
        response=picked.response,
        modes=replace(none, fit=None, provenance=replace(none.provenance, notes=())),
        mac=np.zeros((0, 0)),
        synthesis=None,
    )


def _synthesis(response: FrequencyResponse | None, modes: ModeSet) -> ModalFit | None:
    """Fit shapes and residuals to the poles that are picked: the modes' own fit has those that help it, too."""
    if response is None or modes.fit is None or not modes.frequency_hz.size or modes.participation is None:
        return None
    measured, _ = with_form(response)
    lines_hz = modes.fit.frequency_hz
    # The poles are the structure's; what was measured decays by its window, too.
    poles = modes.poles - response.provenance.window_decay_per_s
    band_hz = (float(lines_hz[0]), float(lines_hz[-1]))
    model = least_squares_frequency_domain(measured, poles, modes.participation, band_hz=band_hz)
    return modal_fit(measured, model, band_hz=band_hz)


def _answered(wanted: Sequence[float], modes: ModeSet) -> tuple[float, ...]:
    """Frequencies, rising, without those that no mode was found for: each mode is of the one nearest to it."""
    left = list(wanted)
    kept = []
    for found in modes.frequency_hz.tolist():
        if not left:
            break
        nearest = min(left, key=lambda one: abs(one - found))
        left.remove(nearest)
        kept.append(nearest)
    return tuple(sorted(kept))


def _nothing_there(modes: ModeSet, wanted: Sequence[float]) -> str:
    missing = sorted(set(wanted) - set(_answered(wanted, modes)))
    names = ", ".join(f"{one:g} Hz" for one in missing)
    why = next((note for note in modes.provenance.notes if note.startswith("no pole within")), "")
    return f"no mode of its own at {names}" + (f": {why}" if why else "; pick a pole that more orders agree on")


def _short(frequency_hz: float) -> float:
    return float(f"{frequency_hz:.{DIGITS}g}")
