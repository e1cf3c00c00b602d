"""Natural modes: frequencies, damping ratios and modal vectors, each with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.channel import UNKNOWN, Channel, Names, Units, made_channels, numbered
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_fit import ModalFit
from chladni.signals.modal_scale import ModalScale
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.value import Coordinate, Value, require_shape

Rows = Literal["modes", "channels"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeSet(Value):
    """Modes by rising natural frequency; an empty set is an answer, and its notes say why.

    Attributes
    ----------
    frequency_hz, frequency_std_hz
        ``[mode]`` undamped natural frequency abs(pole)/(2 pi), and one sigma of it.
    damping_ratio, damping_std
        ``[mode]`` -Re(pole)/abs(pole), and one sigma of it.
    shapes
        ``[mode, channel]`` complex displacement of each channel along its own direction, largest component 1.
    shape_std
        ``[mode, channel]`` complex: one sigma of the real part + j one sigma of the imaginary part; 0 at the
        component that is 1 by convention.
    channels
        One for each column of `shapes`.
    references
        Excitations of the frequency responses; empty when the modes are from responses alone.
    participation
        ``[mode, reference]`` complex, or None when the modes are from responses alone. The receptance is
        H_ij(s) = sum over modes of shapes_i participation_j / (s - pole) + its conjugate partner + residuals.
    scale
        Modal mass and modal A, or None: unscaled, and a note says why.
    spread
        How the poles of each mode scatter over model orders; None for methods without model orders.
    harmonics
        Lines of rotating machines that were told from modes and left out.
    fit
        Synthesised frequency responses and their error; None when the modes are from responses alone.
    stabilisation
        All poles that the modes were chosen from; None for methods without model orders.
    provenance
        How they were made; notes are advice.
    """

    AXES: ClassVar = {
        **dict.fromkeys(("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"), ("mode",)),
        **dict.fromkeys(("modal_mass", "modal_mass_std"), ("mode",)),
        **dict.fromkeys(("shapes", "shape_std"), ("mode", "channels")),
    }
    ROWS: ClassVar = "mode"
    UNITS: ClassVar = dict.fromkeys(("modal_mass", "modal_mass_std"), "kg")

    frequency_hz: Real
    frequency_std_hz: Real
    damping_ratio: Real
    damping_std: Real
    shapes: NDArray[np.complexfloating]
    shape_std: NDArray[np.complexfloating]
    channels: tuple[Channel, ...]
    references: tuple[Channel, ...] = ()
    participation: NDArray[np.complexfloating] | None = None
    scale: ModalScale | None = None
    spread: OrderSpread | None = None
    harmonics: tuple[MachineHarmonic, ...] = ()
    fit: ModalFit | None = None
    stabilisation: StabilisationDiagram | None = None
    provenance: Provenance

    def __post_init__(self) -> None:
        count = self.frequency_hz.size
        for name in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"):
            require_shape(name, getattr(self, name), (count,), "modes")
        for name in ("shapes", "shape_std"):
            require_shape(name, getattr(self, name), (count, len(self.channels)), "modes x channels")
        if self.participation is not None:
            expected = (count, len(self.references))
            require_shape("participation", self.participation, expected, "modes x references")
        if self.fit is not None:
            expected = (len(self.channels), len(self.references))
            require_shape("fit.function_error", self.fit.function_error, expected, "channels x references")
        if np.any(np.diff(self.frequency_hz) < 0) or np.any(self.frequency_hz <= 0):
            raise EstimateError("frequency_hz of modes must be positive and rising")
        self._freeze()

    @classmethod
    def from_arrays(
        cls,
        frequency_hz: ArrayLike,
        shapes: ArrayLike,
        *,
        damping_ratio: ArrayLike | None = None,
        names: Names | None = None,
        units: Units = UNKNOWN,
        channels: Sequence[Channel] | None = None,
        rows: Rows | None = None,
    ) -> Self:
        """Make modes of numbers in memory, as those of a finite element model.

        Parameters
        ----------
        frequency_hz
            ``[mode]`` natural frequencies, in any order.
        shapes
            ``[mode, channel]`` or ``[channel, mode]``; each is scaled so that its largest component is 1.
        damping_ratio
            ``[mode]``, or one of all; NaN, unknown, by default. So are all error bars.
        names, units
            Of the channels; ``ch1``, ``ch2``, ... and ``1``, unknown, by default.
        channels
            The channels themselves, with points and directions, instead of `names` and `units`.
        rows
            What each row of `shapes` belongs to; needed where there are as many modes as channels.

        Raises
        ------
        EstimateError
            When shapes and names don't fit together, or the array is square and `rows` isn't given.

        Examples
        --------
        >>> modes = ModeSet.from_arrays([20.0, 10.0], [[1, 2, 3], [2, 1, 0]], names=["base", "arm", "wrist"])
        >>> modes.frequency_hz.tolist(), modes.shapes.real.tolist()
        ([10.0, 20.0], [[1.0, 0.5, 0.0], [0.3333333333333333, 0.6666666666666666, 1.0]])
        """
        found_hz = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        table = _by_mode(np.asarray(shapes, dtype=np.complex128), found_hz.size, rows)
        order = np.argsort(found_hz, kind="stable")
        damping = np.broadcast_to(np.nan if damping_ratio is None else damping_ratio, found_hz.shape)
        unknown = np.full(found_hz.shape, np.nan)
        if channels is None:
            channels, _ = made_channels(numbered("ch", table.shape[1], names), units)
        return cls(
            frequency_hz=found_hz[order],
            frequency_std_hz=unknown,
            damping_ratio=np.asarray(damping, dtype=np.float64)[order],
            damping_std=unknown,
            shapes=table[order],
            shape_std=np.full(table.shape, complex(np.nan, np.nan)),
            channels=tuple(channels),
            provenance=Provenance(estimator="as given"),
        )

    def coordinate(self, axis: str) -> Coordinate:
        """Give the modes' numbers from 1 on, or the names of the channels."""
        return np.arange(1, self.frequency_hz.size + 1) if axis == "mode" else Value.coordinate(self, axis)

    @property
    def modal_mass(self) -> Real:
        """``[mode]`` modal mass of `scale`, kg for forces and translations; NaN where there is none."""
        return np.full(self.frequency_hz.shape, np.nan) if self.scale is None else self.scale.modal_mass

    @property
    def modal_mass_std(self) -> Real:
        """``[mode]`` one sigma of the modal mass; NaN where there is none."""
        return np.full(self.frequency_hz.shape, np.nan) if self.scale is None else self.scale.modal_mass_std

    @property
    def poles(self) -> Complex:
        """``[mode]`` -zeta omega + j omega sqrt(1 - zeta^2) in rad/s."""
        omega = 2 * pi * self.frequency_hz
        return -self.damping_ratio * omega + 1j * omega * np.sqrt(1 - self.damping_ratio**2)

    def select(self, rows: Index) -> Self:
        """Give some of the modes, by rising frequency; the fit stays that of all of them.

        Parameters
        ----------
        rows
            ``[mode]`` rows to keep, by rising frequency.
        """
        return replace(
            self,
            frequency_hz=self.frequency_hz[rows],
            frequency_std_hz=self.frequency_std_hz[rows],
            damping_ratio=self.damping_ratio[rows],
            damping_std=self.damping_std[rows],
            shapes=self.shapes[rows],
            shape_std=self.shape_std[rows],
            participation=None if self.participation is None else self.participation[rows],
            scale=None if self.scale is None else self.scale.select(rows),
            spread=None if self.spread is None else self.spread.select(rows),
            stabilisation=None if self.stabilisation is None else self.stabilisation.select(rows),
        )


