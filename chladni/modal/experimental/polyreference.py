"""Modes from frequency responses: poly-reference least squares, automatic choice, maximum likelihood."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from chladni.modal.experimental.candidates import Candidates, candidates
from chladni.modal.experimental.exponential_window import without_window_damping
from chladni.modal.experimental.judged_lines import JudgedLines, judged_lines
from chladni.modal.experimental.mode_report import ModeReport
from chladni.modal.experimental.pole_search import closer_search, first_search
from chladni.modal.experimental.pruned_fit import explained, pruned_fit
from chladni.modal.experimental.significance import SignificanceRules
from chladni.modal.fit.line_information import line_correlation_factor
from chladni.modal.poles.pole_selection import SelectionRules, require_request
from chladni.modal.poles.stabilisation import StabilityLimits
from chladni.signals.errors import SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.unit_text import in_unit
from chladni.spectral.forms import MOTION_ORDER, form

Band = tuple[float, float]

CLOSER_LOOKS = 3


def _generous() -> SelectionRules:
    # What follows tests each mode against the data, so that few orders are enough for a candidate, and any damping.
    return SelectionRules(share=0.15, damping=(0.0, 0.2))


@dataclass(frozen=True, slots=True, kw_only=True)
class PolyReferenceLeastSquares:
    """Identify modes from frequency responses of one or more references.

    Poles of all orders (`polyreference_poles`), clusters over the orders (`select_poles`), a closer look where they
    leave something unexplained (`closer_search`), refinement by maximum likelihood with covariance (`refine`), and a
    test whether the data need each mode (`mode_significance`).

    Attributes
    ----------
    max_order
        Highest model order; None chooses by the number of lines and references, at most 60.
    selection
        What makes poles of many orders a candidate.
    significance
        What a candidate must show to be a mode.
    stability
        Limits of the stabilisation diagram.
    driving_point
        Names of response and reference that scale the modes; None takes a pair at one point along one axis.

    Examples
    --------
    >>> PolyReferenceLeastSquares(max_order=40).identify(response, band_hz=(10, 400))  # doctest: +SKIP
    """

    max_order: int | None = None
    selection: SelectionRules = field(default_factory=_generous)
    significance: SignificanceRules = field(default_factory=SignificanceRules)
    stability: StabilityLimits = field(default_factory=StabilityLimits)
    driving_point: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        if self.max_order is not None and self.max_order < 1:
            raise SetupError(f"max_order {self.max_order} must be at least 1; leave it out to have it chosen")

    def identify(
        self,
        response: FrequencyResponse,
        *,
        band_hz: Band | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | None = None,
    ) -> ModeSet:
        """Identify the modes of a band.

        Parameters
        ----------
        response
            Accelerance, mobility or receptance; lines that aren't excited or finite don't count. Responses without a
            unit of motion are taken as accelerations, with a note.
        band_hz
            Lowest and highest line; None for all that are excited.
        count
            Largest number of modes: the most significant ones. When the data hold fewer a note says so.
        frequencies_hz
            Frequencies to take a mode at instead of choosing. One with no pole near is told in a note.

        Returns
        -------
        ModeSet
            With fit, spread over orders, stabilisation diagram, and scale where there is a driving point. Empty
            when the data need no mode; a note says why.

        Raises
        ------
        EstimateError
            When too few lines are left to find modes in.
        SetupError
            When `band_hz`, `count` or `frequencies_hz` are impossible.
        """
        require_request(count, frequencies_hz, band_hz)
        measured, notes = with_form(response)
        lines = judged_lines(
            measured,
            form(measured),
            band_hz=band_hz,
            correlated_lines=line_correlation_factor(response.provenance),
        )
        # From here on the band is what is excited in it: nothing picks a line that the judge doesn't know.
        measured = replace(measured, excited=np.isin(response.frequency_hz, lines.frequency_hz))
        candidates = self._candidates(measured, lines, frequencies_hz)
        fit = pruned_fit(measured, lines, candidates, self.significance)
        report = ModeReport(
            response=response,
            measured=measured,
            candidates=candidates,
            stability=self.stability,
            driving_point=self.driving_point,
        )
        modes = report.mode_set(fit, count=count, notes=notes)
        decay_per_s = response.provenance.window_decay_per_s
        return without_window_damping(modes, decay_per_s) if decay_per_s > 0 else modes

    def _candidates(
        self, measured: FrequencyResponse, lines: JudgedLines, frequencies_hz: Sequence[float] | None
    ) -> Candidates:
        """Look for poles, and again more closely where those that the data need leave something."""
        search = first_search(measured, lines, max_order=self.max_order)
        for _ in range(CLOSER_LOOKS):
            found = candidates(search.table, self.selection, frequencies_hz)
            closer = closer_search(search, measured, lines, explained(measured, lines, found, self.significance))
            if closer is None:
                return found
            search = closer
        return candidates(search.table, self.selection, frequencies_hz)


def with_form(response: FrequencyResponse) -> tuple[FrequencyResponse, tuple[str, ...]]:
    """Give responses whose unit says nothing the one that most sensors measure, and say so."""
    units = {channel.unit for channel in response.responses}
    if units & MOTION_ORDER.keys() or len(units) > 1:
        # Checks them, and tells what is wrong with a mixture.
        form(response)
        return response, ()
    taken = tuple(replace(channel, unit="m/s^2", overload=None) for channel in response.responses)
    note = (
        f"responses {in_unit(units.pop())} are taken as accelerations; another motion changes participation and "
        "residuals, not frequencies and damping: state the unit in the setup file"
    )
    return replace(response, responses=taken), (note,)
