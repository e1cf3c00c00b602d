"""Where values are drawn and made into tables: modules above this floor, named by the façade, imported when used."""

from importlib import import_module
from typing import Any

_MODULES: dict[str, str] = {}


def register(**modules: str) -> None:
    """Name the module that holds each function which values call, such as ``plot``."""
    _MODULES.update(modules)


def outlet(name: str) -> Any:
    """Give the function of that name, from the module that was registered for it."""
    return getattr(import_module(_MODULES[name]), name)
