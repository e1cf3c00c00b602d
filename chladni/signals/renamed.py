"""Arguments that had another name: the old one works for one release, with a warning."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
ResultT = TypeVar("ResultT")


def renamed(**names: str) -> Callable[[Callable[P, ResultT]], Callable[P, ResultT]]:
    """Let a function take keywords under their old names, too.

    Parameters
    ----------
    names
        New name of each old one.

    Examples
    --------
    >>> @renamed(rate_hz="sample_rate_hz")
    ... def period_s(*, sample_rate_hz):
    ...     return 1 / sample_rate_hz
    >>> with warnings.catch_warnings(record=True, action="always") as told:
    ...     period_s(rate_hz=4.0), str(told[0].message)
    (0.25, 'period_s: rate_hz is now sample_rate_hz; the old name goes with the next release')
    """

    def decorate(function: Callable[P, ResultT]) -> Callable[P, ResultT]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> ResultT:
            for old in names.keys() & kwargs.keys():
                new = names[old]
                if new in kwargs:
                    raise TypeError(f"{function.__name__}: {old} and {new} are one argument; leave {old} out")
                told = f"{function.__name__}: {old} is now {new}; the old name goes with the next release"
                warnings.warn(told, DeprecationWarning, stacklevel=2)
                kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return call

    return decorate
