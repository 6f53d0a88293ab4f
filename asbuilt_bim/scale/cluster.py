"""A Dask cluster as a pool: reached safely, checked before work is sent, and never waited for in silence."""

import contextlib
import ipaddress
import logging
import pkgutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from asbuilt_bim.errors import AsBuiltError, MissingExtraError, OptionError, OutputError
from asbuilt_bim.scale.fingerprint import measuring_identity

Job = TypeVar("Job")
Result = TypeVar("Result")

CONNECT_S = 10.0
WORKERS_S = 10.0
"""How long a cluster may be without any worker: Dask starts one anew in a few seconds."""
_CHATTY = ("distributed", "distributed.client", "distributed.core", "tornado", "tornado.application", "asyncio")
_KEPT = "What was measured so far is in the cache; run again, and only the rest is measured"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheduler:
    """Where a Dask scheduler listens, and how it is known to be the right one."""

    address: str
    tls_ca: str = ""
    tls_cert: str = ""
    tls_key: str = ""
    insecure: bool = False  # plain tcp to another machine: whoever stands between can run code here


@dataclass(slots=True, kw_only=True)
class Cluster:
    """A connected scheduler with at least one worker."""

    address: str
    client: Any
    executor: Executor
    size: int
    _seen_s: float = field(default_factory=time.monotonic)

    def check(self, cancelled: bool = False) -> None:
        """See that work still goes on there.

        Raises:
            OutputError: the scheduler is gone, or no worker has been there for `WORKERS_S`.
        """
        if cancelled or self.client.status != "running":
            raise OutputError(f"scheduler {self.address}: is gone; start it and its workers again. {_KEPT}")
        now = time.monotonic()
        if self.client.scheduler_info()["workers"]:
            self._seen_s = now
        elif now - self._seen_s > WORKERS_S:
            raise OutputError(
                f"scheduler {self.address}: its last worker is lost; start some: dask worker {self.address} "
                f"--nthreads 1. {_KEPT}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SameCode(Generic[Job, Result]):
    """Work that a worker does only with what measures on the machine that sent it: results are kept here."""

    work: Callable[[Job], Result]
    identity: dict[str, str]
    own: Callable[[], dict[str, str]] = measuring_identity

    def __call__(self, job: Job) -> Result:
        """Do the work.

        Raises:
            OutputError: this worker has other code, libraries or networks.
        """
        try:
            own = self.own()
        except AsBuiltError as problem:
            raise OutputError(f"a Dask worker lacks what this machine has: {problem}") from problem
        if other := [name for name, value in self.identity.items() if own.get(name) != value]:
            name = other[0]
            raise OutputError(
                f"a Dask worker has {name} {own.get(name, 'of none')}, this machine has {self.identity[name]}; install "
                "the same asbuilt-bim and libraries on all of them, and copy your networks to each"
            )
        return self.work(job)


@contextlib.contextmanager
def cluster(scheduler: Scheduler) -> Iterator[Cluster]:
    """Connect to a scheduler, and see that its workers can do the work.

    Raises:
        OptionError: the address is none, or plain tcp to another machine.
        MissingExtraError: Dask isn't installed.
        OutputError: the scheduler can't be reached, has no worker, or workers that can't do the work.
    """
    address = scheduler.address
    scheme = check_address(scheduler)
    try:
        import dask
        from distributed import Client
        from distributed.security import Security
    except ImportError as problem:
        raise MissingExtraError("--scheduler needs Dask, which isn't installed: pip install distributed") from problem
    for name in _CHATTY:  # what matters of it is said here
        logging.getLogger(name).setLevel(logging.CRITICAL)
    security = _security(scheduler, Security) if scheme == "tls" else None
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "10GB"}):  # photos are large
        try:
            client = Client(address, timeout=CONNECT_S, security=security)
        except (OSError, TimeoutError, ValueError, TypeError) as problem:
            raise OutputError(
                f"scheduler {address}: can't be reached ({problem}); is it running, is the port open?"
            ) from problem
        try:
            size = _ready(client, address)
            yield Cluster(address=address, client=client, executor=client.get_executor(pure=False), size=size)
        finally:
            with contextlib.suppress(Exception):  # a scheduler that is gone can't be taken leave of
                client.close(timeout=2.0)


