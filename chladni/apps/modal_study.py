"""The modal analyst's job: a log to validated modes and everything that can be said and shown of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from chladni.apps.modes import Method, Wanted, modal_response, modes_of_response, modes_of_responses
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.modal.circle_fit import CircleFit
from chladni.modal.driving_point import check_driving_point
from chladni.modal.efdd import EnhancedFrequencyDomainDecomposition
from chladni.modal.fdd import FrequencyDomainDecomposition
from chladni.modal.half_power import HalfPower
from chladni.modal.polyreference import PolyReferenceLeastSquares
from chladni.modal.reciprocity import check_reciprocity
from chladni.modal.relative_motion import relative_motion
from chladni.modal.subspace import CovarianceDrivenSubspace
from chladni.modal.summary import summarise
from chladni.modal.validation import validate
from chladni.signals.errors import SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
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
    """Modes of a log with their checks, and the study that viewers draw."""

    modes: ModeSet
    validation: ModeValidation
    study: Study


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
        From `open_log`; its setup file tells points, directions, units, references and the wireframe.
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
        found = modes_of_responses(
            log, channels=channels, method=chosen, wanted=request, averaging=averaging, span=part, progress=progress
        )
        return _study(log, found, None, ())
    response = modal_response(log, references, channels, averaging=averaging, span=part, progress=progress)
    return _study(log, modes_of_response(response, method=chosen, wanted=request), response, _checks(response))


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


def _study(log: Log, modes: ModeSet, response: FrequencyResponse | None, checks: tuple[str, ...]) -> ModalStudy:
    validation = validate(modes)
    motions = relative_motion(modes, log.geometry)
    study = Study(
        title=log.path.name,
        response=response,
        modes=modes,
        validation=validation,
        relative_motion=motions,
        geometry=log.geometry,
        findings=tuple(dict.fromkeys([*checks, *summarise(modes, validation, motions, geometry=log.geometry)])),
    )
    return ModalStudy(modes=modes, validation=validation, study=study)
