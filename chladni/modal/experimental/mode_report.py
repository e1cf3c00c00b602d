"""A fit of frequency responses as a set of modes, with all that tells whether to trust it."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from chladni.modal.experimental.candidates import Candidates
from chladni.modal.experimental.cmif import complex_mode_indicator
from chladni.modal.experimental.grouped_refinement import select_modes
from chladni.modal.experimental.line_spacing import COARSE, lines_for, longest_modal_segment_s, nothing_found
from chladni.modal.experimental.pruned_fit import PrunedFit
from chladni.modal.fit.fitted_modes import FittedModes
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.modal_mass import modal_scale
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.synthesis import modal_fit
from chladni.modal.poles.stabilisation import StabilityLimits, stabilisation_diagram
from chladni.signals.arrays import Index
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.wording import counted

ESTIMATOR = "pLSCF"
# Chi-square above which the modes don't explain the functions within their scatter.
INFLATED = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeReport:
    """What a set of modes is made from besides the fit.

    Attributes
    ----------
    response
        As it was given.
    measured
        With a known form and only the lines that were fitted excited.
    candidates
        What was chosen from.
    stability
        Limits of the diagram.
    driving_point
        Names of response and reference that scale the modes; None takes a pair at one point along one axis.
    """

    response: FrequencyResponse
    measured: FrequencyResponse
    candidates: Candidates
    stability: StabilityLimits
    driving_point: tuple[str, str] | None = None

    def mode_set(self, fit: PrunedFit, *, count: int | None, notes: tuple[str, ...]) -> ModeSet:
        """Give the modes asked for; an empty set, with the reason, when the data need none."""
        unresolved = self._unresolved(fit)
        if fit.fitted is None:
            return self._empty(count, (*notes, *(unresolved or (nothing_found(self.response),))))
        shown = self._shown(fit, count)
        fitted = select_modes(fit.fitted, np.isin(np.arange(fit.started.size), shown))
        model, started = fitted.model, fit.started[shown]
        scaling = modal_scale(
            fitted, self.response.responses, self.response.references, driving_point=self.driving_point
        )
        return ModeSet(
            frequency_hz=model.frequency_hz,
            frequency_std_hz=fitted.frequency_std_hz,
            damping_ratio=model.damping_ratio,
            damping_std=fitted.damping_std,
            shapes=model.shapes,
            shape_std=fitted.shape_std,
            channels=self.response.responses,
            references=self.response.references,
            participation=model.participation,
            scale=scaling.scale,
            spread=self._spread(started),
            fit=self._fit(fit.fitted.model),
            stabilisation=self._diagram(started),
            provenance=replace(self.response.provenance, estimator=ESTIMATOR).with_notes(
                *notes,
                *unresolved,
                *self.candidates.notes,
                *fitted.notes,
                *scaling.notes,
                *self._advice(fit, fit.fitted, shown),
                *_shortfall(count, shown.size),
            ),
        )

    def _fit(self, model: ModalModel) -> ModalFit:
        # All modes that were found, shown or not: one that nobody asked for is no reason to distrust the others.
        # Shapes that were fitted group by group have no residuals for the whole band.
        whole = least_squares_frequency_domain(self.measured, model.poles, model.participation)
        return modal_fit(self.measured, whole)

    def _shown(self, fit: PrunedFit, count: int | None) -> Index:
        rows = np.arange(fit.started.size)
        if self.candidates.only_asked:
            rows = rows[self.candidates.asked[fit.started]]
        strongest = rows[np.argsort(fit.significance.log_false_alarm[rows], kind="stable")]
        return np.sort(strongest[:count])

    def _empty(self, count: int | None, notes: tuple[str, ...]) -> ModeSet:
        none = np.zeros(0)
        functions = np.zeros((0, len(self.response.responses)), complex)
        return ModeSet(
            frequency_hz=none,
            frequency_std_hz=none,
            damping_ratio=none,
            damping_std=none,
            shapes=functions,
            shape_std=functions,
            channels=self.response.responses,
            references=self.response.references,
            participation=np.zeros((0, len(self.response.references)), complex),
            spread=self._spread(np.zeros(0, np.intp)),
            stabilisation=self._diagram(np.zeros(0, np.intp)),
            provenance=replace(self.response.provenance, estimator=ESTIMATOR).with_notes(
                *notes, *self.candidates.notes, *_shortfall(count, 0)
            ),
        )

    def _spread(self, started: Index) -> OrderSpread:
        spread = self.candidates.spread
        return OrderSpread(
            orders=spread.orders[started],
            frequency_hz=spread.frequency_hz[started],
            frequency_std_hz=spread.frequency_std_hz[started],
            damping_ratio=spread.damping_ratio[started],
            damping_std=spread.damping_std[started],
        )

    def _diagram(self, started: Index) -> StabilisationDiagram:
        # Candidates that came to nothing, and poles of no candidate (-1, the last place), point to no mode.
        place = np.full(self.candidates.pole.size + 1, -1)
        place[started] = np.arange(started.size)
        lines = self.measured.excited
        return stabilisation_diagram(
            self.candidates.table,
            member=place[self.candidates.member],
            indicator_hz=self.measured.frequency_hz[lines],
            indicator=complex_mode_indicator(self.measured)[:, lines],
            indicator_name="CMIF",
            indicator_unit=self.response.unit(0, 0),
            limits=self.stability,
        )

    def _unresolved(self, fit: PrunedFit) -> tuple[str, ...]:
        """Name the resonances that are left out since the lines don't tell where and how wide they are."""
        step_hz = float(self.response.frequency_hz[1] - self.response.frequency_hz[0])
        found = [] if fit.fitted is None else fit.fitted.model.frequency_hz.tolist()
        told: dict[float, float] = {}
        for pole in fit.unresolved:
            # What is narrower than a tenth of a line is left to the next look.
            frequency_hz, width_hz = float(abs(pole)) / (2 * pi), max(float(-pole.real) / pi, step_hz / 10)
            # A second round may have found it, or met it again.
            if all(abs(other_hz - frequency_hz) > max(width_hz, step_hz) for other_hz in (*found, *told)):
                told[frequency_hz] = width_hz
        if not told:
            return ()
        where, narrowest_hz = ", ".join(f"{frequency_hz:.4g}" for frequency_hz in sorted(told)), min(told.values())
        advice = "average longer" if narrowest_hz > COARSE * step_hz else lines_for(self.response, narrowest_hz)
        note = (
            f"no mode is taken near {where} Hz: what stands out there isn't known to half its width, or to half of "
            f"the {step_hz:.3g} Hz between lines; {advice}"
        )
        return (note,)

    def _advice(self, fit: PrunedFit, fitted: FittedModes, shown: Index) -> tuple[str, ...]:
        notes: list[str] = []
        if fitted.chi_square > INFLATED:
            notes.append(
                f"chi-square is {fitted.chi_square:.3g} for each degree of freedom: the modes don't explain the "
                "functions within their scatter (nonlinearity, a missing mode, a changing structure); error bars are "
                "widened for it"
            )
        coarse = shown[fit.significance.width[shown] < COARSE]
        if coarse.size:
            # As wide as they may be: a damping that is told from zero by nothing asks for no finer lines than that.
            frequency_hz = fitted.model.frequency_hz[coarse]
            width_hz = 2 * frequency_hz * (fitted.model.damping_ratio + fitted.damping_std)[coarse]
            frequencies = ", ".join(f"{one_hz:.4g}" for one_hz in frequency_hz)
            # Whole periods, hits and files have no window.
            carried = (
                "their damping is only as good as the model of the window"
                if longest_modal_segment_s(self.response)
                else "few lines carry their damping"
            )
            closer = lines_for(self.response, float(np.min(width_hz)))
            notes.append(
                f"modes at {frequencies} Hz are less than {COARSE:g} lines wide at half power: {carried}; {closer}"
            )
        return tuple(notes)


def _shortfall(count: int | None, found: int) -> tuple[str, ...]:
    if count is None or found >= count:
        return ()
    return (
        f"{counted(count, 'mode')} asked for, but the data need no more than {found}: more would only follow noise",
    )
