"""What a diagnosis says: verdict, causes, where the gap lies, how far it closes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.gap.calibration import COVERAGE
from chladni.gap.records.measurement import LogUse
from chladni.gap.records.robot import JointMotion, TorqueMap
from chladni.robots.machine import Machine
from chladni.signals.arrays import Real
from chladni.signals.outlets import outlet
from chladni.signals.value import Drawn, Value, require_shape

Verdict = Literal["none", "parameters", "effect", "unknown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedNumber:
    """A fitted value with its standard deviation, SI; `std` is None when the log doesn't determine it."""

    value: float
    std: float | None
    unit: str
    nominal: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correlation(Value):
    """``matrix [parameter, parameter]``, -1 to 1, of the errors of fitted parameters.

    Near 1 or -1 the log tells a ratio or a product of two alone, however uncertain either is.
    """

    names: tuple[str, ...]
    matrix: Real

    def __post_init__(self) -> None:
        require_shape("matrix", self.matrix, (len(self.names), len(self.names)), "the parameters")
        self._freeze()


#: In place of an effect's word: a value of the model's that is wrong.
PARAMETER = "parameter"


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """An effect at a site.

    Attributes
    ----------
    effect, site
        The word and the name; ``parameter`` with a name like ``elbow.stiffness`` for a wrong value. In an answer set
        also ``unknown`` with the place that explains most, and ``none`` with an empty site.
    """

    effect: str
    site: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """A named cause of the gap.

    Attributes
    ----------
    effect, site, probability
        What, where, and how sure.
    group
        Sites that these sensors can't tell from `site`, itself included.
    alternatives
        Other candidates that this log can't tell from this one.
    probability_of
        Words of its family, `effect` first, whose `probability` together it is; empty where it's that of `effect`.
    parameters
        By name.
    variant, source
        Form of the law, and the output that it listens to, as `chladni.attached` takes them.
    share
        Share of the gap's power that this cause explains, 0 to 1: of what the best parameters alone leave beyond the
        noise on held-out samples. Beside other causes what comes back without it; None when no fit tells.
    """

    effect: str
    site: str
    probability: float
    group: tuple[str, ...]
    alternatives: tuple[Candidate, ...]
    parameters: Mapping[str, FittedNumber]
    variant: str | None = None
    source: str | None = None
    share: float | None = None
    probability_of: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ranked:
    """A row of the ranking; `gap` and `log_evidence` (nats) on held-out samples, None when it wasn't fitted.

    Both are of its best form, with those that it stood `beside` there; the evidence at the noise that is believed.
    """

    effect: str
    site: str
    probability: float
    gap: float | None
    log_evidence: float | None
    beside: tuple[Candidate, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelGap:
    """Gap of the nominal model and noise of one output, both over the RMS of what was measured.

    `noise_from` says where the noise was estimated from, see `NoiseFloor.method`; `noise_at_most` that distortion may
    be in it, so that the true noise is less.
    """

    name: str
    gap: float
    noise: float
    noise_from: str = ""
    noise_at_most: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BandShare:
    """Share of the gap's power (outputs scaled by their RMS) between two frequencies.

    `noise` is how much of the gap in this band noise can be, 0 to 1.
    """

    low_hz: float
    high_hz: float
    share: float
    noise: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeShare:
    """Share of the gap's power (outputs scaled by their RMS) between two times, seconds from the first sample."""

    start_s: float
    end_s: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteShare:
    """Share of the gap beyond noise that an unknown force (error, change of input) at this site explains.

    `group` are the other sites at which it would print the same pattern on these sensors, so that they share it.
    """

    name: str
    share: float
    group: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PairShare:
    """Share of the gap beyond noise that unknown forces at two sites together explain.

    `groups` are the sites, each with those at which a force would print the same pattern on these sensors.
    """

    groups: tuple[tuple[str, ...], tuple[str, ...]]
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RegimeShare:
    """Share of the gap's power while a variable, such as ``elbow.velocity``, lies between two values.

    Values are SI; `unit` is empty where it isn't known. `time` is the share of the record that the variable spends
    there, with which `share` is compared.
    """

    variable: str
    low: float
    high: float
    share: float
    unit: str = ""
    time: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Where:
    """Where the gap lies, and when.

    `pair` is the best pair of sites, where two unknown forces explain much more than one anywhere, as far as pairs
    were looked for: they are only where one cause leaves something.
    """

    channels: tuple[ChannelGap, ...]
    bands: tuple[BandShare, ...]
    sites: tuple[SiteShare, ...]
    regimes: tuple[RegimeShare, ...]
    times: tuple[TimeShare, ...] = ()
    pair: PairShare | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """A stretch of a log that no fit saw, seconds from its start."""

    log: str
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Closing:
    """How far the gap closes, on held-out samples; all outputs pooled after scaling each by its own RMS.

    Attributes
    ----------
    before, tuned, after, noise
        RMS of (measured - simulated) over RMS of measured: nominal model; best parameters; parameters and effects;
        the floor.
    closed
        (before - after)/(before - noise), clipped to 0..1; None when before - noise is within its own uncertainty.
    interval
        95 % interval of `closed`, by block bootstrap.
    held_out
        The samples.
    by
        ``free_run``, ``windows`` (each from an estimated state, see `horizon_s`), ``cross_sensor``, or ``torque``
        that the motion of a robot's joints needs.
    horizon_s
        Length of a window, None in free run.
    explained
        (tuned^2 - after^2)/(tuned^2 - noise^2), clipped to 0..1: share of the power that the best parameters leave;
        None when nothing was added to them or tuned - noise is within its own uncertainty.
    noise_at_most
        Whether distortion may be in `noise`, so that the true one is less.
    """

    before: float
    tuned: float
    after: float
    noise: float
    closed: float | None
    interval: tuple[float, float] | None
    held_out: tuple[HeldOut, ...]
    by: Literal["free_run", "windows", "cross_sensor", "torque"] = "free_run"
    horizon_s: float | None = None
    explained: float | None = None
    noise_at_most: bool = False

    @property
    def after_over_noise(self) -> float | None:
        """RMS that the answer leaves over the noise's; None without noise. Well above 1 something is missing."""
        return self.after / self.noise if self.noise > 0 else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestoringForce(Value):
    """The force that the model lacks at a joint (body, input), recovered from all sensors without assuming a law.

    Attributes
    ----------
    site
        Where.
    time_s, displacement, velocity, force
        ``[sample]``, SI.
    law_force
        ``[sample]`` what the named effect gives for the same motion, None without one.
    """

    site: str
    time_s: Real
    displacement: Real
    velocity: Real
    force: Real
    law_force: Real | None = None
    force_unit: str = "N"
    displacement_unit: str = "m"

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GapSignals(Value):
    """Signals behind a diagnosis, for pictures.

    Attributes
    ----------
    log, sample_rate_hz, output_names, output_units
        Which log, and what its rows are.
    measured, before, after
        ``[output, sample]``: measured; nominal model; parameters and effects (or tuned, where none is named).
    noise_rms, noise_density
        ``[output]``, and its spread ``[output, line]`` over evenly spaced lines from 0 to half the sample rate, both
        included, in the output's unit^2/Hz.
    map_time_s, map_frequency_hz, gap_map
        ``[time]``, ``[frequency]``, ``[time, frequency]``: density of the nominal gap, outputs scaled by RMS, 1/Hz.
    gap_map_after
        The same after.
    window_starts
        Samples at which windows begin, each from an estimated state: simulations jump there. Empty in free run. Of a
        robot, stretches without a gap.
    time_s
        ``[sample]`` from the log's start; None where the first sample is second 0 and none is left out.
    """

    log: str
    sample_rate_hz: float
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]
    measured: Real
    before: Real
    after: Real
    noise_rms: Real
    noise_density: Real
    map_time_s: Real
    map_frequency_hz: Real
    gap_map: Real
    gap_map_after: Real
    window_starts: tuple[int, ...] = ()
    time_s: Real | None = None

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def seconds(self) -> Real:
        """``[sample]`` from the log's start."""
        return np.arange(self.measured.shape[1]) / self.sample_rate_hz if self.time_s is None else self.time_s

    @property
    def span_s(self) -> tuple[float, float]:
        """Time of the first sample, and the end of the last."""
        seconds = self.seconds
        return float(seconds[0]), float(seconds[-1]) + 1.0 / self.sample_rate_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class DistortionShare:
    """Split of one output's power at the excited and detection lines of a periodic input, shares of the whole.

    `nonlinear` is even and odd distortion together. Each of those is None when even lines are excited too, since both
    fall on the same lines then.
    """

    output: str
    linear: float
    even: float | None
    odd: float | None
    noise: float
    nonlinear: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AnyLaw:
    """What a force at one place explains, by any law of what moves there.

    Shares are of the power that the best parameters leave beyond noise, 0 to 1.

    Attributes
    ----------
    site, group
        A joint or an input, and the other sites that these sensors can't tell from it.
    force
        Share that an unknown force there explains.
    law
        Share that one explains that is a function of displacement and velocity there, or the displacement times a
        tone; at an input a function or a filter of the command.
    named
        Share that the named cause explains, None where nothing is named.
    """

    site: str
    group: tuple[str, ...]
    force: float
    law: float
    named: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis(Drawn):
    """Result of `chladni.diagnose_gap`.

    Attributes
    ----------
    model, logs
        Names.
    verdict, causes
        What is said, see docs.
    ranking
        Candidates by falling probability.
    where, gap
        Where the gap lies; how far it closes.
    tuned_parameters
        By name; `std` None for those that this log can't determine: only their tolerance keeps them near nominal, and
        they may have moved inside it with others that they depend on. With them, and no other values, the causes'
        parameters leave what `gap` says.
    next_measurement
        A sentence, or None.
    naive
        What the largest drop in RMS alone would have named, or None.
    remarks
        Sentences on what limits the answer: short log, few sensors, parameters not determined, horizon, damage.
    advice
        One sentence for the summary of a verdict ``unknown`` or ``none``.
    restoring_forces, signals
        Evidence for pictures; None when there is none.
    distortion
        With a periodic input, output by output.
    levels
        With several logs: sentences on what changes with level.
    elsewhere
        With several logs: how far what the first one told closes the gap on the others, which no fit saw.
    used
        How much of each log was used, and what was lost of it.
    left
        With the verdict ``unknown``: where what the best parameters leave lies, which is what isn't explained.
    correlation
        Of the tuned parameters' errors; None where nothing was tuned.
    any_law
        Where something is left: what a law of the motion at one place would explain, whatever its name.
    machine
        Of a robot: its description with what was found, to be simulated or written; None of a model.
    motion, torque_maps
        Of a robot: its joints' positions, measured and simulated; their torques over speed and position.
    answer_set, coverage
        Effects and sites that together hold the truth with this probability; empty where nothing was weighed.
    """

    model: str
    logs: tuple[str, ...]
    verdict: Verdict
    causes: tuple[Cause, ...]
    ranking: tuple[Ranked, ...]
    where: Where
    gap: Closing
    tuned_parameters: Mapping[str, FittedNumber]
    next_measurement: str | None = None
    naive: Candidate | None = None
    remarks: tuple[str, ...] = ()
    advice: str | None = None
    restoring_forces: tuple[RestoringForce, ...] = ()
    signals: GapSignals | None = None
    distortion: tuple[DistortionShare, ...] = ()
    levels: tuple[str, ...] = ()
    elsewhere: tuple[Closing, ...] = ()
    used: tuple[LogUse, ...] = ()
    left: Where | None = None
    correlation: Correlation | None = None
    any_law: AnyLaw | None = None
    machine: Machine | None = None
    motion: JointMotion | None = None
    torque_maps: tuple[TorqueMap, ...] = ()
    answer_set: tuple[Candidate, ...] = ()
    coverage: float = COVERAGE

    def summary(self) -> tuple[str, ...]:
        """Say what was found, in sentences: the answer first, then how far it goes, and what limits it."""
        sentences: tuple[str, ...] = outlet("summary")(self)
        return sentences

    @property
    def restoring_force(self) -> RestoringForce | None:
        """The force at the first named site, else at the best place; None where none was recovered."""
        return self.restoring_forces[0] if self.restoring_forces else None
