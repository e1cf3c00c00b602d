"""Set-ups of sensors, measured one after another, merged to one set of modes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize
import scipy.special
from numpy.typing import NDArray

from chladni.modal.operational.response_shapes import ResponseShape, largest_one
from chladni.modal.operational.setup_shapes import joined, measured_shape
from chladni.modal.shapes.mac import SharedChannel, shape_mac, shared_channels
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel, find_channel
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.wording import counted

# Modes of two set-ups are one when their frequencies agree within so many sigma, or within this part of the
# frequency, by which sensors that were moved and the weather shift modes, and their shapes agree by this MAC.
SAME_SIGMAS, SAME_SHARE, SAME_MAC = 4.0, 0.02, 0.8
# Values that differ more than once in so many times are said to differ.
DIFFER_CHANCE = 0.01
# Lines of one machine come back within this part of their frequency.
SAME_LINE = 1e-3


def merge_setups(sets: Sequence[ModeSet], *, references: Sequence[str] | None = None) -> ModeSet:
    """Merge the modes of several set-ups through the channels they share (post-separate estimation re-scaling).

    Parameters
    ----------
    sets
        At least two. Channels are the same in two set-ups when they have the same name, or the same point and
        direction (opposite directions count with their sign).
    references
        Names of channels in the first set-up by which the others are scaled; None takes all channels that a set-up
        shares with those before it.

    Returns
    -------
    ModeSet
        Modes that every set-up has, over all channels in order of first appearance. Shapes are scaled by least
        squares on the shared channels (Reynders et al. 2009), with their covariance; frequency and damping ratio are
        means by inverse variance, whose error bars grow, when set-ups differ by more than their own, by the root of
        chi^2/(K - 1). Modes without a partner in each set-up are left out, and a note names them. Participation and
        modal scale are those of the first set-up, when all have the same references.

    Raises
    ------
    EstimateError
        When there are fewer than two sets, a set shares no channel with those before it, units of shared channels
        differ, a reference is missing, or not a single mode is in all of them.

    Examples
    --------
    >>> from chladni.signals.provenance import Provenance
    >>> def setup(*shape: float) -> ModeSet:
    ...     return ModeSet(
    ...         frequency_hz=np.array([2.0]), frequency_std_hz=np.array([0.01]), damping_ratio=np.array([0.01]),
    ...         damping_std=np.array([0.001]), shapes=np.array([shape], complex), provenance=Provenance(),
    ...         shape_std=np.full((1, 2), 0.01 + 0.01j),
    ...         channels=(Channel(name="top"), Channel(name=f"at {shape[1]}")),
    ...     )
    >>> merged = merge_setups([setup(1.0, 0.5), setup(0.25, 1.0)])
    >>> [channel.name for channel in merged.channels], merged.shapes.real.round(3)
    (['top', 'at 0.5', 'at 1.0'], array([[0.25 , 0.125, 1.   ]]))
    """
    _require_sets(sets)
    if references is not None:
        _require_references(sets[0], references)
    channels, modes, notes = list(sets[0].channels), _growing(sets[0]), list[str]()
    for number, one in enumerate(sets[1:], start=2):
        shared, scaling = _shared(channels, one, references, number)
        modes, alone = _paired(modes, sets, one, shared, scaling)
        notes += alone
        notes.append(f"set-up {number} is scaled by {', '.join(one.channels[pair.row_b].name for pair in scaling)}")
        # In the order in which `joined` adds them to the shapes.
        known = {pair.row_b for pair in shared}
        channels += [channel for row, channel in enumerate(one.channels) if row not in known]
    return _mode_set(sets, channels, modes, notes)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _GrowingMode:
    """A mode that all set-ups so far have: its rows in them, and its shape over all their channels."""

    rows: tuple[int, ...]
    shape: ResponseShape


@dataclass(frozen=True, slots=True, kw_only=True)
class _Mean:
    """A mean of several set-ups' values with one sigma, and the chance that they differ as much by scatter."""

    value: float
    std: float
    chance: float


