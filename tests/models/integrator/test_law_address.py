"""Laws become machine code once, and kernels stay as they are."""

import math

import pytest

from chladni.models.integrator import march as kernel
from chladni.models.integrator.integrator import integrate
from chladni.models.integrator.machine_code import law_address
from chladni.signals.errors import ModelError
from tests.models.integrator import systems
from tests.models.integrator.systems import compiled_structure, law, oscillator
from tests.models.integrator.test_march import two_tones


def written_by_a_user(d, s, t, parameters, state, rates):
    return parameters[0] * math.sinh(d / parameters[1])


def not_for_machines(d, s, t, parameters, state, rates):
    return {"force": d}["force"] + open("/dev/null")  # noqa: PTH123


def test_a_law_is_compiled_once():
    assert law_address(systems.cubic) == law_address(systems.cubic)
    assert law_address(systems.cubic) != law_address(systems.coulomb)


def test_a_law_of_ones_own_does_not_compile_a_kernel_again():
    known = set()
    for function in (systems.cubic, written_by_a_user):
        integrate(
            compiled_structure(oscillator(), force_at="body", laws=(law(0, function, 1e3, 0.1),)),
            two_tones(50, 500.0), 500.0,
        )  # fmt: skip
        known.add(kernel.march.address)
    assert len(known) == 1


def test_a_law_typed_into_a_shell_works_too():
    names = {}
    exec("def typed(d, s, t, parameters, state, rates):\n    return 2.0 * d\n", names)  # noqa: S102
    assert law_address(names["typed"]) > 0


def test_a_law_that_can_not_be_compiled_is_told():
    with pytest.raises(ModelError, match="law 'not_for_machines' can't be compiled"):
        law_address(not_for_machines)
