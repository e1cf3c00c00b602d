"""A diagnosis with what its pictures need beside it: spectra of what is left, and the stretch that tells most."""

from dataclasses import dataclass

from chladni.gap.records.diagnosis import Diagnosis, DistortionShare, GapSignals, Where
from chladni.signals.arrays import Real
from chladni.signals.value import Value, require_shape
from chladni.viewers.style import ON_DARK, ON_LIGHT, Colour

# The same in every picture: what was measured, the error of the nominal model, the error with what was found.
MEASURED_ON_LIGHT: Colour = (120, 120, 120)
MEASURED_ON_DARK: Colour = (190, 190, 190)
BEFORE_ON_LIGHT, AFTER_ON_LIGHT = ON_LIGHT[1], ON_LIGHT[0]
BEFORE_ON_DARK, AFTER_ON_DARK = ON_DARK[1], ON_DARK[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GapSpectra(Value):
    """Power spectral densities of what was measured and of the errors, in each output's unit^2/Hz.

    Attributes
    ----------
    frequency_hz
        ``[line]``.
    measured, before, after
        ``[output, line]``: the signal, the error of the nominal model, the error with what was found. Of simulations
        over windows all three are averages over those, since jumps between them are no errors of the model.
    noise
        ``[output, line]``: the estimated noise.
    """

    frequency_hz: Real
    measured: Real
    before: Real
    after: Real
    noise: Real

    def __post_init__(self) -> None:
        # Outputs in another order would be drawn against the wrong noise.
        shape = (len(self.noise), self.frequency_hz.size)
        for name in ("measured", "before", "after", "noise"):
            require_shape(name, getattr(self, name), shape, "outputs and lines")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True)
class GapEvidence:
    """What pictures of a diagnosis are drawn from.

    Attributes
    ----------
    found
        The diagnosis.
    spectra
        None when the diagnosis holds no signals, or too few samples for a spectrum.
    telling_s
        Start and end of the stretch in which the nominal model errs most, a few cycles long, seconds from the start
        of the log; None without signals.
    """

    found: Diagnosis
    spectra: GapSpectra | None = None
    telling_s: tuple[float, float] | None = None

    @property
    def signals(self) -> GapSignals | None:
        """Those of the diagnosis."""
        return self.found.signals

    @property
    def after(self) -> str:
        """Word for the last simulation: where nothing is named, only its parameters were tuned."""
        return "after" if self.found.verdict in ("effect", "parameters") else "when tuned"


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonEvidence:
    """What pictures and the report of a simulated log against a measured one are made from.

    Attributes
    ----------
    simulated, answer, remarks
        Name of the simulated log, what is said first, what limits it.
    where, distortion, simulated_distortion
        For the tables.
    signals
        The simulated log is what is drawn as `before`; there is nothing after.
    spectra, telling_s
        As of `GapEvidence`.
    """

    simulated: str
    answer: tuple[str, ...]
    remarks: tuple[str, ...]
    where: Where
    distortion: tuple[DistortionShare, ...]
    simulated_distortion: tuple[DistortionShare, ...]
    signals: GapSignals
    spectra: GapSpectra | None
    telling_s: tuple[float, float]

    @property
    def after(self) -> None:
        """No word: nothing is tuned and nothing is found."""
        return None


Evidence = GapEvidence | ComparisonEvidence