def _require_sets(sets: Sequence[ModeSet]) -> None:
    if len(sets) < 2:
        raise EstimateError(
            f"{counted(len(sets), 'set')} of modes can't be merged; give those of two set-ups or more"
        )
    for number, one in enumerate(sets, start=1):
        if one.frequency_hz.size == 0:
            raise EstimateError(f"set-up {number} has no modes; leave it out, or look at its notes for the reason")


def _require_references(first: ModeSet, references: Sequence[str]) -> None:
    if not references:
        raise EstimateError("references is empty; name a channel that all set-ups share, or leave it out")
    for name in references:
        find_channel(first.channels, name, role="reference channel")


def _growing(one: ModeSet) -> list[_GrowingMode]:
    return [
        _GrowingMode(rows=(row,), shape=measured_shape(one.shapes[row], one.shape_std[row]))
        for row in range(one.frequency_hz.size)
    ]


def _shared(
    channels: Sequence[Channel], one: ModeSet, references: Sequence[str] | None, number: int
) -> tuple[tuple[SharedChannel, ...], tuple[SharedChannel, ...]]:
    """Channels of a set-up that were there before, and those of them that it is scaled by."""
    try:
        shared = shared_channels(channels, one.channels)
    except EstimateError as error:
        raise EstimateError(f"set-up {number} can't be merged with those before it: {error}") from error
    # A shape in m/s^2 can't be scaled by one in g, and nothing in the numbers would show it.
    for pair in shared:
        mine, theirs = channels[pair.row_a], one.channels[pair.row_b]
        if mine.unit != theirs.unit:
            raise EstimateError(
                f"channel {mine.name!r} is in {mine.unit}, but as {theirs.name!r} of set-up {number} in {theirs.unit}"
                "; bring both to one unit before they are merged"
            )
    if references is None:
        return shared, shared
    scaling = {channels[pair.row_a].name: pair for pair in shared if channels[pair.row_a].name in references}
    missing = [name for name in references if name not in scaling]
    if missing:
        raise EstimateError(
            f"set-up {number} has no reference channel {missing[0]!r}; it shares "
            f"{', '.join(channels[pair.row_a].name for pair in shared)} with those before it"
        )
    return shared, tuple(scaling.values())


def _paired(
    modes: Sequence[_GrowingMode],
    sets: Sequence[ModeSet],
    one: ModeSet,
    shared: tuple[SharedChannel, ...],
    scaling: tuple[SharedChannel, ...],
) -> tuple[list[_GrowingMode], list[str]]:
    """Give each mode its partner in another set-up, and tell those that have none."""
    number = len(modes[0].rows) + 1
    # Against the shapes as they have grown: set-ups in a row need not share anything with the first.
    partners = _partners(modes, sets, one, scaling)
    grown = []
    for row, mode in enumerate(modes):
        if row in partners:
            shape = measured_shape(one.shapes[partners[row]], one.shape_std[partners[row]])
            joint = joined(mode.shape, shape, shared, scaling)
            grown.append(_GrowingMode(rows=(*mode.rows, partners[row]), shape=joint))
    mine, theirs = _frequencies(modes, sets), one.frequency_hz
    if not grown:
        raise EstimateError(
            f"no mode of set-up {number} ({_listed(theirs)}) is one of those before it ({_listed(mine)}): "
            f"frequencies must agree within {100 * SAME_SHARE:g} %, and shapes over the shared "
            f"channels by a MAC of {SAME_MAC:g}"
        )
    alone = [
        *(
            f"the mode at {mine[row]:.4g} Hz is left out: set-up {number} has none like it"
            for row in range(mine.size)
            if row not in partners
        ),
        *(
            f"the mode at {theirs[row]:.4g} Hz of set-up {number} is left out: set-ups before it have none like it"
            for row in range(theirs.size)
            if row not in partners.values()
        ),
    ]
    return grown, alone


