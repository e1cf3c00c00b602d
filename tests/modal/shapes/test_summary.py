"""The summary says what was found, how good it is and what to distrust."""

from dataclasses import replace

import numpy as np

from chladni.modal.shapes.relative_motion import relative_motion
from chladni.modal.shapes.summary import summarise
from chladni.modal.shapes.validation import validate
from chladni.signals.geometry import Geometry
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance
from tests.modal.mode_makers import mode_set
from tests.modal.shapes.test_joint_treatment import GEOMETRY, scaled_modes
from tests.modal.shapes.test_validation import REFERENCE, SOUND, fit_of


def summary_of(modes: ModeSet, geometry: Geometry | None = None) -> tuple[str, ...]:
    return summarise(modes, validate(modes), relative_motion(modes, geometry or Geometry()))


def at_points(modes: ModeSet) -> ModeSet:
    """The same modes with sensors at points p0, p1, ... of one direction."""
    up = (0.0, 0.0, 1.0)
    placed = [replace(one, point=f"p{row}", direction=up) for row, one in enumerate(modes.channels)]
    return replace(modes, channels=tuple(placed))


def test_sound_modes() -> None:
    text = summary_of(mode_set(SOUND, provenance=Provenance(notes=("Measured at night.",))))
    assert text[0] == (
        "2 modes between 10 and 20 Hz, from responses alone at 3 channels; at 10.0000 ± 0.0010 Hz with "
        "1.000 ± 0.010 % damping and 20.0000 ± 0.0010 Hz with 1.000 ± 0.010 % damping (± one sigma)."
    )
    assert "The checks found nothing to distrust." in text
    assert text[-1] == "Measured at night."


def test_findings_take_the_place_of_praise() -> None:
    text = summary_of(at_points(mode_set([[1.0, 0.5], [1.0, 0.55]])))
    assert "The checks found nothing to distrust." not in text
    assert any("don't tell the shapes" in sentence for sentence in text)
    assert any("check before building" in sentence for sentence in text)


def test_the_fit_is_stated_with_its_worst_function() -> None:
    modes = mode_set(SOUND, references=REFERENCE, participation=np.ones((2, 1), complex))
    good = summary_of(replace(modes, fit=fit_of([0.01, 0.02, 0.03], [0.01, 0.02])))
    assert any(sentence.startswith("The modes reproduce the measured functions to 3 % (RMS") for sentence in good)
    poor = summary_of(replace(modes, fit=fit_of([0.01, 0.15, 0.03], [0.01, 0.02])))
    assert any("worst in c1 over hammer (15 %)" in sentence for sentence in poor)
    assert "from frequency responses" in good[0]


def test_only_the_main_modes_are_listed() -> None:
    shapes = np.eye(9)
    many = mode_set(shapes, references=REFERENCE, participation=np.array([[1.0 + 0j]] * 6 + [[50.0]] * 3))
    text = summary_of(many)[0]
    assert text.startswith("9 modes between 10 and 90 Hz")
    assert "the main ones at 40.0000" in text, "the three strongest are the last, the others rank by frequency"
    alone = summary_of(mode_set(shapes))[0]
    assert "the main ones at 10.0000" in alone
    assert "70.0000" not in alone


def test_no_mode_and_machines() -> None:
    line = MachineHarmonic(frequency_hz=49.98, reason="kurtosis 1.5, that of a sine")
    none = mode_set(np.zeros((0, 2)), harmonics=(line,), provenance=Provenance(notes=("Too short.",)))
    assert summary_of(none) == (
        "No mode was found.",
        "49.98 Hz is a line of a machine, no mode (kurtosis 1.5, that of a sine).",
        "Too short.",
    )


def test_one_mode_is_written_in_the_singular() -> None:
    assert summary_of(mode_set([[1.0, 0.2]]))[0].startswith("1 mode, from responses alone at 2 channels; at 10.0000")


def test_the_joints_of_the_sharpest_modes_are_named_with_a_number() -> None:
    text = summary_of(scaled_modes(), GEOMETRY)
    named = [sentence for sentence in text if "move most against each other" in sentence]
    assert len(named) == 3
    assert all("s/m between the two would double the damping" in sentence for sentence in named)
    damping = scaled_modes().damping_ratio
    assert named[0].startswith(f"Mode {int(np.argmin(damping)) + 1} (")


def test_unscaled_modes_name_each_joint_once() -> None:
    text = summary_of(at_points(mode_set([[1.0, 0.5, 0.4], [1.0, -0.5, -0.4], [0.1, 1.0, -0.2]])))
    assert (
        "p0 and p1 move most against each other in modes 1 and 2 (10 and 20 Hz), by 0.50 and 1.50 of the largest "
        in (" ".join(text))
    )
    assert "p1 and p2 move most against each other in mode 3 (30 Hz), by 1.20 of" in " ".join(text)
    assert sum("measure a driving point" in sentence for sentence in text) == 1


def test_what_stood_in_for_the_lines_is_said() -> None:
    named = mode_set([[1.0, 0.5]], names=("/a.z", "/b.z"))
    assert any("The channels have no points" in sentence for sentence in summary_of(named))
    modes = scaled_modes()
    motions = relative_motion(modes, Geometry(points=GEOMETRY.points))
    loose = summarise(modes, validate(modes), motions, geometry=Geometry(points=GEOMETRY.points))
    assert any("No line joins the points" in sentence for sentence in loose)
    joined = summarise(modes, validate(modes), motions, geometry=GEOMETRY)
    assert not any("joins the points" in sentence or "no points" in sentence for sentence in joined)
    assert not any("no points" in sentence for sentence in summarise(modes, validate(modes), motions))


def test_no_joint_is_named_that_only_the_order_of_channels_suggests() -> None:
    shapes = [[1.0, 0.5, 0.4], [1.0, -0.5, -0.4]]
    for names in ((), ("/a.z", "/b.z", "/c.z")):
        text = " ".join(summary_of(mode_set(shapes, names=names)))
        assert "against each other" not in text
        assert "Give a setup file with points, directions and lines" in text


def test_many_machines_take_one_sentence() -> None:
    lines = tuple(MachineHarmonic(frequency_hz=25.0 * k, reason="kurtosis 1.5") for k in (1, 2, 3))
    (told,) = [one for one in summary_of(mode_set(SOUND, harmonics=lines)) if "machine" in one]
    assert told.startswith("Lines of machines, no modes: 25, 50 and 75 Hz")


def test_poles_that_nobody_asked_for_are_told_of_the_fit() -> None:
    modes = mode_set(SOUND, references=REFERENCE, participation=np.ones((2, 1), complex))
    text = summary_of(replace(modes, fit=fit_of([0.01, 0.02, 0.15], [0.01, 0.02], (5.0, 10.0, 20.0, 30.0))))
    assert any(one.startswith("The modes and 2 further poles that were found reproduce the") for one in text)
    single = replace(modes.select(np.array([1])), fit=fit_of([0.01, 0.02, 0.03], [0.01, 0.02], (20.0,)))
    assert any(one.startswith("The mode reproduces the measured functions to 3 %") for one in summary_of(single))
