"""The one exception tree of chladni.

::

    ChladniError
    ├── LogError        a log or data file that can't be read, or a channel it doesn't hold
    ├── SetupError      a setup file, unit or option that says something impossible
    ├── ModelError      a model file or a model that can't be simulated
    └── EstimateError   a computation whose input can't give the estimate asked for

A message names the value, the rule and what to do; the command line prints it in one line and exits with 2.
"""


class ChladniError(Exception):
    """Base of every error that chladni raises on purpose.

    Parameters
    ----------
    mistakes
        A message; several where a file has several mistakes, each on a line of its own.
    """

    def __init__(self, *mistakes: str) -> None:
        super().__init__(*mistakes)

    @property
    def mistakes(self) -> tuple[str, ...]:
        """The messages, which may hold line feeds of names that they quote."""
        return self.args

    def __str__(self) -> str:
        """Give all messages, a line each."""
        return "\n".join(self.args)


class LogError(ChladniError):
    """A log or data file can't be read, or doesn't hold what was asked for."""


class SetupError(ChladniError):
    """A setup file, a unit or an option says something impossible."""


class ModelError(ChladniError):
    """A model file is wrong, or its model can't be simulated."""


class EstimateError(ChladniError):
    """The data given can't yield the estimate asked for."""