def _partners(
    modes: Sequence[_GrowingMode], sets: Sequence[ModeSet], one: ModeSet, scaling: tuple[SharedChannel, ...]
) -> dict[int, int]:
    """Pairs of modes that agree in frequency and shape, each at most once, so that shapes agree best altogether."""
    signs = np.array([pair.sign for pair in scaling])
    mine = np.array([mode.shape.vector[[pair.row_a for pair in scaling]] for mode in modes])
    theirs = signs * one.shapes[:, [pair.row_b for pair in scaling]]
    agreement = _mac_or_zero(mine, theirs)
    frequency_hz, std_hz = _frequencies(modes, sets), _latest_std(modes, sets)
    apart = np.abs(frequency_hz[:, None] - one.frequency_hz)
    within = SAME_SIGMAS * np.hypot(std_hz[:, None], one.frequency_std_hz)
    within = np.maximum(within, SAME_SHARE * frequency_hz[:, None])
    fits = (apart <= within) & (agreement >= SAME_MAC)
    # The shape decides; where shapes are equally alike, as over a single channel all are, the nearer frequency does.
    gain = np.where(fits, agreement - 0.5 * apart / within, -1.0)
    rows, columns = scipy.optimize.linear_sum_assignment(-gain)
    return {int(row): int(column) for row, column in zip(rows, columns, strict=True) if fits[row, column]}


def _mac_or_zero(mine: NDArray[np.complexfloating], theirs: NDArray[np.complexfloating]) -> Real:
    """MAC of shapes that may not move at all at these channels, and then are like no other."""
    agreement = np.zeros((len(mine), len(theirs)))
    moving, moving_too = np.any(mine != 0, axis=1), np.any(theirs != 0, axis=1)
    # MAC refuses shapes of zeros, which a sensor in a node gives.
    if np.any(moving) and np.any(moving_too):
        agreement[np.ix_(moving, moving_too)] = shape_mac(mine[moving], theirs[moving_too])
    return agreement


def _frequencies(modes: Sequence[_GrowingMode], sets: Sequence[ModeSet]) -> Real:
    return np.array([sets[len(mode.rows) - 1].frequency_hz[mode.rows[-1]] for mode in modes])


def _latest_std(modes: Sequence[_GrowingMode], sets: Sequence[ModeSet]) -> Real:
    return np.array([sets[len(mode.rows) - 1].frequency_std_hz[mode.rows[-1]] for mode in modes])


def _listed(frequency_hz: Real) -> str:
    return ", ".join(f"{value:.4g}" for value in frequency_hz) + " Hz"


def _mean(values: Real, std: Real) -> _Mean:
    """Mean by inverse variance; its error grows by the root of chi^2/(K - 1) where that is above 1 (Birge 1932)."""
    if np.any(std <= 0) or not np.all(np.isfinite(std)):
        # Error bars that aren't there can't weigh: what is left is the scatter between set-ups.
        return _Mean(value=float(values.mean()), std=float(values.std(ddof=1) / np.sqrt(values.size)), chance=1.0)
    weight = 1 / std**2
    value = float(weight @ values / weight.sum())
    chi2, freedom = float(weight @ (values - value) ** 2), values.size - 1
    std_of_mean = float(np.sqrt(max(1.0, chi2 / freedom) / weight.sum()))
    return _Mean(value=value, std=std_of_mean, chance=float(scipy.special.chdtrc(freedom, chi2)))


