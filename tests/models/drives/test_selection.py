from dataclasses import replace

import numpy as np
import pytest

from chladni.models.core.compiled_model import GeneratedInput
from chladni.models.core.port import Terminal
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.selection import ChosenSignal, renamed, selected, signal_names
from chladni.signals.errors import ModelError
from tests.models.drives.oracles import named

KIND = DRIVES["pneumatic-motor"]


def compiled():
    return KIND.build(KIND.parameters.numbers(), KIND.choices({}))


def test_rows_and_columns_follow_the_choice():
    whole = compiled()
    found = selected(
        whole,
        [ChosenSignal(signal="load", channel="/press.force")],
        [ChosenSignal(signal="pressure_drop"), ChosenSignal(signal="displacement", channel="/axis.z")],
    )
    np.testing.assert_array_equal(found.b, whole.b[:, 1:])
    np.testing.assert_array_equal(found.c, whole.c[[3, 0]])
    np.testing.assert_array_equal(found.h, whole.h[[3, 0]])
    assert [terminal.channel for terminal in found.inputs] == ["/press.force"]
    assert [terminal.channel for terminal in found.outputs] == [None, "/axis.z"]
    assert found.ports == whole.ports


def test_what_belongs_to_a_signal_moves_with_it():
    def twice(samples, sample_rate_hz):
        return 2 * samples

    whole = replace(
        compiled(), input_maps=((0, twice), (1, twice)), output_maps=((2, twice), (0, twice)),
        input_delays_s=(0.1, 0.2), output_offsets_s=(0.0, 0.1, 0.2, 0.3),
    )  # fmt: skip
    found = selected(
        whole, [ChosenSignal(signal="load")], [ChosenSignal(signal=s) for s in ("acceleration", "velocity")]
    )
    assert found.input_maps == ((0, twice),)
    assert found.output_maps == ((0, twice),)
    assert found.input_delays_s == (0.2,)
    assert found.output_offsets_s == (0.2, 0.1)


def test_inputs_with_derivatives_keep_their_columns_and_computed_inputs_stay():
    whole = compiled()
    columns = np.arange(15.0).reshape(3, 5)
    ports = len(whole.ports)
    shaker = GeneratedInput(terminal=Terminal(name="floor", unit="m/s^2"), samples=np.zeros_like)
    wide = replace(
        whole, b=columns, d=np.zeros((4, 5)), displacement_column=np.zeros((ports, 5)),
        velocity_column=np.zeros((ports, 5)), generated=(shaker,),
        inputs=(whole.inputs[0], replace(whole.inputs[1], derivatives=2)),
    )  # fmt: skip
    found = selected(wide, [ChosenSignal(signal="load")], [ChosenSignal(signal="velocity")])
    np.testing.assert_array_equal(found.b, columns[:, 1:])
    assert selected(wide, [ChosenSignal(signal="flow")], []).b.tolist() == columns[:, [0, 4]].tolist()


def test_names_change_at_terminals_and_their_ports():
    found = renamed(compiled(), {"flow": "valve", "velocity": "speed"})
    assert named(found.inputs) == ["valve", "load"]
    assert "speed" in named(found.outputs)
    assert [port.name for port in found.ports] == ["piston", "axis", "load", "valve"]


@pytest.mark.parametrize("name", ["piston", "load", "axis", "displacement"])
def test_a_name_that_is_taken_is_refused(name):
    with pytest.raises(ModelError, match=f"name '{name}' is used twice"):
        renamed(compiled(), {"flow": name})


def test_a_signal_that_is_not_there_is_told_with_those_there_are():
    with pytest.raises(ModelError, match="no input 'reference'; inputs: flow, load"):
        selected(compiled(), [ChosenSignal(signal="reference")], [])


def test_a_signal_without_a_name_keeps_its_word():
    chosen = (ChosenSignal(signal="flow"), ChosenSignal(signal="load", name="press"))
    assert signal_names(chosen) == {"flow": "flow", "load": "press"}
