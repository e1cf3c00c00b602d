"""Modes from responses alone by covariance-driven subspace identification, with error bars."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np

from chladni.modal.operational.correlation import CorrelationFunctions
from chladni.modal.operational.harmonics import LONGEST_SEGMENT_SHARE, SHORTEST_SEGMENT, machine_harmonics
from chladni.modal.operational.response_record import (
    ResponseRecord,
    first_stretch,
    lead_spectra,
    open_record,
    read_record,
)
from chladni.modal.operational.spectral_decomposition import decompose as decompose_spectra
from chladni.modal.operational.ssi import OrderModel, SubspaceDecomposition, decompose, order_models, pole_table
from chladni.modal.operational.ssi_uncertainty import ErrorPropagation, all_pole_deviations, shape_std, student_factor
from chladni.modal.operational.subspace_candidates import ChosenPoles, ResponseRules, choose_poles
from chladni.modal.operational.subspace_plan import SubspacePlan, plan_subspace
from chladni.modal.poles.certain_poles import least_std, pole_std
from chladni.modal.poles.pole_selection import SelectionRules, require_request
from chladni.modal.poles.pole_table import PoleTable
from chladni.modal.poles.stabilisation import StabilityLimits, stabilisation_diagram
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import SetupError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.units import power_density_unit
from chladni.spectral.blocks import Source
from chladni.spectral.stretches import valid_runs

Band = tuple[float, float]

UNSCALED = "shapes are unscaled: responses alone don't tell the forces, so that there is no modal mass"
ONE_CHANNEL = (
    "one channel only: there are no shapes, and modes close to each other can't be told apart; take several channels"
)


def _generous() -> SelectionRules:
    # What follows tests each candidate against the data, so that few orders are enough for one.
    return SelectionRules(share=0.15)


@dataclass(frozen=True, slots=True, kw_only=True)
class CovarianceDrivenSubspace:
    """Identify modes from responses alone (SSI-cov): output-only modal analysis.

    Correlation functions with their scatter between blocks (`correlation_functions`), subspace models of all orders
    (`subspace_poles`), their first-order covariance (`all_pole_deviations`), clusters over the orders
    (`select_poles`), and the tests whether a cluster is a mode (`choose_poles`).

    Attributes
    ----------
    block_rows
        Lags in the rows and columns of the Hankel matrix, after decimation; None for lags that span four cycles of
        the lowest peak of the spectra.
    max_order
        Highest model order; None for 60, or what a short record has room for.
    references
        Names of the channels to correlate with; None for all, or the twelve that are least alike.
    selection
        What makes poles of many orders a candidate.
    rules
        What a candidate must show to be a mode.
    stability
        Limits of the stabilisation diagram.

    Examples
    --------
    >>> CovarianceDrivenSubspace(block_rows=30).identify(series, band_hz=(1.0, 5.0))  # doctest: +SKIP
    """

    block_rows: int | None = None
    max_order: int | None = None
    references: Sequence[str] | None = None
    selection: SelectionRules = field(default_factory=_generous)
    rules: ResponseRules = field(default_factory=ResponseRules)
    stability: StabilityLimits = field(default_factory=StabilityLimits)

    def __post_init__(self) -> None:
        if self.block_rows is not None and self.block_rows < 2:
            raise SetupError(f"block_rows {self.block_rows} must be at least 2; leave it out to have it chosen")
        if self.max_order is not None and self.max_order < 2:
            raise SetupError(f"max_order {self.max_order} must be at least 2, the order of a single mode")

    def identify(
        self,
        source: Source,
        *,
        band_hz: Band | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | None = None,
    ) -> ModeSet:
        """Identify the modes of a structure from its responses to loads that nobody measured.

        Parameters
        ----------
        source
            Responses, a series or consecutive blocks of one (read once, one at a time). The loads must be random and
            broad; lines of machines are told apart.
        band_hz
            Lowest and highest natural frequency; also sets the decimation. None for all peaks of the spectra.
        count
            Largest number of modes: those that most model orders hold. When the record holds fewer a note says so.
        frequencies_hz
            Frequencies to take a mode at instead of choosing. One with no pole near is told in a note.

        Returns
        -------
        ModeSet
            Without participation and scale; with spread over orders, stabilisation diagram and lines of machines.
            Empty when the record shows no mode; a note says why.

        Raises
        ------
        EstimateError
            When the record is too short for the lags, no channel varies, a sample isn't finite without being marked
            invalid, or a reference is not among the channels.
        SetupError
            When `band_hz`, `count`, `frequencies_hz`, or the orders and block rows are impossible.

        Notes
        -----
        Peeters & De Roeck (1999), Mech. Syst. Signal Process. 13, 855; error bars after Reynders, Pintelon & De Roeck
        (2008) and Doehler & Mevel (2013), not below what a record of this length allows (Au 2014).
        """
        require_request(count, frequencies_hz, band_hz)
        return self.prepare(source, band_hz=band_hz).identify(count=count, frequencies_hz=frequencies_hz)

    def prepare(self, source: Source, *, band_hz: Band | None = None) -> "SubspaceModels":
        """Read the responses and solve the models of all orders; modes are then chosen from them, as often as wanted.

        See `identify` for the arguments and the errors.
        """
        require_request(None, None, band_hz)
        record = open_record(source)
        spectra = lead_spectra(record, band_hz)
        plan = plan_subspace(
            spectra,
            record.sample_rate_hz,
            samples=record.samples,
            block_rows=self.block_rows,
            max_order=self.max_order,
            references=self.references,
            band_hz=band_hz,
        )
        correlations, spectra = read_record(record, spectra, plan)
        return SubspaceModels(
            method=self,
            record=record,
            plan=plan,
            correlations=correlations,
            spectra=spectra,
            poles=_solve(correlations, plan),
            harmonics=_harmonics(record, plan.band_hz),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Poles:
    """Models of all orders, and the table of their poles."""

    decomposition: SubspaceDecomposition
    models: tuple[OrderModel, ...]
    table: PoleTable

    def locate(self, row: int) -> tuple[OrderModel, int]:
        """Model of a row of the table, and the number of the pole in it."""
        ends = list(accumulate(model.kept.size for model in self.models))
        place = int(np.searchsorted(ends, row, side="right"))
        model = self.models[place]
        return model, row - ends[place] + model.kept.size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SubspaceModels:
    """Models of all orders of one record, and all that is told of the modes chosen from them."""

    method: CovarianceDrivenSubspace
    record: ResponseRecord
    plan: SubspacePlan
    correlations: CorrelationFunctions
    spectra: CrossSpectra
    poles: _Poles
    harmonics: tuple[MachineHarmonic, ...]

    def identify(self, *, count: int | None = None, frequencies_hz: Sequence[float] | None = None) -> ModeSet:
        """Choose modes, as `CovarianceDrivenSubspace.identify` does."""
        require_request(count, frequencies_hz, None)
        chosen = choose_poles(
            self.correlations,
            self.poles.table,
            block_rows=self.plan.block_rows,
            band_hz=self.plan.band_hz,
            harmonics=self.harmonics,
            count=count,
            frequencies_hz=frequencies_hz,
            selection=self.method.selection,
            rules=self.method.rules,
        )
        return replace(
            _mode_set(self.correlations, self.poles, chosen),
            harmonics=self.harmonics,
            stabilisation=_diagram(self.poles.table, chosen, self.spectra, self.method.stability),
            provenance=_provenance(self.correlations, self.record, self.plan, chosen),
        )


def _solve(correlations: CorrelationFunctions, plan: SubspacePlan) -> _Poles:
    decomposition = decompose(correlations, block_rows=plan.block_rows, max_order=plan.orders[-1])
    models = tuple(order_models(decomposition, plan.orders))
    deviations = all_pole_deviations(correlations, decomposition, models)
    table = pole_table(
        decomposition,
        models,
        plan.orders,
        frequency_std_hz=deviations.frequency_std_hz,
        damping_std=deviations.damping_std,
    )
    return _Poles(decomposition=decomposition, models=models, table=table)


def _harmonics(record: ResponseRecord, band_hz: Band) -> tuple[MachineHarmonic, ...]:
    series = first_stretch(record)
    longest = max((last - first for first, last in valid_runs(series)), default=0)
    # Kurtosis needs a stretch of its own; in a shorter one nothing can be told.
    return machine_harmonics(series, band_hz=band_hz) if longest >= LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT else ()


def _mode_set(correlations: CorrelationFunctions, poles: _Poles, chosen: ChosenPoles) -> ModeSet:
    table, rows = poles.table, chosen.rows
    frequency_hz, damping = table.frequency_hz[rows], table.damping_ratio[rows]
    frequency_std, damping_std = pole_std(table, rows)
    # Fifty blocks know their scatter to a tenth: below what is possible it's known to be too low.
    least_hz, least_damping = least_std(frequency_hz, damping, correlations.duration_s)
    propagation = ErrorPropagation(correlations, poles.decomposition)
    factor = student_factor(correlations.blocks)
    shapes = np.zeros((rows.size, len(correlations.channels)), dtype=np.complex128)
    stds = np.zeros_like(shapes)
    for mode, row in enumerate(rows.tolist()):
        vector = table.vector[row]
        largest = np.argmax(np.abs(vector))
        shapes[mode] = vector / vector[largest]
        shapes[mode, largest] = 1.0
        stds[mode] = factor * shape_std(propagation.shape(*poles.locate(row)))
    return ModeSet(
        frequency_hz=frequency_hz,
        frequency_std_hz=np.maximum(factor * frequency_std, least_hz),
        damping_ratio=damping,
        damping_std=np.maximum(factor * damping_std, least_damping),
        shapes=shapes,
        shape_std=stds,
        channels=correlations.channels,
        spread=_spread(chosen),
        provenance=Provenance(),
    )


def _spread(chosen: ChosenPoles) -> OrderSpread:
    spread, clusters = chosen.selection.spread, chosen.clusters
    return OrderSpread(
        orders=spread.orders[clusters],
        frequency_hz=spread.frequency_hz[clusters],
        frequency_std_hz=spread.frequency_std_hz[clusters],
        damping_ratio=spread.damping_ratio[clusters],
        damping_std=spread.damping_std[clusters],
    )


def _diagram(
    table: PoleTable, chosen: ChosenPoles, spectra: CrossSpectra, limits: StabilityLimits
) -> StabilisationDiagram:
    # From clusters to modes; what was left out belongs to none.
    mode_of = np.full(chosen.selection.row.size + 1, -1)
    mode_of[chosen.clusters] = np.arange(chosen.clusters.size)
    decomposition = decompose_spectra(spectra)
    units = {channel.unit for channel in spectra.channels}
    return stabilisation_diagram(
        table,
        member=mode_of[chosen.selection.member],
        indicator_hz=decomposition.frequency_hz,
        indicator=decomposition.values.T,
        indicator_name="singular values of the cross-spectra",
        indicator_unit=power_density_unit(units.pop()) if len(units) == 1 else "1",
        limits=limits,
    )


def _provenance(
    correlations: CorrelationFunctions, record: ResponseRecord, plan: SubspacePlan, chosen: ChosenPoles
) -> Provenance:
    notes = [*chosen.notes, *plan.notes]
    if not chosen.rows.size:
        notes.insert(0, "no mode: no pole is the same at many model orders and in both halves of the record")
    if record.constant:
        notes.append(f"left out, since it doesn't vary: {', '.join(record.constant)}")
    if len(correlations.channels) == 1:
        notes.append(ONE_CHANNEL)
    if chosen.rows.size:
        notes.append(UNSCALED)
    return Provenance(
        estimator=f"SSI-cov, {plan.block_rows} block rows, orders to {plan.orders[-1]}",
        segment_s=correlations.duration_s / correlations.blocks,
        averages=correlations.blocks,
        effective_averages=float(correlations.blocks),
        notes=tuple(notes),
    )
