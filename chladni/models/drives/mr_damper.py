"""Magnetorheological damper (S7): as a drive whose rod is moved, and as something that acts at a joint."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port, Terminal
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.mr_coefficients import MrCoefficients
from chladni.models.drives.mr_shipped import (
    MEASURED_DAMPER,
    MEASURED_DAMPER_ASYMMETRIC,
    MEASURED_STROKE_M,
)
from chladni.models.drives.validity import Limit
from chladni.signals.errors import ModelError

#: The joint between housing and rod.
JOINT = "damper"
DISPLACEMENT = Terminal(name="displacement", unit="m", derivatives=2)
FORCE = Terminal(name="force", unit="N")
_PAPER, _ASYMMETRIC = "paper", "asymmetric"

_PARAMETERS = Parameters(
    (
        Parameter(
            name="current", value=0.5, unit="A", low=0.0, high=1.0, minimum=0.0, maximum=10.0, symbol="i",
            tolerance=0.02, role="function", meaning="in the coil",
        ),
        Parameter(
            name="stroke", value=0.02, unit="m", low=0.001, high=MEASURED_STROKE_M, minimum=1e-6, maximum=1.0,
            shown_unit="mm", role="function", meaning="amplitude of the sinus that the loops are drawn with",
        ),
        Parameter(
            name="frequency", value=0.5, unit="Hz", low=0.1, high=2.0, minimum=1e-3, maximum=100.0,
            role="function", meaning="of that sinus",
        ),
        Parameter(
            name="size", value=1.0, low=0.1, high=10.0, minimum=1e-6, maximum=1e6,
            meaning="every force, relative to the measured damper",
        ),
        Parameter(
            name="alpha_scale", value=1.0, low=0.5, high=2.0, minimum=0.0, maximum=1e3, symbol="alpha",
            tolerance=0.2, meaning="force of the loop, relative to the measured damper",
        ),
        Parameter(
            name="c0_scale", value=1.0, low=0.5, high=2.0, minimum=0.0, maximum=1e3, symbol="c0",
            tolerance=0.2, meaning="damping beyond yield, relative to the measured damper",
        ),
        Parameter(
            name="c1_scale", value=1.0, low=0.5, high=2.0, minimum=1e-6, maximum=1e3, symbol="c1",
            tolerance=0.2, meaning="damping before yield, relative to the measured damper",
        ),
    )
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class MrDamper:
    """A damper at a joint of any model; made by `mr_damper_at`.

    Attributes
    ----------
    site
        Name of the joint.
    coefficients
        Of the damper, its size included.
    current
        A.
    """

    site: str
    coefficients: MrCoefficients
    current: float

    @property
    def effect(self) -> str:
        """``mr_damper``."""
        return "mr_damper"

    @property
    def values(self) -> Mapping[str, float]:
        """The current, A."""
        return {"current": self.current}

    def attach(self, compiled: CompiledModel) -> CompiledModel:
        """Give the model with the damper in parallel to the joint's spring and damper.

        Raises
        ------
        ModelError
            When there's no such joint, or the joint turns.
        """
        port = compiled.port_index(self.site, "joint")
        # Metres read as radians would give a force of the wrong size without a word.
        if compiled.ports[port].displacement_unit != "m":
            raise ModelError(
                f"mr_damper at {self.site!r}: the joint turns; the damper is made for a joint that slides"
            )
        return replace(compiled, laws=(*compiled.laws, self.coefficients.law(self.current, port=port)))


def mr_damper_at(
    joint: str, *, current_a: float = 0.0, coefficients: MrCoefficients = MEASURED_DAMPER, size: float = 1.0
) -> MrDamper:
    """Make a damper for a model's `with_effects`.

    Parameters
    ----------
    joint
        Where it acts.
    current_a
        In its coil, from 0 to what the coefficients were fitted for; beyond it's refused.
    coefficients
        The measured damper of this project when not given.
    size
        Every force relative to the coefficients.

    Raises
    ------
    ModelError
        For an impossible current or size.

    Examples
    --------
    >>> damper = mr_damper_at("elbow", current_a=0.5, size=0.1)
    >>> damper.site, dict(damper.values)
    ('elbow', {'current': 0.5})
    """
    if not size > 0:
        raise ModelError(f"mr_damper at {joint!r}: size {size:g} is not possible; give a positive number")
    # Polynomials run away outside of what they were fitted to; a damper to be chosen must not live on that.
    low, high = coefficients.lowest_current_a, coefficients.highest_current_a
    if not low <= current_a <= high:
        raise ModelError(
            f"mr_damper at {joint!r}: {current_a:g} A lies outside of the fitted {low:g} to {high:g} A; "
            "fit coefficients at that current"
        )
    damper = MrDamper(site=joint, coefficients=coefficients.scaled(force=size), current=float(current_a))
    # Asked once here, so that a negative polynomial is told where the damper is made.
    damper.coefficients.law(damper.current)
    return damper


def mr_damper_kind(
    paper: MrCoefficients = MEASURED_DAMPER,
    asymmetric: MrCoefficients = MEASURED_DAMPER_ASYMMETRIC,
    *,
    name: str = "mr-damper",
) -> DriveKind:
    """Make a kind of drive of the coefficients of a damper; those of `fit_mr_damper`, for example.

    Its motion is prescribed (``displacement``), its force is told (``force``), with the sign of the velocity while
    it dissipates.
    """
    return DriveKind(
        name=name,
        title="Magnetorheological damper",
        parameters=_PARAMETERS,
        inputs=(DISPLACEMENT,),
        outputs=(FORCE,),
        options=(
            Option(
                name="law",
                choices=(_PAPER, _ASYMMETRIC),
                default=_PAPER,
                meaning="equation 5, or compression, rest and extension apart",
            ),
        ),
        build=_Build(paper=paper, asymmetric=asymmetric),
        limits=_limits,
        remarks=_Remarks(paper=paper, asymmetric=asymmetric),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Build:
    """Builds the equations from one of two sets of coefficients."""

    paper: MrCoefficients
    asymmetric: MrCoefficients

    def __call__(self, values: Mapping[str, float], options: Mapping[str, str]) -> CompiledModel:
        coefficients = self.paper if options["law"] == _PAPER else self.asymmetric
        return _press(at_values(coefficients, values), values["current"])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Remarks:
    """Says when the current lies outside of what the coefficients were fitted for."""

    paper: MrCoefficients
    asymmetric: MrCoefficients

    def __call__(self, values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[str]:
        coefficients = self.paper if options["law"] == _PAPER else self.asymmetric
        low, high, current = coefficients.lowest_current_a, coefficients.highest_current_a, values["current"]
        if low <= current <= high:
            return ()
        return (f"current = {current:g} A lies outside of the fitted {low:g} to {high:g} A: its polynomials guess",)


def at_values(coefficients: MrCoefficients, values: Mapping[str, float]) -> MrCoefficients:
    """Coefficients of a damper of the size and with the properties that the parameters say."""
    return coefficients.scaled(
        force=values["size"],
        alpha=values["alpha_scale"],
        c0=values["c0_scale"],
        c1=values["c1_scale"],
    )


def _press(coefficients: MrCoefficients, current_a: float) -> CompiledModel:
    """Rod moved as prescribed against the ground: no state but the law's, whose force is the output."""
    # Columns of u: displacement, velocity, acceleration; d reads the first, s the second.
    none, row = np.zeros((0, 0)), np.array([[1.0, 0.0, 0.0]])
    return CompiledModel(
        a=none, b=np.zeros((0, 3)), c=np.zeros((1, 0)), d=np.zeros((1, 3)), g=np.zeros((0, 1)), h=np.ones((1, 1)),
        displacement_state=np.zeros((1, 0)), displacement_column=row, displacement_port=np.zeros((1, 1)),
        velocity_state=np.zeros((1, 0)), velocity_column=np.roll(row, 1), velocity_port=np.zeros((1, 1)),
        inputs=(DISPLACEMENT,), outputs=(FORCE,), states=(), ports=(Port(name=JOINT, kind="joint"),),
        laws=(coefficients.law(current_a),),
    )  # fmt: skip


def _limits(_values: Mapping[str, float], _options: Mapping[str, str]) -> Sequence[Limit]:
    return (
        Limit(
            signal="displacement",
            low=-MEASURED_STROKE_M,
            high=MEASURED_STROKE_M,
            unit="mm",
            what="displacement",
            why="the damper was measured up to there",
        ),
    )


#: The measured damper.
MR_DAMPER = mr_damper_kind()
