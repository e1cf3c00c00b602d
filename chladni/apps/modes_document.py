"""The document of ``chladni modes``: natural frequencies, damping, shapes and what they are worth."""

from collections.abc import Sequence

import numpy as np

from chladni.apps.documents import Document, finite, plain
from chladni.modal.shapes.joint_treatment import treatments
from chladni.modal.shapes.shape_transmissibility import ShapeTransmissibility
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.order_spread import OrderSpread
from chladni.signals.relative_motion import RelativeMotion


def modes_document(
    modes: ModeSet,
    validation: ModeValidation,
    relative_motion: Sequence[RelativeMotion] = (),
    transmissibility: Sequence[ShapeTransmissibility] = (),
) -> Document:
    """Document of ``chladni modes``; numbers that aren't known are null.

    Parameters
    ----------
    validation, relative_motion, transmissibility
        Of the same modes.

    Returns
    -------
    Document
        ``format``, ``modes``, ``fit_error`` and further keys: see the user guide. Modes are counted from 0 wherever a
        key holds their number.
    """
    fit = modes.fit
    return {
        "format": "chladni.modes/1",
        "modes": [_mode(modes, validation, relative_motion, row) for row in range(modes.frequency_hz.size)],
        "fit_error": None if fit is None else finite(fit.error),
        "function_errors": [] if fit is None else _function_errors(modes, fit),
        "band_errors": [] if fit is None else _band_errors(fit),
        "auto_mac": [plain(row) for row in validation.auto_mac],
        "alike": [list(pair) for pair in validation.alike],
        "treatments": [
            {
                "mode": one.mode,
                "between": list(one.between),
                "damping_gain_per_n_s_m": one.damping_gain,
                "damping_gain_std_per_n_s_m": one.damping_gain_std,
                "stiffness_gain_hz_per_n_m": one.stiffness_gain_hz,
                "damper_n_s_m": one.damper,
                "spring_n_m": one.spring,
                "sentence": one.sentence,
            }
            for one in treatments(modes, relative_motion)
        ],
        "transmissibility": [_passed_on(one) for one in transmissibility],
        "harmonics": [{"frequency_hz": finite(one.frequency_hz), "reason": one.reason} for one in modes.harmonics],
        "scale": None
        if modes.scale is None
        else {"response": modes.scale.response, "reference": modes.scale.reference},
        "references": [channel.name for channel in modes.references],
        "estimator": modes.provenance.estimator,
        "findings": list(validation.findings),
        "notes": list(modes.provenance.notes),
    }


def _passed_on(step: ShapeTransmissibility) -> Document:
    return {
        "mode": step.mode,
        "between": list(step.between),
        "ratio": step.ratio,
        "ratio_std": step.ratio_std,
        "phase_deg": step.phase_deg,
    }


def _mode(
    modes: ModeSet, validation: ModeValidation, relative_motion: Sequence[RelativeMotion], row: int
) -> Document:
    return {
        "frequency_hz": finite(float(modes.frequency_hz[row])),
        "frequency_std_hz": finite(float(modes.frequency_std_hz[row])),
        "damping_ratio": finite(float(modes.damping_ratio[row])),
        "damping_std": finite(float(modes.damping_std[row])),
        "mpc": finite(float(validation.mpc[row])),
        "mpd_deg": finite(float(validation.mpd_deg[row])),
        "mean_phase_deg": finite(float(validation.mean_phase_deg[row])),
        **_scale(modes, row),
        "orders": None if modes.spread is None else int(modes.spread.orders[row]),
        "spread": None if modes.spread is None else _spread(modes.spread, row),
        "shape": _shape(modes, row),
        "participation": _participation(modes, row),
        "relative_motion": [_joint(one) for one in relative_motion if one.mode == row],
    }


def _scale(modes: ModeSet, row: int) -> Document:
    if modes.scale is None:
        return {"modal_mass": None, "modal_mass_std": None, "modal_a": None}
    modal_a = complex(modes.scale.modal_a[row])
    return {
        "modal_mass": finite(float(modes.scale.modal_mass[row])),
        "modal_mass_std": finite(float(modes.scale.modal_mass_std[row])),
        "modal_a": {"real": finite(modal_a.real), "imag": finite(modal_a.imag)},
    }


def _spread(spread: OrderSpread, row: int) -> Document:
    return {
        "frequency_hz": finite(float(spread.frequency_hz[row])),
        "frequency_std_hz": finite(float(spread.frequency_std_hz[row])),
        "damping_ratio": finite(float(spread.damping_ratio[row])),
        "damping_std": finite(float(spread.damping_std[row])),
    }


def _shape(modes: ModeSet, row: int) -> list[Document]:
    return [
        {
            "channel": channel.name,
            "real": finite(float(component.real)),
            "imag": finite(float(component.imag)),
            "real_std": finite(float(std.real)),
            "imag_std": finite(float(std.imag)),
            "point": channel.point,
            "direction": None if channel.direction is None else list(channel.direction),
        }
        for channel, component, std in zip(modes.channels, modes.shapes[row], modes.shape_std[row], strict=True)
    ]


def _participation(modes: ModeSet, row: int) -> list[Document]:
    if modes.participation is None:
        return []
    return [
        {"reference": channel.name, "real": finite(float(factor.real)), "imag": finite(float(factor.imag))}
        for channel, factor in zip(modes.references, modes.participation[row], strict=True)
    ]


def _joint(motion: RelativeMotion) -> Document:
    return {
        "between": list(motion.between),
        "ratio": _known(motion.ratio),
        "ratio_std": _known(motion.ratio_std),
        "damping_gain_per_n_s_m": _known(motion.damping_gain),
        "stiffness_gain_hz_per_n_m": _known(motion.stiffness_gain_hz),
    }


def _known(number: float | None) -> float | None:
    return None if number is None else finite(number)


def _function_errors(modes: ModeSet, fit: ModalFit) -> list[Document]:
    return [
        {
            "response": response.name,
            "reference": reference.name,
            "error": finite(float(fit.function_error[row, column])),
        }
        for row, response in enumerate(modes.channels)
        for column, reference in enumerate(modes.references)
    ]


def _band_errors(fit: ModalFit) -> list[Document]:
    return [
        {"low_hz": finite(float(low_hz)), "high_hz": finite(float(high_hz)), "error": finite(float(error))}
        for (low_hz, high_hz), error in zip(np.asarray(fit.bands_hz), fit.band_error, strict=True)
    ]
