"""Comparison of values in tests: structure exactly, numbers within a stated tolerance."""

from dataclasses import fields
from typing import Any

import numpy as np

from chladni.signals.provenance import Provenance
from chladni.signals.value import Value


def assert_close(actual: Value, expected: Value, *, rtol: float, atol: float = 0.0) -> None:
    """Raise `AssertionError` unless two values agree.

    Types, channels, shapes, booleans and strings must be equal; floating point numbers agree within
    ``atol + rtol * abs(expected)``, NaN with NaN. Provenance may differ: two ways to the same numbers are the usual
    reason to compare.
    """
    if type(actual) is not type(expected):
        raise AssertionError(f"{type(actual).__name__} is no {type(expected).__name__}")
    for field in fields(expected):  # type: ignore[arg-type]  # every final Value is a dataclass
        found, wanted = getattr(actual, field.name), getattr(expected, field.name)
        _assert_field(f"{type(expected).__name__}.{field.name}", found, wanted, rtol, atol)


def _assert_field(name: str, found: Any, wanted: Any, rtol: float, atol: float) -> None:
    if isinstance(wanted, Provenance):
        return
    if isinstance(wanted, Value) and isinstance(found, Value):
        assert_close(found, wanted, rtol=rtol, atol=atol)
        return
    if isinstance(wanted, np.ndarray) != isinstance(found, np.ndarray):
        raise AssertionError(f"{name}: {found!r} is not {wanted!r}")
    if isinstance(wanted, np.ndarray) and wanted.dtype.kind in "fc":
        np.testing.assert_allclose(found, wanted, rtol=rtol, atol=atol, err_msg=name)
    elif isinstance(wanted, np.ndarray):
        np.testing.assert_array_equal(found, wanted, err_msg=name)
    elif isinstance(wanted, float) and isinstance(found, float):
        np.testing.assert_allclose(found, wanted, rtol=rtol, atol=atol, err_msg=name)
    elif found != wanted:
        raise AssertionError(f"{name}: {found!r} is not {wanted!r}")
