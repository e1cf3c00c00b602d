"""A withheld case: what a generator gives, whatever its machines are; folders, seals and scores are made of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.signals.time_series import TimeSeries

Matrix = NDArray[np.float64]
#: What a case asks for. ``effect``: one clear effect. ``none``: nothing is missing, all numbers inside three sigma.
#: ``parameters``: one number a few sigma outside its tolerance. ``two``, ``three``: that many effects. ``faint``: one
#: effect near or under the noise. ``leave_out``: one whose word the catalogue must not hold. ``outside``: one that no
#: word fits. ``topology``: a link that the model lacks. ``value``: one number or several wrong by up to a factor of
#: ten. ``value_and_effect``: wrong numbers and effects together. Of robots: ``all_joints``: friction in every joint.
#: ``ordinary``: friction, a common delay and a heavier link. ``gains``: one effect, and a servo of unknown gains.
#: ``afloat``: friction or a delay in one leg, and nobody holds the base; ``afloat_none``: the same, right.
Kind = Literal[
    "effect", "none", "parameters", "two", "three", "faint", "leave_out", "outside", "topology", "value",
    "value_and_effect", "all_joints", "ordinary", "gains",
    "afloat", "afloat_none",
]  # fmt: skip
#: Kinds of which nothing has to be hidden.
QUIET: tuple[Kind, ...] = ("none", "parameters", "afloat_none")
#: Effect of a wrong number; its site is the number's name, such as ``elbow.stiffness``.
PARAMETER = "parameter"
#: The same for all cases: a log's date tells nothing.
START_TIME_NS = 1_760_000_000_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedChannel:
    """One channel of the log, as it was recorded: behind converters, with its noise.

    Attributes
    ----------
    name
        The channel that the model file names.
    unit
        SI.
    samples
        ``[sample]``, as many as in every other channel.
    drives
        Whether it's an input of the machine, or a reference of its loop.
    """

    name: str
    unit: str
    samples: Matrix
    drives: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenEffect:
    """What the machine has and the model lacks, as the truth tells it.

    Attributes
    ----------
    effect
        Word of the vocabulary, or of what is outside of it, or `PARAMETER`.
    site
        Joint, body, input, output or ``ground``; a pair is ``a~b``, in any order; of `PARAMETER` the number's name.
    law
        Which law was simulated, in the generator's own words.
    parameters
        Of the law, SI; of a wrong number ``nominal`` and ``true``.
    source
        The other output, of ``cross_axis``.
    severity, severity_tuned
        Pooled RMS change of the outputs by this effect alone, over the pooled noise, and what is left of it when the
        model's numbers are tuned inside their tolerances; None when unknown.
    also
        Further words and sites that say the same of this log.
    """

    effect: str
    site: str
    law: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    source: str | None = None
    severity: float | None = None
    severity_tuned: float | None = None
    also: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WithheldCase:
    """A model, a log, and all that is true of them.

    Attributes
    ----------
    kind
        What was asked for.
    model, model_file, beside
        Text of the nominal model's file, its name, and the text of the files that it names.
    sample_rate_hz, channels, start_time_ns
        The log, of channels that share a rate.
    topics
        The log, of messages at rates of their own; in place of channels.
    effects
        What is hidden; empty in a case ``none`` or ``parameters``.
    off
        Numbers that left their tolerance, and by how many sigma.
    parameters
        True numbers, by the names of the model's parameters.
    noise
        Of each output, in the generator's words; None where there is none.
    coloured
        Whether any of it isn't white.
    change, ratio, ratio_tuned
        Pooled RMS change of the outputs by all that is hidden over each output's own RMS; that over the pooled noise;
        what is left of the latter when the model's numbers are tuned inside their tolerances. None when unknown.
    ideal
        Share of the gap that the true law at the true site closes.
    noise_share
        Pooled RMS of the noise over each output's own.
    excitation
        What each input is driven by, in words.
    starts_in_motion
        Whether the machine moved before the log began.
    modes_hz
        Natural frequencies of the nominal machine.
    leave_out
        Words that the catalogue must not hold in the run.
    further
        What else is true, for JSON: under keys of the generator's own.
    """

    kind: Kind
    model: str
    model_file: str = "model.toml"
    beside: Mapping[str, str] = field(default_factory=dict)
    sample_rate_hz: float = 0.0
    channels: tuple[LoggedChannel, ...] = ()
    topics: tuple[TimeSeries, ...] = ()
    start_time_ns: int = START_TIME_NS
    effects: tuple[HiddenEffect, ...] = ()
    off: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, Any] = field(default_factory=dict)
    coloured: bool = False
    change: float | None = None
    ratio: float | None = None
    ratio_tuned: float | None = None
    ideal: float = 1.0
    noise_share: float | None = None
    excitation: tuple[str, ...] = ()
    starts_in_motion: bool = False
    modes_hz: tuple[float, ...] = ()
    leave_out: tuple[str, ...] = ()
    further: Mapping[str, Any] = field(default_factory=dict)


#: ``draw_case(seed, index, kind)``: the same three give the same case, to the byte, in any process; index is from 1.
DrawCase = Callable[[int, int, Kind], WithheldCase]


@dataclass(frozen=True, slots=True, kw_only=True)
class Generator:
    """What draws the cases of a campaign.

    Attributes
    ----------
    composition
        How many cases of each kind a usual campaign has, in proportion; zero of a kind that is drawn when asked for.
    draws
        ``draws(counts, seed)`` gives a function without arguments for each case, that worker processes can call, in
        the order of the campaign; ``counts`` is the number of cases of each kind.
    """

    composition: Mapping[Kind, int]
    draws: Callable[[Mapping[Kind, int], int], Sequence[Callable[[], WithheldCase]]]
