"""When Panel is loaded, and what is said when it can't be."""

import importlib.util
import subprocess
import sys
from typing import Any

import pytest

from chladni.signals.errors import ChladniError
from chladni.viewers.bench import instrument_panel, serve
from chladni.viewers.bench.toolkit import DEBOUNCE_MS, load_toolkit
from tests.viewers.bench.stand_in import OSCILLATOR, tools


def test_importing_the_room_and_the_command_loads_neither_panel_nor_bokeh() -> None:
    code = (
        "import sys, chladni.viewers.bench, chladni.viewers.bench.tools, chladni.cli.bench, chladni.apps.bench;"
        "print([name for name in ('panel', 'bokeh', 'tornado') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_the_command_needs_no_numpy_to_be_listed() -> None:
    code = "import sys, chladni.cli.bench; print('numpy' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


@pytest.mark.parametrize("missing", [("panel",), ("panel", "bokeh")])
def test_what_to_install_is_said_in_one_line(monkeypatch: pytest.MonkeyPatch, missing: tuple[str, ...]) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        "chladni.viewers.bench.toolkit.find_spec", lambda name: None if name in missing else find(name)
    )
    for start in (lambda: serve([OSCILLATOR], tools()), lambda: instrument_panel(OSCILLATOR, tools())):
        with pytest.raises(ChladniError) as caught:
            start()
        assert str(caught.value).endswith("; pip install 'chladni[bench]'")
        assert " and ".join(missing) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_knobs_are_told_of_after_ten_milliseconds() -> None:
    load_toolkit()
    from panel.reactive import Syncable
    from panel.widgets import FloatSlider

    assert Syncable._debounce == FloatSlider._debounce == DEBOUNCE_MS == 10


def test_ten_milliseconds_is_what_a_served_page_waits() -> None:
    """The seam is Panel's own: a change of a served widget waits for `_debounce` milliseconds, and no longer."""
    load_toolkit()
    import panel as pn
    from bokeh.document import Document

    waits: list[int] = []
    document: Any = Document()
    slider = pn.widgets.FloatSlider(start=0, end=1)
    model = slider.get_root(document)
    document._session_context = lambda: "served"
    document.add_timeout_callback = lambda _, milliseconds: waits.append(milliseconds)
    slider._server_change(document, model.ref["id"], None, "value", 0.0, 0.5)
    assert waits == [10]
