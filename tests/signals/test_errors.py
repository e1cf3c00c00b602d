"""Errors with one message, and with several."""

import pickle

import pytest

from chladni.signals.errors import ChladniError, EstimateError, LogError, ModelError, SetupError


@pytest.mark.parametrize("kind", [LogError, SetupError, ModelError, EstimateError])
def test_several_mistakes_are_lines_and_stay_apart(kind: type[ChladniError]) -> None:
    error = kind("a.toml:1: a name with\na line feed", "a.toml:2: another")
    assert error.mistakes == ("a.toml:1: a name with\na line feed", "a.toml:2: another")
    assert str(error) == "a.toml:1: a name with\na line feed\na.toml:2: another"
    # As they come back from another process.
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301  # our own
    assert (type(copy), copy.mistakes) == (kind, error.mistakes)
    assert str(kind("one")) == "one"
