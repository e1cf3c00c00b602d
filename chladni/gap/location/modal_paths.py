"""How a force somewhere reaches the sensors, by a modal model that stands in for a simulation."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.mode_set import ModeSet
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalPaths(Value):
    """Building blocks of the path from any force to the sensors: real weights of them are a path.

    Attributes
    ----------
    modal
        ``[mode, output, line]`` answer of the sensors to a force that drives one mode with weight one.
    outside
        ``[term, output, line]`` what modes below and above the band may leave, sensor by sensor. Of unit RMS.
    measured
        ``[output, line]`` what they do leave of the answer to the force that was applied.
    driving
        Row of the sensor at that force.
    shapes, shape_std
        ``[mode, output]`` real parts of the modal vectors, and one sigma.
    """

    modal: Complex
    outside: Complex
    measured: Complex
    driving: int
    shapes: Real
    shape_std: Real

    def __post_init__(self) -> None:
        self._freeze()

    def weights(self, direction: Real) -> tuple[Real, Real]:
        """``[mode]`` weights of a force with this direction ``[output]`` over the sensors, and one sigma of each.

        By reciprocity a force drives a mode as much as its own place moves in it: psi . direction.
        """
        return self.shapes @ direction, np.sqrt(self.shape_std**2 @ direction**2)

    def outside_of(self, direction: Real) -> tuple[Complex, Complex]:
        """Give what modes outside the band print of a force with this direction: the known part, and free terms.

        The sensor at the applied force answers this one as this one's places answered that (reciprocity). Of the
        other sensors only the share at the driving point was measured. They are ``[output, line]`` and ``[term,
        output, line]``; there are no free terms for a force at the driving point.
        """
        known = direction[self.driving] * self.measured
        known[self.driving] = direction @ self.measured
        others = np.arange(len(direction)) != self.driving
        if not np.any(direction[others]):
            return known, self.outside[:0]
        # Two terms a sensor, in their order.
        return known, self.outside[np.repeat(others, 2)]

    def on(self, lines: Mask) -> "ModalPaths":
        """Give some of the lines."""
        return replace(
            self,
            modal=self.modal[:, :, lines],
            outside=self.outside[:, :, lines],
            measured=self.measured[:, lines],
        )

    def free(self) -> Complex:
        """``[term, output, line]`` all blocks, of unit RMS: a force anywhere is some weights of these."""
        return np.concatenate([_unit(self.modal), self.outside])


def modal_paths(
    modes: ModeSet, frequency_hz: Real, *, outputs: tuple[str, ...], driving_point: str, order: int
) -> ModalPaths:
    """Turn modes that were identified from one force into paths from a force anywhere.

    With the sensor d at the force, L = psi_d/a gives each mode's modal A, and the receptance between any two places
    i and j is the sum over modes of psi_i psi_j/(a (s - pole)), its conjugate partner, and residuals (Maia & Silva,
    *Theoretical and Experimental Modal Analysis*, section 2.4).

    Parameters
    ----------
    modes
        Of frequency responses of `outputs` to one force.
    frequency_hz
        ``[line]``.
    outputs
        Names of the sensors, in the order wanted.
    driving_point
        The one at the force, along it.
    order
        0 for displacements, 1 for velocities, 2 for accelerations.

    Raises
    ------
    EstimateError
        When no mode was found, the modes are of other sensors, of several forces or of none, or the driving point
        stands still in all of them.
    """
    names = [channel.name for channel in modes.channels]
    if driving_point not in outputs:
        raise EstimateError(f"the driving point {driving_point!r} is none of the outputs {', '.join(outputs)}")
    missing = [name for name in outputs if name not in names]
    if missing:
        raise EstimateError(
            f"the modal model has no sensor {missing[0]!r}, only {', '.join(names)}; identify it from these sensors"
        )
    if modes.participation is None or modes.participation.shape[1] != 1:
        raise EstimateError(
            f"the modal model is of {len(modes.references)} forces; identify it from responses to the one that "
            "drives the logs"
        )
    if not modes.frequency_hz.size:
        raise EstimateError("the modal model has no mode in this band; identify it at the lowest level, band wider")
    driven = modes.shapes[:, names.index(driving_point)]
    if not np.all(np.abs(driven) > 0):
        raise EstimateError(f"{driving_point} stands still in a mode: it is no driving point; name the sensor there")
    columns = [names.index(name) for name in outputs]
    s = np.asarray(2j * np.pi * frequency_hz, dtype=np.complex128)
    drives = (modes.participation[:, 0] / driven)[:, None]
    residue = np.asarray(modes.shapes[:, columns] * drives, dtype=np.complex128)
    return ModalPaths(
        modal=_resonances(residue, modes.poles, s, order),
        outside=_unit(_outside(len(outputs), s, order)),
        measured=_left_outside(modes, columns, s, order),
        driving=outputs.index(driving_point),
        shapes=np.asarray(modes.shapes[:, columns].real, dtype=np.float64),
        shape_std=np.asarray(modes.shape_std[:, columns].real, dtype=np.float64),
    )


def _resonances(residue: Complex, poles: Complex, s: Complex, order: int) -> Complex:
    """``[mode, output, line]``."""
    one, other = (s**order / (s - pole[:, None]) for pole in (poles, poles.conj()))
    return np.asarray(residue[:, :, None] * one[:, None] + residue.conj()[:, :, None] * other[:, None])


def _left_outside(modes: ModeSet, columns: list[int], s: Complex, order: int) -> Complex:
    """``[output, line]`` residuals of the fit; zero where there is none."""
    if modes.fit is None:
        return np.zeros((len(columns), s.size), dtype=np.complex128)
    lower, upper = (part[columns] for part in (modes.fit.lower_residual, modes.fit.upper_residual))
    return np.asarray(lower * s ** (order - 2) + upper * s**order)


def _outside(outputs: int, s: Complex, order: int) -> Complex:
    """``[term, output, line]``: a flexibility and an inertia at each sensor."""
    shapes = np.array([s**order, s ** (order - 2)])
    return np.asarray((np.eye(outputs)[:, None, :, None] * shapes[None, :, None, :]).reshape(-1, outputs, s.size))


def _unit(terms: Complex) -> Complex:
    return np.asarray(terms / np.sqrt(np.mean(np.abs(terms) ** 2, axis=(1, 2), keepdims=True)))
