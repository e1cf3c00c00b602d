"""Workers of Dask distributed: of this machine for one run, or of a scheduler that is told."""

import logging
import multiprocessing
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from chladni.signals.errors import SetupError

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

#: Gives a client of workers when there is something to do.
Connect = Callable[[], "AbstractContextManager[Client]"]
#: A scheduler that doesn't answer for so long isn't there.
CONNECT_S: Final = 20.0
LOOPBACK: Final = "127.0.0.1"
_BEFORE_WORKERS: Final = "distributed.nanny.pre-spawn-environ"
_METHOD: Final = "distributed.worker.multiprocessing-method"
#: What a worker works with, those among it that other modules import when they are first used.
_PRELOADED: Final = (
    "distributed.nanny", "distributed.worker", "distributed.comm.tcp", "pandas", "pyarrow.compute",
    "chladni.apps.study.work", "chladni.io.mcap_log", "chladni.io.file_log", "chladni.io.log_survey",
)  # fmt: skip
_LOGGERS: Final = ("distributed", "tornado", "asyncio")


@dataclass(frozen=True, slots=True, kw_only=True)
class Keys:
    """Files for TLS: who may work is who has a certificate of this authority.

    Attributes
    ----------
    authority, certificate, key
        PEM files; None leaves Dask's own configuration (``distributed.comm.tls``).
    """

    authority: Path | None = None
    certificate: Path | None = None
    key: Path | None = None


@contextmanager
def cluster(
    *, workers: int | None = None, scheduler: str | None = None, keys: Keys | None = None, dashboard: bool = False
) -> "Iterator[Client]":
    """Give a client of workers, which end with the block when they were begun here.

    Parameters
    ----------
    workers
        Processes of this machine; None for one a core.
    scheduler
        Address of a scheduler that runs already: ``tls://host:8786``; ``tcp://127.0.0.1:8786`` on this machine alone.
    keys
        For ``tls://``.
    dashboard
        Whether Dask's page of what the workers do is served, on 127.0.0.1.

    Raises
    ------
    SetupError
        When Dask isn't installed, options contradict each other, an address on another machine has no TLS, or no
        scheduler answers.
    """
    _require_dask()
    if scheduler is None:
        with _of_this_machine(workers, dashboard=dashboard) as client:
            yield client
        return
    if workers is not None or dashboard:
        what = "--workers" if workers is not None else "--dashboard"
        raise SetupError(f"{what} is for workers of this machine; --scheduler has its own, so leave one of them out")
    require_safe(scheduler)
    with _of_scheduler(scheduler, keys or Keys()) as client:
        yield client


def require_safe(scheduler: str) -> None:
    """Refuse an address that leaves this machine without TLS: whoever reaches a scheduler runs code on its workers.

    Examples
    --------
    >>> require_safe("tcp://127.0.0.1:8786")
    >>> require_safe("tcp://cluster:8786")
    Traceback (most recent call last):
    chladni.signals.errors.SetupError: --scheduler tcp://cluster:8786: leaves this machine without TLS, ...
    """
    parts = urlsplit(scheduler)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname:
        raise SetupError(f"--scheduler {scheduler:.100}: isn't of the form tls://HOST:PORT or tcp://127.0.0.1:PORT")
    if parts.scheme == "tcp" and not _is_this_machine(parts.hostname):
        raise SetupError(
            f"--scheduler {scheduler:.100}: leaves this machine without TLS, and whoever reaches a scheduler can run "
            "code on its workers; start it with --tls-ca-file, --tls-cert and --tls-key, and name it tls://HOST:PORT"
        )


def _is_this_machine(host: str) -> bool:
    with suppress(ValueError):
        return ip_address(host).is_loopback
    return host == "localhost"


def _require_dask() -> None:
    try:
        import distributed  # noqa: F401  # only whether it's there
    except ImportError:
        raise SetupError("studies run on Dask, which isn't installed; pip install 'chladni[cluster]'") from None


@contextmanager
def _of_this_machine(workers: int | None, *, dashboard: bool) -> "Iterator[Client]":
    from distributed import Client, LocalCluster

    count = cores() if workers is None else workers
    if count < 1:
        raise SetupError(f"--workers {count} must be at least 1")
    with (
        TemporaryDirectory(prefix="chladni-workers-", ignore_cleanup_errors=True) as folder,
        quiet(),
        settings(),
        _forked(),
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            host=LOOPBACK,
            security=_own_keys(),
            # Without a dashboard Dask serves its metrics all the same, and by itself to the whole network.
            dashboard_address=f"{LOOPBACK}:0",
            scheduler_kwargs={"dashboard": dashboard},
            local_directory=folder,
            silence_logs=False,
            # A log is bounded by its reader, not by half a machine.
            memory_limit=0,
        ) as local,
        Client(local) as client,
    ):
        yield client


