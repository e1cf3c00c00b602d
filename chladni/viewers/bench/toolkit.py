"""The one place that loads Panel and Bokeh and sets what the bench needs of them."""

from importlib import import_module
from importlib.util import find_spec

from chladni.signals.errors import SetupError

#: Panel gathers the changes of a knob for so long before it tells of them. Its own 50 ms can be felt; with 1 ms each
#: key press is told alone, and a burst of them waits in a line.
DEBOUNCE_MS = 10
_DEBOUNCE = "_debounce"


def load_toolkit() -> None:
    """Import Panel and Bokeh; `SetupError` that says how to install them when they are missing."""
    missing = [name for name in ("panel", "bokeh") if find_spec(name) is None]
    if missing:
        raise SetupError(
            f"the bench needs {' and '.join(missing)}, which this installation lacks; pip install 'chladni[bench]'"
        )
    import_module("panel")
    # Panel loads it when a page first asks for it, which is too late for that page's list of scripts.
    import_module("panel.models.file_dropper")
    # Places for charts that aren't there yet are no mistake.
    validation = import_module("bokeh.core.validation")
    validation.silence(import_module("bokeh.core.validation.warnings").EMPTY_LAYOUT, True)
    setattr(import_module("panel.reactive").Syncable, _DEBOUNCE, DEBOUNCE_MS)
