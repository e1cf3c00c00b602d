"""What was found and what to distrust, in sentences that a supervisor can read."""

from collections.abc import Sequence

import numpy as np

from chladni.modal.shapes.joint_treatment import JointTreatment, treatments
from chladni.modal.shapes.mode_words import capital, joined, mode_names, synthesised_from
from chladni.modal.shapes.neighbours import neighbour_note
from chladni.signals.arrays import Real
from chladni.signals.geometry import Geometry
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.wording import counted, with_sigma

_MAIN_MODES = 6
_GOOD_FIT = 0.05
_MOST_JOINTS = 3
_FEW_MACHINES = 2
_DOUBT = "The shapes aren't all told apart: check before building."


def summarise(
    modes: ModeSet,
    validation: ModeValidation,
    relative_motion: Sequence[RelativeMotion] = (),
    *,
    geometry: Geometry | None = None,
) -> tuple[str, ...]:
    """Say how many modes there are, the main ones, how good the fit is, what to distrust and which joint to treat.

    Parameters
    ----------
    validation, relative_motion
        Of the same modes.
    geometry
        That said who is whose neighbour; what stood in for its lines is said, too.

    Returns
    -------
    Sentences, in that order; the notes of the modes stand last.
    """
    notes = modes.provenance.notes
    if modes.frequency_hz.size == 0:
        return ("No mode was found.", *_harmonics(modes), *notes)
    return (
        *_main_modes(modes),
        *_fit(modes),
        *_harmonics(modes),
        *validation.findings,
        *(() if validation.findings else ("The checks found nothing to distrust.",)),
        *_joints(modes, validation, relative_motion),
        *_neighbours(modes, relative_motion, geometry),
        *notes,
    )


def _main_modes(modes: ModeSet) -> list[str]:
    count = modes.frequency_hz.size
    rows = np.sort(np.argsort(-_prominence(modes), kind="stable")[:_MAIN_MODES])
    source = "frequency responses" if modes.references else "responses alone"
    span = f" between {modes.frequency_hz[0]:.4g} and {modes.frequency_hz[-1]:.4g} Hz" if count > 1 else ""
    start = f"{capital(counted(count, 'mode'))}{span}, from {source} at {counted(len(modes.channels), 'channel')}"
    listed = [
        f"{_with_std(modes.frequency_hz[row], modes.frequency_std_hz[row])} Hz with "
        f"{_with_std(100 * modes.damping_ratio[row], 100 * modes.damping_std[row])} % damping"
        for row in rows
    ]
    which = "the main ones at" if count > _MAIN_MODES else "at"
    return [f"{start}; {which} {joined(listed)} (± one sigma)."]


def _with_std(value: float, std: float) -> str:
    return with_sigma(float(value), float(std), unknown=" (no error bar)", exact=" ± 0")


def _prominence(modes: ModeSet) -> Real:
    """``[mode]`` height of each resonance in accelerance, to a common factor.

    H at omega_r is about -omega^2 psi L/(zeta omega); without participation the lower modes go first, which usually
    move further.
    """
    if modes.participation is None:
        return -modes.frequency_hz
    strength = np.linalg.norm(modes.participation, axis=1) * np.linalg.norm(modes.shapes, axis=1)
    return np.asarray(strength * modes.frequency_hz / np.maximum(np.abs(modes.damping_ratio), 1e-6), dtype=np.float64)


def _fit(modes: ModeSet) -> list[str]:
    fit = modes.fit
    if fit is None:
        return []
    share, which = f"{100 * fit.error:.2g} %", capital(synthesised_from(modes))
    verb = "reproduces" if which == "The mode" else "reproduce"
    if fit.error <= _GOOD_FIT:
        return [f"{which} {verb} the measured functions to {share} (RMS of the difference over RMS)."]
    row, column = np.unravel_index(int(np.argmax(fit.function_error)), fit.function_error.shape)
    worst = f"{modes.channels[row].name} over {modes.references[column].name}"
    sentence = (
        f"{which} {verb} the measured functions to {share} (RMS of the difference over RMS, noise of the "
        f"measurement included), worst in {worst} ({100 * fit.function_error[row, column]:.2g} %)."
    )
    return [sentence]


def _harmonics(modes: ModeSet) -> list[str]:
    if len(modes.harmonics) > _FEW_MACHINES:
        listed = joined([f"{harmonic.frequency_hz:.4g}" for harmonic in modes.harmonics], most=12)
        return [
            f"Lines of machines, no modes: {listed} Hz; each has its reason in the report and in the JSON document."
        ]
    return [
        f"{harmonic.frequency_hz:.4g} Hz is a line of a machine, no mode ({harmonic.reason})."
        for harmonic in modes.harmonics
    ]


def _neighbours(modes: ModeSet, motions: Sequence[RelativeMotion], geometry: Geometry | None) -> list[str]:
    names = {channel.name for channel in modes.channels}
    # Without a geometry at hand the motions tell whether there were points: else they are between channels.
    if not motions or (geometry is None and not names.issuperset(motions[0].between)):
        return []
    note = neighbour_note(modes.channels, geometry or Geometry())
    return [] if note is None else [note]


def _joints(modes: ModeSet, validation: ModeValidation, motions: Sequence[RelativeMotion]) -> list[str]:
    names = {channel.name for channel in modes.channels}
    # Channels that follow each other in a list need not be neighbours: nobody should build a damper on that.
    found = treatments(modes, [one for one in motions if not names.issuperset(one.between)])
    doubtful = {row for pair in validation.alike for row in pair}
    scaled = [one for one in found if one.damper is not None]
    if not scaled:
        return _unscaled_joints(modes, found, doubtful)
    # The sharpest resonances first: they are what a damper is for.
    by_damping = sorted(scaled, key=lambda one: float(modes.damping_ratio[one.mode]))[:_MOST_JOINTS]
    return [one.sentence + (f" {_DOUBT}" if one.mode in doubtful else "") for one in by_damping]


def _unscaled_joints(modes: ModeSet, found: Sequence[JointTreatment], doubtful: set[int]) -> list[str]:
    """One sentence for each joint that moves most in some mode, the one of most modes first."""
    by_joint: dict[tuple[str, str], list[JointTreatment]] = {}
    for one in found:
        by_joint.setdefault(one.between, []).append(one)
    sentences = []
    for between, of_modes in sorted(by_joint.items(), key=lambda item: -len(item[1]))[:_MOST_JOINTS]:
        ratios = joined([f"{one.ratio:.2f}" for one in of_modes])
        sentence = (
            f"{between[0]} and {between[1]} move most against each other in "
            f"{mode_names(modes, [one.mode for one in of_modes])}, by {ratios} of the largest motion: treat that "
            "joint first."
        )
        sentences.append(sentence + (f" {_DOUBT}" if doubtful.intersection(one.mode for one in of_modes) else ""))
    if sentences:
        sentences.append(
            "By how much a damper or a spring helps takes scaled modes: measure a driving point, force in N and "
            "motion at the same point and direction."
        )
    return sentences
