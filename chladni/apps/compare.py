"""Two logs, before and after: what changed that scatter doesn't explain."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.apps.excitation import excitations
from chladni.apps.frf import transfer
from chladni.apps.modes import identify_modes
from chladni.apps.psd import densities
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.modal.shapes.mode_comparison import compare_modes
from chladni.modal.shapes.validation import validate
from chladni.signals.comparison import DensityComparison, LevelChange, PeakChange, ResponseComparison
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_change import ModeChange
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.study import Study
from chladni.signals.unit_text import with_unit
from chladni.signals.wording import with_sigma
from chladni.spectral.comparison import compare_densities, compare_responses
from chladni.viewers.style import Style

# As many changes as one reads; tables and documents hold all.
MOST_TOLD = 25
Densities = tuple[PowerSpectralDensity, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogComparison:
    """What changed between two logs.

    Attributes
    ----------
    densities
        Levels, spectra and peaks, one value for each sampling grid that both have.
    response
        Transfer functions to the references that both have; None when there is none.
    modes
        What became of each mode; None when modes were not asked for.
    notes
        What could not be compared, and why.
    before, after
        The spectra and transfer functions that were compared.
    """

    densities: tuple[DensityComparison, ...]
    response: ResponseComparison | None
    notes: tuple[str, ...]
    before: Study
    after: Study
    modes: tuple[ModeChange, ...] | None = None

    def sentences(self) -> tuple[str, ...]:
        """Say which levels and peaks changed by more than scatter explains, those of levels first, then notes."""
        levels = [one for density in self.densities for one in density.overall if one.significant]
        peaks = [one for density in self.densities for one in density.peaks if one.fate != "unchanged"]
        if self.response is not None:
            peaks += [one for one in self.response.peaks if one.fate != "unchanged"]
        # As the pictures name them; the document has the names in full.
        labels = Style.of(self.after).labels | Style.of(self.before).labels
        told = [*(_level_sentence(one, labels) for one in levels), *(_peak_sentence(one, labels) for one in peaks)]
        more = [f"{len(told) - MOST_TOLD} more changes; all are in the document of --json."] * (len(told) > MOST_TOLD)
        return (*(told[:MOST_TOLD] or ["Nothing changed that scatter doesn't explain."]), *more, *self.notes)


def _level_sentence(one: LevelChange, labels: Mapping[str, str]) -> str:
    change = with_sigma(one.change_db, one.change_std_db)
    levels = f"{one.before:.4g} to {with_unit(f'{one.after:.4g}', one.unit)}"
    return f"The level of {labels[one.channel]} changed by {change} dB, from {levels} RMS."


def _peak_sentence(one: PeakChange, labels: Mapping[str, str]) -> str:
    peak = one.before or one.after
    where = "" if peak is None else f" at {peak.frequency_hz:.5g} Hz"
    shift = f" by {with_sigma(one.shift_hz, one.shift_std_hz)} Hz" if one.fate == "moved" else ""
    return f"The peak{where} of {' over '.join(labels[name] for name in one.channels)} {one.fate}{shift}."


def compare_logs(
    before: Log,
    after: Log,
    *,
    channels: Sequence[str] | None = None,
    references: Sequence[str] | None = None,
    resolution_hz: float | None = None,
    modes: bool = False,
    operational: bool = False,
    progress: Progress = no_progress,
) -> LogComparison:
    """Compare the spectra, transfer functions and modes of two logs.

    Parameters
    ----------
    before, after
        From `chladni.open`; channels are matched by name.
    channels
        Message paths; None for all that both have and that change at all.
    references
        Excitations; None takes the channels whose role is reference, else the first force.
    resolution_hz
        Distance of the spectral lines; None chooses the coarser of what would suit each log.
    modes
        Whether to identify the modes of both, too.
    operational
        Whether to identify them from responses alone, see `identify_modes`.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When the logs share no channel at the same sample rate, or modes are asked for and can't be identified.
    """
    ready_made = all(not log.channels and log.functions is not None for log in (before, after))
    if not ready_made:
        # Channels are matched by name: what a word names in the one log has that name in the other.
        channels, references = (words and before.names(words) for words in (channels, references))
    pairs = [] if ready_made else _matched_densities(before, after, channels, resolution_hz)
    progress(0.5)
    compared = tuple(compare_densities(old, new) for old, new in pairs)
    moving = [channel for comparison in compared for channel in comparison.channels]
    chosen = references or (None if ready_made else excitations(moving))
    transferred = _responses(before, after, channels, chosen, resolution_hz)
    progress(0.7)
    changes: tuple[ModeChange, ...] | None = None
    doubts: tuple[str, ...] = ()
    if modes or operational:
        changes, doubts = _modes(before, after, chosen, channels, resolution_hz, operational)
    progress(1.0)
    accounts = [(one.provenance, other.provenance) for one, other in pairs]
    return LogComparison(
        densities=compared,
        response=transferred.comparison,
        modes=changes,
        notes=(*_told([*accounts, *transferred.accounts]), *transferred.reasons, *doubts),
        before=_study(before, [old for old, _ in pairs], transferred.responses[:1]),
        after=_study(after, [new for _, new in pairs], transferred.responses[1:]),
    )


def _study(log: Log, spectra: Sequence[PowerSpectralDensity], responses: Sequence[FrequencyResponse]) -> Study:
    return Study(title=log.path.name, densities=tuple(spectra), response=next(iter(responses), None))


def _modes(
    before: Log,
    after: Log,
    references: Sequence[str] | None,
    channels: Sequence[str] | None,
    resolution_hz: float | None,
    operational: bool,
) -> tuple[tuple[ModeChange, ...], tuple[str, ...]]:
    named = None if channels is None else [name for name in channels if name not in (references or ())]
    old, new = (
        identify_modes(
            log,
            references=None if operational else references or None,
            operational=operational,
            responses=named or None,
            resolution_hz=None if operational else resolution_hz,
        )
        for log in (before, after)
    )
    alike = [validate(one).alike for one in (old, new)]
    doubts = (
        "these sensors can't tell all shapes apart: modes are paired by their frequencies more than by their shapes",
    )
    return compare_modes(old, new), doubts if any(alike) else ()


def _told(accounts: Sequence[tuple[Provenance, Provenance]]) -> tuple[str, ...]:
    """Give each note once; what holds for one log only says for which."""
    old = dict.fromkeys(note for before, _ in accounts for note in before.notes)
    new = dict.fromkeys(note for _, after in accounts for note in after.notes)
    return (
        *(note for note in old if note in new),
        *(f"before: {note}" for note in old if note not in new),
        *(f"after: {note}" for note in new if note not in old),
    )


def _reaches(densities: Sequence[PowerSpectralDensity]) -> str:
    """Name channels, and how far their spectra reach, which tells their rates apart."""
    told = [
        f"{some_of([channel.name for channel in one.channels])} up to {one.frequency_hz[-1]:.6g} Hz"
        for one in densities
    ]
    return "; ".join(told)


def _matched_densities(
    before: Log, after: Log, channels: Sequence[str] | None, resolution_hz: float | None
) -> list[tuple[PowerSpectralDensity, PowerSpectralDensity]]:
    old, new = _averaged(before, channels, resolution_hz), _averaged(after, channels, resolution_hz)
    pairs = [(one, other) for one in old for other in new if _share_rate(one, other)]
    if not pairs:
        raise EstimateError(
            f"{before.path.name} and {after.path.name} share no channel at the same sample rate; nothing to compare. "
            f"One has {_reaches(old)}, the other {_reaches(new)}"
        )
    return [_on_one_axis(before, after, one, other) for one, other in pairs]


def _averaged(log: Log, channels: Sequence[str] | None, resolution_hz: float | None) -> Densities:
    return densities(log, channels=channels, averaging=Averaging(resolution_hz=resolution_hz))


def _share_rate(one: PowerSpectralDensity, other: PowerSpectralDensity) -> bool:
    names = {channel.name for channel in other.channels}
    common = any(channel.name in names for channel in one.channels)
    return common and bool(np.isclose(_rate_hz(one), _rate_hz(other), rtol=1e-4))


def _rate_hz(density: PowerSpectralDensity) -> float:
    # Half the rate is the last line, or half a line above it when the segment is odd.
    return 2 * float(density.frequency_hz[-1])


def _on_one_axis(
    before: Log, after: Log, old: PowerSpectralDensity, new: PowerSpectralDensity
) -> tuple[PowerSpectralDensity, PowerSpectralDensity]:
    """Average again with the coarser lines where each log alone would have got its own."""
    if old.frequency_hz.shape == new.frequency_hz.shape:
        return old, new
    spacing_hz = max(float(one.frequency_hz[1] - one.frequency_hz[0]) for one in (old, new))
    names = {channel.name for channel in new.channels}
    common = [channel.name for channel in old.channels if channel.name in names]
    return (_averaged(before, common, spacing_hz)[0], _averaged(after, common, spacing_hz)[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Transferred:
    """Transfer functions compared, how both were made, and why there are none."""

    comparison: ResponseComparison | None = None
    accounts: tuple[tuple[Provenance, Provenance], ...] = ()
    responses: tuple[FrequencyResponse, ...] = ()
    reasons: tuple[str, ...] = ()


def _responses(
    before: Log,
    after: Log,
    channels: Sequence[str] | None,
    references: Sequence[str] | None,
    resolution_hz: float | None,
) -> _Transferred:
    """Compare transfer functions; to `references`, or, for None, those that both files hold ready-made."""
    responses = None if channels is None else [name for name in channels if name not in (references or ())]
    if (references is not None and not references) or responses == []:
        return _Transferred()
    averaging = Averaging(resolution_hz=resolution_hz)
    try:
        old, new = (
            transfer(log, references, responses, estimator="H1", averaging=averaging, span=Span())
            for log in (before, after)
        )
        accounts = ((old.provenance, new.provenance),)
        return _Transferred(comparison=compare_responses(old, new), accounts=accounts, responses=(old, new))
    except EstimateError as error:
        to = f" to {', '.join(references)}" if references else ""
        return _Transferred(reasons=(f"transfer functions{to} were not compared: {error}",))