def _mode_set(
    sets: Sequence[ModeSet], channels: Sequence[Channel], modes: Sequence[_GrowingMode], notes: Sequence[str]
) -> ModeSet:
    frequencies = [_over_sets(mode, sets, "frequency_hz", "frequency_std_hz") for mode in modes]
    order = np.argsort([mean.value for mean in frequencies], kind="stable")
    modes, frequencies = [modes[row] for row in order], [frequencies[row] for row in order]
    dampings = [_over_sets(mode, sets, "damping_ratio", "damping_std") for mode in modes]
    shapes = [_unit_shape(mode.shape) for mode in modes]
    # What the shape of the first set-up was divided by: participation is multiplied by it.
    divisors = np.array([mode.shape.vector[np.argmax(np.abs(mode.shape.vector))] for mode in modes])
    rows = np.array([mode.rows[0] for mode in modes])
    first, told = _with_common_references(sets)
    everything = [note for one in sets for note in one.provenance.notes]
    return ModeSet(
        frequency_hz=np.array([mean.value for mean in frequencies]),
        frequency_std_hz=np.array([mean.std for mean in frequencies]),
        damping_ratio=np.array([mean.value for mean in dampings]),
        damping_std=np.array([mean.std for mean in dampings]),
        shapes=np.array([shape for shape, _ in shapes]),
        shape_std=np.array([std for _, std in shapes]),
        channels=tuple(channels),
        references=first.references,
        participation=None if first.participation is None else first.participation[rows] * divisors[:, None],
        scale=_scale(first, rows, divisors),
        harmonics=_harmonics(sets),
        provenance=first.provenance.with_notes(*everything, *notes, *told, *_differing(frequencies, dampings)),
    )


def _over_sets(mode: _GrowingMode, sets: Sequence[ModeSet], name: str, std_name: str) -> _Mean:
    pairs = list(zip(sets, mode.rows, strict=True))
    values = np.array([getattr(one, name)[row] for one, row in pairs])
    return _mean(values, np.array([getattr(one, std_name)[row] for one, row in pairs]))


def _unit_shape(shape: ResponseShape) -> tuple[NDArray[np.complexfloating], NDArray[np.complexfloating]]:
    return largest_one(shape, np.ones(shape.vector.size))


def _differing(frequencies: Sequence[_Mean], dampings: Sequence[_Mean]) -> list[str]:
    notes = []
    for frequency, damping in zip(frequencies, dampings, strict=True):
        for what, mean in (("natural frequency", frequency), ("damping ratio", damping)):
            if mean.chance < DIFFER_CHANCE:
                notes.append(
                    f"the {what} of the mode at {frequency.value:.4g} Hz differs between set-ups by more than its "
                    "error bars, which moved sensors or the weather do; the error bar of the mean is widened"
                )
    return notes


def _with_common_references(sets: Sequence[ModeSet]) -> tuple[ModeSet, tuple[str, ...]]:
    """First set-up, without what its references gave when others had other ones."""
    names = [tuple(channel.name for channel in one.references) for one in sets]
    if len(set(names)) == 1:
        return sets[0], ()
    # Each set-up's participation belongs to its own excitation, and one residue needs both sides from one.
    bare = replace(sets[0], references=(), participation=None, scale=None, fit=None)
    return bare, ("set-ups have different references: participation and modal scale are left out",)


def _scale(first: ModeSet, rows: Whole, divisors: NDArray[np.complexfloating]) -> ModalScale | None:
    if first.scale is None:
        return None
    # A shape divided by s has its participation multiplied by s: modal A falls by s^2.
    modal_a = first.scale.modal_a[rows] / divisors**2
    damped = first.poles[rows].imag
    return replace(
        first.scale,
        modal_a=modal_a,
        modal_mass=np.real(modal_a / (2j * damped)),
        modal_mass_std=first.scale.modal_mass_std[rows] / np.abs(divisors) ** 2,
    )


def _harmonics(sets: Sequence[ModeSet]) -> tuple[MachineHarmonic, ...]:
    """Every line once, by rising frequency."""
    found: list[MachineHarmonic] = []
    for harmonic in sorted((line for one in sets for line in one.harmonics), key=lambda line: line.frequency_hz):
        if not found or harmonic.frequency_hz - found[-1].frequency_hz > SAME_LINE * harmonic.frequency_hz:
            found.append(harmonic)
    return tuple(found)
