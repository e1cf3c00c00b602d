"""Kernels and their parts: right where they are called, compiled once, by numba's public interface alone."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import float64, int64

import chladni
from chladni.models.integrator import machine_code as compiling
from chladni.models.integrator.plane import BOOK, BookType, Integers2, Numbers1, Numbers3, book, opener


class Memory(NamedTuple):
    """Memory of the test's kernel."""

    values: Numbers1
    cube: Numbers3
    places: Integers2


_OPEN = opener(Memory)


@compiling.part_code
def squared(value):
    return value * value


@compiling.inlined_code
def halved_square(value):
    return 0.5 * squared(value)


@compiling.kernel(int64(BOOK, float64, int64))
def fill(book, value, count):
    (memory,) = _OPEN(book)
    for place in range(memory.values.size):
        memory.values[place] = halved_square(value + place) + squared(value - place)
    memory.cube[1, 2, 0] = count
    memory.places[0, 1] = memory.cube.shape[1]
    return memory.cube.size


def made():
    return Memory(np.zeros(5), np.zeros((2, 3, 4)), np.zeros((1, 2), dtype=np.int64))


def test_a_kernel_reads_and_writes_the_arrays_of_its_book():
    memory = made()
    words = book(memory)
    assert fill(words.ctypes.data, 3.0, 7) == 24
    expected = [0.5 * (3.0 + place) ** 2 + (3.0 - place) ** 2 for place in range(5)]
    np.testing.assert_array_equal(memory.values, expected)
    # A whole number becomes one of the array's kind, and lands in its row and nowhere else.
    assert np.argwhere(memory.cube).tolist() == [[1, 2, 0]]
    assert memory.cube[1, 2, 0] == 7.0
    assert memory.places.tolist() == [[0, 3]]


def test_a_kernel_has_one_address():
    assert fill.address == fill.address > 0


def test_another_version_of_the_sources_is_another_type():
    """numba keeps kernels on disk by their types: parts in other files count through that of the book."""
    assert BookType("one") == BookType("one")
    assert BookType("one") != BookType("other")


@pytest.mark.parametrize(
    "values", [np.zeros(5, dtype=np.float32).astype(np.int64), np.zeros((5, 1)), np.zeros(10)[::2]]
)
def test_an_array_that_the_kernel_would_misread_is_refused(values):
    with pytest.raises(TypeError, match="Memory"):
        book(made()._replace(values=values))


def test_only_numbas_public_modules_are_imported():
    found = set()
    for path in Path(chladni.__file__).parent.rglob("*.py"):
        found.update(re.findall(r"^\s*(?:from|import) (numba[\w.]*)", path.read_text(), re.MULTILINE))
    assert found <= {"numba", "numba.extending"}