def _by_mode(shapes: Complex, count: int, rows: Rows | None) -> Complex:
    """Give shapes as ``[mode, channel]``, each with its largest component 1."""
    if shapes.ndim == 1:
        shapes, rows = shapes[np.newaxis], "modes"
    if shapes.ndim != 2 or count not in shapes.shape:
        raise EstimateError(f"shapes have shape {shapes.shape}, but must be [mode, channel] of {count} modes")
    if rows is None and shapes.shape[0] == shapes.shape[1] > 1:
        raise EstimateError(
            f'shapes are {count} x {count}, so either axis may be the modes. Say rows="modes" where a row is a mode, '
            'or rows="channels" where a column is one'
        )
    turned = rows == "channels" or (rows is None and shapes.shape[0] != count)
    by_mode = shapes.T if turned else shapes
    if by_mode.shape[0] != count:
        raise EstimateError(f"shapes have shape {shapes.shape} with rows={rows!r}, which isn't {count} modes")
    if not np.isfinite(by_mode).all() or not by_mode.any(axis=1).all():
        raise EstimateError("a shape is zero, or holds NaN or infinity; leave it out")
    largest = np.take_along_axis(by_mode, np.argmax(np.abs(by_mode), axis=1)[:, np.newaxis], axis=1)
    return by_mode / largest
