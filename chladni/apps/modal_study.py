"""The modal analyst's job: a log to validated modes and everything that can be said and shown of them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self

from chladni.apps.findings import reading_sentences
from chladni.apps.modes import Method, Wanted, functions_and_modes, modes_of_responses
from chladni.apps.picking import ModePicking, pick_modes_of
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.modal.checks.driving_point import check_driving_point
from chladni.modal.checks.reciprocity import check_reciprocity
from chladni.modal.experimental.circle_fit import CircleFit
from chladni.modal.experimental.half_power import HalfPower
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
from chladni.modal.operational.fdd import FrequencyDomainDecomposition
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.modal.shapes.relative_motion import relative_motion
from chladni.modal.shapes.shape_transmissibility import ShapeTransmissibility, shape_transmissibility
from chladni.modal.shapes.summary import summarise
from chladni.modal.shapes.validation import validate
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.shown_units import in_units, synthesis_in_units
from chladni.signals.study import Study

MethodName = Literal["plscf", "circle-fit", "half-power", "ssi-cov", "fdd", "efdd"]

METHODS: dict[MethodName, type[Method]] = {
    "plscf": PolyReferenceLeastSquares,
    "circle-fit": CircleFit,
    "half-power": HalfPower,
    "ssi-cov": CovarianceDrivenSubspace,
    "fdd": FrequencyDomainDecomposition,
    "efdd": EnhancedFrequencyDomainDecomposition,
}
FROM_RESPONSES: tuple[MethodName, ...] = ("ssi-cov", "fdd", "efdd")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalStudy:
    """Modes of a log with their checks, how vibration passes from point to point, and the study that viewers draw."""

    modes: ModeSet
    validation: ModeValidation
    transmissibility: tuple[ShapeTransmissibility, ...]
    study: Study

    def drawn_in(self, units: Sequence[str] | None) -> Self:
        """Give it with the functions that are drawn in other units: ``"g"``, ``"kN"``; None leaves all in SI.

        Raises
        ------
        SetupError
            When no channel is of such a quantity, or there are no functions, since no force was measured.
        """
        if not units:
            return self
        if self.study.response is None:
            raise SetupError(
                f"--unit {units[0]}: modes of responses alone have no functions, and shapes no unit; drop it"
            )
        modes = synthesis_in_units(self.modes, units)
        return replace(self, study=replace(self.study, response=in_units(self.study.response, units), modes=modes))


def modal_study(
    log: Log,
    *,
    references: Sequence[str] | None = None,
    operational: bool = False,
    channels: Sequence[str] | None = None,
    method: MethodName | None = None,
    wanted: Wanted | None = None,
    resolution_hz: float | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> ModalStudy:
    """Identify, check and explain the modes of a log.

    Parameters
    ----------
    log
        From `chladni.open`; its setup file tells points, directions, units, references and the wireframe. Of a
        universal file without time records the frequency responses are taken that it holds, else its modes.
    references, operational, channels, resolution_hz
        See `identify_modes`.
    method
        By its usual name; None takes pLSCF with an excitation, SSI-cov without.
    wanted
        Which modes to look for.
    span
        Part of the log.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    SetupError
        When the options contradict each other.
    LogError
        When there is no such channel.
    EstimateError
        When there is too little to identify from.
    """
    _require_consistent(references, operational, method)
    averaging, request, part = Averaging(resolution_hz=resolution_hz), wanted or Wanted(), span or Span()
    chosen = None if method is None else METHODS[method]()
    if operational or method in FROM_RESPONSES:
        with _told_of(log.path):
            found = modes_of_responses(
                log,
                channels=channels,
                method=chosen,
                wanted=request,
                averaging=averaging,
                span=part,
                progress=progress,
            )
        return _study(log, channels, found, None)
    if not log.channels and log.functions is None and log.modes is not None:
        told = (
            "the modes are those that the file holds: there are no frequency responses in it to identify others from"
        )
        return _study(log, channels, log.modes, None, notes=(told,))
    with _told_of(log.path):
        response, found = functions_and_modes(
            log,
            references,
            channels,
            method=chosen,
            wanted=request,
            averaging=averaging,
            span=part,
            progress=progress,
        )
    return _study(log, channels, found, response, notes=_checks(response))


def picking_study(
    log: Log,
    *,
    references: Sequence[str] | None,
    operational: bool,
    channels: Sequence[str] | None,
    method: MethodName | None,
    wanted: Wanted,
    resolution_hz: float | None,
    span: Span,
    progress: Progress = no_progress,
) -> ModePicking:
    """Give the picking of the modes that `modal_study` would identify; arguments as there."""
    _require_consistent(references, operational, method)
    with _told_of(log.path):
        return pick_modes_of(
            log,
            references=references,
            responses=channels,
            operational=operational or method in FROM_RESPONSES,
            method=None if method is None else METHODS[method](),
            wanted=wanted,
            averaging=Averaging(resolution_hz=resolution_hz),
            span=span,
            progress=progress,
        )


@contextmanager
def _told_of(path: Path) -> Iterator[None]:
    """Let each `EstimateError` name the file: the estimators know nothing of files."""
    try:
        yield
    except EstimateError as error:
        told = str(error)
        raise EstimateError(told if told.startswith(f"{path.name}: ") else f"{path.name}: {told}") from error


def _checks(response: FrequencyResponse) -> tuple[str, ...]:
    """Say what the functions themselves tell before any fit; nothing where there is nothing to check."""
    driving, reciprocity = check_driving_point(response), check_reciprocity(response)
    found = [driving.finding] if driving.points else []
    return (*found, reciprocity.finding) if reciprocity.pairs else tuple(found)


def _require_consistent(references: Sequence[str] | None, operational: bool, method: MethodName | None) -> None:
    if references and (operational or method in FROM_RESPONSES):
        what = "--operational" if operational else f"method {method}"
        raise SetupError(f"{what} uses responses alone, but {references[0]} is named as excitation; drop one of them")
    if operational and method is not None and method not in FROM_RESPONSES:
        raise SetupError(
            f"method {method} needs an excitation; for responses alone there are {', '.join(FROM_RESPONSES)}"
        )


def _study(
    log: Log,
    channels: Sequence[str] | None,
    modes: ModeSet,
    response: FrequencyResponse | None,
    *,
    notes: tuple[str, ...] = (),
) -> ModalStudy:
    geometry = log.geometry
    validation, motions = validate(modes), relative_motion(modes, geometry)
    told = (*reading_sentences(log, everything=channels is None), *notes)
    study = Study(
        title=log.path.name,
        response=response,
        modes=modes,
        validation=validation,
        relative_motion=motions,
        geometry=geometry,
        findings=tuple(dict.fromkeys([*told, *summarise(modes, validation, motions, geometry=geometry)])),
    )
    passed_on = shape_transmissibility(modes, geometry)
    return ModalStudy(modes=modes, validation=validation, transmissibility=passed_on, study=study)
