"""The document of modes: the keys that programs rely on, and never a NaN."""

import json
from dataclasses import replace

import numpy as np
from hypothesis import given

from chladni.apps.modes_document import modes_document
from chladni.modal.shapes.relative_motion import relative_motion
from chladni.modal.shapes.validation import validate
from chladni.signals.geometry import Geometry
from chladni.signals.machine_harmonic import MachineHarmonic
from tests import strategies as ours
from tests.modal.mode_makers import mode_set
from tests.modal.shapes.test_joint_treatment import GEOMETRY, scaled_modes
from tests.modal.shapes.test_validation import REFERENCE, SOUND, fit_of, spread_of

CONTRACT = {"frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std", "mpc", "shape", "relative_motion"}


def test_the_contract() -> None:
    modes = mode_set([[1.0, 0.5 + 0.25j]], names=("/a.x", "/b.x"))
    document = modes_document(modes, validate(modes), relative_motion(modes, Geometry()))
    assert document["format"] == "chladni.modes/1"
    assert document["fit_error"] is None
    (mode,) = document["modes"]
    assert set(mode) >= CONTRACT
    assert (mode["frequency_hz"], mode["damping_ratio"]) == (10.0, 0.01)
    assert (mode["frequency_std_hz"], mode["damping_std"]) == (0.001, 1e-4)
    shape = [{key: one[key] for key in ("channel", "real", "imag")} for one in mode["shape"]]
    assert shape == [
        {"channel": "/a.x", "real": 1.0, "imag": 0.0},
        {"channel": "/b.x", "real": 0.5, "imag": 0.25},
    ]
    (joint,) = mode["relative_motion"]
    assert joint["between"] == ["/a.x", "/b.x"]
    np.testing.assert_allclose(joint["ratio"], abs(0.5 - 0.25j))


def test_what_else_a_program_can_read() -> None:
    fit = fit_of([0.1, 0.2, 0.3], [0.1, 0.2])
    modes = mode_set(
        SOUND, references=REFERENCE, participation=np.array([[1j], [2.0]]), fit=fit, spread=spread_of([9, 12]),
        harmonics=(MachineHarmonic(frequency_hz=50.0, reason="kurtosis"),),
    )  # fmt: skip
    document = modes_document(modes, validate(modes))
    assert document["fit_error"] == 0.3
    assert document["function_errors"][2] == {"response": "c2", "reference": "hammer", "error": 0.3}
    assert document["band_errors"][1] == {"low_hz": 15.0, "high_hz": 25.0, "error": 0.2}
    assert document["harmonics"] == [{"frequency_hz": 50.0, "reason": "kurtosis"}]
    assert document["modes"][1]["orders"] == 12
    assert document["modes"][0]["participation"] == [{"reference": "hammer", "real": 0.0, "imag": 1.0}]
    assert document["modes"][0]["modal_mass"] is None
    assert document["modes"][0]["shape"][1]["real_std"] == 0.001
    assert len(document["auto_mac"]) == 2
    assert document["findings"] == list(validate(modes).findings)


def test_scaled_modes_carry_their_mass_and_the_joint_to_treat() -> None:
    modes = scaled_modes()
    document = modes_document(modes, validate(modes), relative_motion(modes, GEOMETRY))
    assert document["scale"] == {"response": "/wrist.a", "reference": "hammer"}
    assert document["modes"][0]["modal_mass"] == modes.scale.modal_mass[0]  # type: ignore[union-attr]
    assert document["modes"][0]["modal_a"]["imag"] > 0
    assert [one["mode"] for one in document["treatments"]] == [0, 1, 2, 3]
    assert all(one["damper_n_s_m"] > 0 for one in document["treatments"])
    assert document["modes"][0]["relative_motion"][0]["damping_gain_per_n_s_m"] > 0


def test_unknown_numbers_are_null() -> None:
    modes = mode_set([[1.0, 0.5]])
    modes = replace(
        modes,
        frequency_std_hz=np.array([np.nan]),
        damping_std=np.array([np.inf]),
        shape_std=np.array([[0j, np.nan * (1 + 1j)]]),
    )
    (mode,) = modes_document(modes, validate(modes), relative_motion(modes, Geometry()))["modes"]
    assert mode["frequency_std_hz"] is None
    assert mode["damping_std"] is None
    assert mode["shape"][1]["real_std"] is None
    assert mode["relative_motion"][0]["ratio_std"] is None


@given(ours.mode_sets(), ours.geometries())
def test_any_modes_give_strict_json(modes, geometry) -> None:  # type: ignore[no-untyped-def]
    document = modes_document(modes, validate(modes), relative_motion(modes, geometry))
    assert json.loads(json.dumps(document, allow_nan=False)) == document
