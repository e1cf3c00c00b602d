"""Lines of machines among the modes of spectra are listed, not taken."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.operational.harmonics import without_machines
from chladni.signals.machine_harmonic import MachineHarmonic
from tests.modal.mode_makers import mode_set

FAN = MachineHarmonic(frequency_hz=20.02, reason="kurtosis 1.5")


def modes_with(damping):
    return mode_set(np.eye(3), damping_ratio=np.array([0.01, damping, 0.01]))


def test_a_line_of_a_machine_is_listed_and_not_taken():
    found = without_machines(modes_with(0.001), [FAN], line_hz=0.1)
    assert found.frequency_hz == pytest.approx([10.0, 30.0])
    assert found.harmonics == (FAN,)


def test_what_a_window_widens_is_a_line_still():
    assert without_machines(modes_with(0.01), [FAN], line_hz=0.25).frequency_hz == pytest.approx([10.0, 30.0])


def test_a_mode_beside_a_machine_stays_when_it_is_wider_than_any_line():
    assert without_machines(modes_with(0.02), [FAN], line_hz=0.1).frequency_hz.size == 3


def test_a_machine_elsewhere_takes_nothing_away():
    elsewhere = MachineHarmonic(frequency_hz=25.0, reason="kurtosis 1.5")
    found = without_machines(modes_with(0.001), [elsewhere], line_hz=0.1)
    assert found.frequency_hz.size == 3
    assert found.harmonics == (elsewhere,)


def test_a_line_that_is_known_twice_is_listed_once():
    again = MachineHarmonic(frequency_hz=20.021, reason="no width")
    found = without_machines(replace(modes_with(0.001), harmonics=(again,)), [FAN], line_hz=0.1)
    assert found.harmonics == (again,)


def test_without_machines_nothing_changes():
    modes = modes_with(0.001)
    assert without_machines(modes, [], line_hz=0.1) is modes