@contextmanager
def _forked() -> "Iterator[None]":
    """Let workers be forks of one process that has imported all they work with, where the system has such.

    What they import takes seconds, which each worker that starts on its own takes again.
    """
    import dask

    if "forkserver" not in multiprocessing.get_all_start_methods():
        yield
        return
    from multiprocessing import forkserver

    multiprocessing.get_context("forkserver").set_forkserver_preload(list(_PRELOADED))
    # What has to be known before the first import is known by whoever imports.
    told = {name: str(value) for name, value in dask.config.get(_BEFORE_WORKERS).items()}
    before = {name: os.environ.get(name) for name in told}
    os.environ.update(told)
    try:
        forkserver.ensure_running()
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    with dask.config.set({_METHOD: "forkserver"}):
        yield


def _own_keys() -> "Security":
    """Make keys for this run alone: others who use this machine reach 127.0.0.1, too."""
    from distributed.security import Security

    try:
        return Security.temporary()
    except ImportError:
        raise SetupError(
            "keys are made by cryptography, which isn't installed; pip install 'chladni[cluster]'"
        ) from None


@contextmanager
def _of_scheduler(scheduler: str, keys: Keys) -> "Iterator[Client]":
    from distributed import Client
    from distributed.security import Security

    given = {
        "tls_ca_file": keys.authority, "tls_client_cert": keys.certificate, "tls_client_key": keys.key
    }  # fmt: skip
    encrypted = scheduler.startswith("tls://")
    told = {name: str(path) for name, path in given.items() if path is not None}
    if told and not encrypted:
        raise SetupError("--tls-ca, --tls-cert and --tls-key are for tls:// addresses; leave them out")
    security = Security(require_encryption=encrypted, **told)
    with quiet(), settings():
        try:
            client = Client(scheduler, security=security, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TypeError, ValueError, RuntimeError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise SetupError(f"--scheduler {scheduler}: doesn't answer: {why:.200}; is it running there?") from error
        with client:
            yield client


@contextmanager
def settings() -> "Iterator[None]":
    """Run Dask as studies do: what fails is told by them, and nothing watches that nobody looks at."""
    import dask
    import distributed  # noqa: F401  # brings its settings into those of dask

    with dask.config.set(
        {
            # A log that ends its worker is tried apart from those beside it, sooner.
            "distributed.scheduler.allowed-failures": 1,
            # A worker that ended is started again by its nanny. Dask's cluster would end the nanny for good when that
            # takes longer than 15 s, as it does on a busy machine.
            "distributed.deploy.lost-worker-timeout": "1h",
            "distributed.comm.timeouts.connect": f"{CONNECT_S:g}s",
            "distributed.admin.tick.limit": "1h",
            "distributed.diagnostics.nvml": False,
            # What watches for nobody takes a part of the cores that work: samples of the stack a hundred times a
            # second, a clock at fifty, copies that are looked for where each answer is in one place.
            "distributed.worker.profile.enabled": False,
            "distributed.admin.tick.interval": "1s",
            "distributed.admin.system-monitor.interval": "5s",
            "distributed.scheduler.active-memory-manager.start": False,
            "distributed.worker.memory.monitor-interval": "5s",
            # Workers say nothing either: they find this when they start.
            _BEFORE_WORKERS: {**dask.config.get(_BEFORE_WORKERS), "DASK_LOGGING__DISTRIBUTED": "critical"},
        }
    ):
        yield


@contextmanager
def quiet() -> Iterator[None]:
    """Let Dask's own words on lost workers and closed lines go nowhere: what is lost is told in ours."""
    before: dict[logging.Logger, tuple[list[logging.Handler], bool]] = {}
    # Dask gives some of its loggers handlers of their own: that of its root isn't all.
    for name in [*_LOGGERS, *logging.root.manager.loggerDict]:
        if name.partition(".")[0] in _LOGGERS:
            logger = logging.getLogger(name)
            before.setdefault(logger, (logger.handlers, logger.propagate))
            logger.handlers, logger.propagate = [logging.NullHandler()], False
    try:
        yield
    finally:
        for logger, (handlers, propagate) in before.items():
            logger.handlers, logger.propagate = handlers, propagate


def cores() -> int:
    """Give the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
