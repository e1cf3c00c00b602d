"""rerun's viewer without a window, bound to loopback, for pictures in tests."""

import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun_cli
from rerun.experimental import ViewerClient

EXECUTABLE = Path(rerun_cli.__file__).parent / "rerun"
PATIENCE_S = 60.0


class HeadlessViewer:
    """A viewer that shows one file; pages are chosen by the name of their tab."""

    def __init__(self, client: ViewerClient) -> None:
        self.client = client

    def show(self, page: str) -> None:
        """Bring the container of that name to the front, and every tab around it."""
        blueprint = self.client.get_blueprint().blueprint
        containers = {
            path.strip("/"): content["ContainerBlueprint"]
            for path, content in blueprint.items()
            if "ContainerBlueprint" in content
        }
        chosen = next(path for path, content in containers.items() if content.get("display_name") == page)
        while True:
            parent = next((path for path, content in containers.items() if chosen in _contents(content)), None)
            if parent is None:
                break
            if containers[parent]["container_kind"] == "Tabs":
                containers[parent]["active_tab"] = chosen
            chosen = parent
        self.client.set_blueprint(blueprint, of="recording")

    def move(self, timeline: str, seconds: float) -> None:
        self.client.set_time(timeline, duration=seconds, play_state="paused")

    def picture(self, *, max_size: int | None = None) -> bytes:
        time.sleep(0.4)
        return self.client.take_screenshot(max_size=max_size)

    def views(self) -> list[Any]:
        return list(self.client.get_state().views)

    def complaints(self) -> list[str]:
        """Everything any view reports, and what the viewer logged above information."""
        reports = [f"{view.name}: {report.summary}" for view in self.views() for report in view.reports]
        logs = [entry.message for entry in self.client.get_logs() if entry.level != "INFO"]
        return reports + [message for message in logs if "oftware rasterizer" not in message]


def _contents(container: dict[str, Any]) -> list[str]:
    """Paths in a container; the viewer gives one alone as text, and after a change it puts a slash before each."""
    contents = container.get("contents", [])
    return [path.strip("/") for path in ([contents] if isinstance(contents, str) else contents)]


@contextmanager
def headless_viewer(path: Path) -> Iterator[HeadlessViewer]:
    """Open a file in a viewer of 1600 x 1000 points; raises RuntimeError when the viewer doesn't start."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", "1600x1000"]
    process = subprocess.Popen(
        [EXECUTABLE, *options, "--hide-welcome-screen", path], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    try:
        yield HeadlessViewer(_connected(process, port))
    finally:
        process.kill()
        process.communicate()


def _connected(process: "subprocess.Popen[bytes]", port: int) -> ViewerClient:
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if process.poll() is not None:
            raise RuntimeError(process.communicate()[1].decode()[-500:])
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
        except OSError:
            time.sleep(0.1)
            continue
        client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
        state = client.get_state()
        if state.views and not state.loading:
            return client
        time.sleep(0.2)
    raise RuntimeError(f"the viewer showed nothing within {PATIENCE_S} s")