def check_address(scheduler: Scheduler) -> str:
    """Return the protocol of a scheduler's address, "tcp" or "tls".

    Raises:
        OptionError: it is another, or tcp with TLS files or to another machine without leave.
    """
    scheme, found, place = scheduler.address.rpartition("://")
    scheme = scheme if found else "tcp"
    host, _, port = place.rpartition(":")
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if scheme not in ("tcp", "tls") or not host or "[" in host or not (port.isascii() and port.isdecimal()):
        said = scheduler.address or "''"
        raise OptionError(f"--scheduler {said}: is no address; write tcp://HOST:PORT or tls://HOST:PORT")
    if scheme == "tcp" and any((scheduler.tls_ca, scheduler.tls_cert, scheduler.tls_key)):
        raise OptionError(f"--scheduler {scheduler.address}: tcp takes no --tls files; write tls://{place}")
    if scheme == "tcp" and not _loopback(host) and not scheduler.insecure:
        raise OptionError(
            f"--scheduler {scheduler.address}: plain tcp to another machine lets anyone on the way run programs here. "
            "Use tls:// with --tls-ca, --tls-cert and --tls-key, or pass --insecure-scheduler in a network of your own"
        )
    return scheme


def _loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.casefold() == "localhost"


def _security(scheduler: Scheduler, make: Any) -> Any:
    """Return Dask's `Security` of the files that are named, else of those in Dask's own configuration."""
    files = {
        "tls_ca_file": scheduler.tls_ca, "tls_client_cert": scheduler.tls_cert, "tls_client_key": scheduler.tls_key
    }  # fmt: skip
    for option, file in zip(("--tls-ca", "--tls-cert", "--tls-key"), files.values(), strict=True):
        if file and not Path(file).is_file():
            raise OptionError(f"{option}: there is no file {file}; check the path")
    security = make(require_encryption=True, **{name: file for name, file in files.items() if file})
    if not security.tls_ca_file or not security.tls_client_cert:
        raise OptionError(
            f"--scheduler {scheduler.address}: tls needs --tls-ca, --tls-cert and --tls-key, or the same in Dask's "
            "configuration (distributed.comm.tls)"
        )
    try:
        security.get_connection_args("client")
    except OSError as problem:  # SSLError is one
        named = ", ".join(
            str(file) for file in (security.tls_ca_file, security.tls_client_cert, security.tls_client_key)
        )
        raise OptionError(
            f"--scheduler {scheduler.address}: {named} can't be used ({problem}); PEM files are expected: the "
            "authority's certificate, this machine's, and its own key"
        ) from problem
    return security


def _ready(client: Any, address: str) -> int:
    """Wait for a worker, and see that all have the package and one thread; return how many there are.

    Raises:
        OutputError: there is none, or one can't do the work.
    """
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError as problem:
        raise OutputError(
            f"scheduler {address}: has no worker; start some: dask worker {address} --nthreads 1"
        ) from problem
    threads = client.nthreads()
    for worker, count in threads.items():
        if count > 1:
            raise OutputError(
                f"worker {worker}: has {count} threads; start it with --nthreads 1, and more workers instead: threads "
                "would change the last digits"
            )
    found = client.run(pkgutil.resolve_name, "asbuilt_bim.version:__version__", on_error="return")
    for worker, version in found.items():
        if not isinstance(version, str):
            raise OutputError(
                f"worker {worker}: has no asbuilt-bim ({version}); install the same version there, with the same "
                "libraries"
            )
    return len(threads) or 1
