"""Parts of kernels: right where they are called, and machine code nowhere else."""

import pytest
from numba import float64, int64

from chladni.models.integrator import machine_code as compiling


@compiling.part_code
def squared(value):
    return value * value


@compiling.inlined_code
def halved_square(value):
    return 0.5 * squared(value)


def powers(value, count):
    total = 0.0
    for power in range(count):
        total += halved_square(value + power) + squared(value - power)
    return total


@pytest.fixture(scope="module")
def kernel():
    # A kernel that is found on disk compiles no part.
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(compiling, "CACHED", False)
        made = compiling.machine_code(powers)
    compiling.make_ready(made, float64(float64, int64))
    return made


def library_of(part):
    return next(iter(part.overloads.values())).library


def test_a_kernel_computes_with_its_parts(kernel):
    expected = sum(0.5 * (3.0 + power) ** 2 + (3.0 - power) ** 2 for power in range(5))
    assert kernel(3.0, 5) == expected


@pytest.mark.parametrize("part", [squared, halved_square])
def test_a_part_is_no_machine_code_of_its_own(kernel, part):
    library = library_of(part)
    (name,) = [each.name for each in library.get_defined_functions() if part.__name__ in each.name]
    assert library.get_pointer_to_function(name) == 0


def test_an_inlined_part_leaves_no_call(kernel):
    text = kernel.inspect_llvm(kernel.signatures[0])
    calls = [line for line in text.splitlines() if "call" in line]
    assert not [line for line in calls if "halved_square" in line]
