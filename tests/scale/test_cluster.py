"""A Dask cluster is reached safely, and whatever is wrong with it is a message within half a minute."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner

from asbuilt_bim.cli import app
from asbuilt_bim.errors import OptionError, OutputError
from asbuilt_bim.scale import cluster as cluster_module
from asbuilt_bim.scale.cluster import SameCode, Scheduler, check_address
from asbuilt_bim.scale.executor import run_jobs
from asbuilt_bim.scale.fingerprint import measuring_identity
from tests.project_folder import write_project

DASK = pytest.mark.skipif(find_spec("distributed") is None, reason="needs pip install distributed")
ROOT = str(Path(__file__).parents[2])


def slow_square(number: int) -> int:
    time.sleep(0.5)
    return number * number


@pytest.mark.parametrize("address", ["tcp://10.0.0.7:8786", "cluster.example:8786", "tcp://[2001:db8::1]:8786"])
def test_plain_tcp_to_another_machine_needs_leave(address: str) -> None:
    with pytest.raises(OptionError, match=r"plain tcp to another machine.*Use tls://.*--insecure-scheduler"):
        check_address(Scheduler(address=address))
    assert check_address(Scheduler(address=address, insecure=True)) == "tcp"


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:8786", "localhost:8786", "tcp://[::1]:8786"])
def test_plain_tcp_to_this_machine_needs_none(address: str) -> None:
    assert check_address(Scheduler(address=address)) == "tcp"


@pytest.mark.parametrize(
    "address", ["", "tcp://", "ucx://10.0.0.7:8786", "tcp://host", "tcp://host:port", "tcp://[x:1"]
)
def test_what_is_no_address_is_named(address: str) -> None:
    with pytest.raises(OptionError, match="is no address; write tcp://HOST:PORT or tls://HOST:PORT"):
        check_address(Scheduler(address=address))


def test_tls_files_beside_plain_tcp_are_refused_since_nothing_would_be_encrypted() -> None:
    with pytest.raises(OptionError, match=r"tcp takes no --tls files; write tls://localhost:8786"):
        check_address(Scheduler(address="tcp://localhost:8786", tls_ca=Path("ca.pem")))


def test_an_empty_scheduler_is_refused_and_not_measured_without_one(tmp_path: Path) -> None:
    """As an empty variable of the shell gives it."""
    folder = write_project(tmp_path)
    told = CliRunner().invoke(app, ["run", str(folder), "--out", str(tmp_path / "out"), "--scheduler", ""])
    assert told.exit_code == 2 and "--scheduler '': is no address" in told.output


def test_a_worker_with_other_libraries_does_no_work() -> None:
    assert SameCode(work=abs, identity=measuring_identity())(-3) == 3
    with pytest.raises(OutputError, match=r"a Dask worker has numpy .*, this machine has 0\.1; install the same"):
        SameCode(work=abs, identity={**measuring_identity(), "numpy": "0.1"})(-3)


@DASK
def test_tls_without_certificates_says_which_options_name_them(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="tls needs --tls-ca, --tls-cert and --tls-key"):
        list(run_jobs(abs, [1], scheduler=Scheduler(address="tls://10.0.0.7:8786")))
    missing = Scheduler(address="tls://10.0.0.7:8786", tls_ca=str(tmp_path / "ca.pem"))
    with pytest.raises(OptionError, match=r"--tls-ca: there is no file .*ca\.pem"):
        list(run_jobs(abs, [1], scheduler=missing))


@DASK
def test_files_that_are_no_certificates_are_named_before_a_scheduler_is_looked_for(tmp_path: Path) -> None:
    named = {option: str(tmp_path / f"{option}.pem") for option in ("tls_ca", "tls_cert", "tls_key")}
    for file in named.values():
        Path(file).write_text("no certificate", encoding="utf-8")
    with pytest.raises(OptionError, match=r"tls_ca\.pem.*can't be used.*its own key"):
        list(run_jobs(abs, [1], scheduler=Scheduler(address="tls://10.0.0.7:8786", **named)))


@DASK
def test_a_scheduler_that_is_not_there_is_named() -> None:
    with pytest.raises(OutputError, match=r"can't be reached .*is it running, is the port open"):
        list(run_jobs(abs, [1], scheduler=Scheduler(address=f"tcp://127.0.0.1:{_free_port()}")))


@DASK
def test_a_cluster_without_workers_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "WORKERS_S", 2.0)
    with _scheduler() as (_, address), pytest.raises(OutputError, match="has no worker; start some: dask worker"):
        list(run_jobs(abs, [1], scheduler=Scheduler(address=address)))


@DASK
@pytest.mark.parametrize(("lost", "says"), [("workers", "its last worker is lost"), ("scheduler", "is gone; start it")])
def test_what_was_done_is_given_before_the_cluster_is_lost(
    lost: str, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "WORKERS_S", 4.0)
    with _scheduler() as (scheduler, address), _workers(address, 2) as workers:
        found = run_jobs(slow_square, range(60), scheduler=Scheduler(address=address))
        first = [next(found).result for _ in range(3)]
        for process in workers if lost == "workers" else [scheduler]:
            process.kill()
        begun = time.monotonic()
        with pytest.raises(OutputError, match=rf"{says}.*in the cache; run again"):
            list(found)
        assert time.monotonic() - begun < 30.0
    assert set(first) <= {n * n for n in range(60)}


@DASK
def test_a_worker_that_is_lost_costs_nothing_while_another_works() -> None:
    with _scheduler() as (_, address), _workers(address, 2) as workers:
        found = run_jobs(slow_square, range(8), scheduler=Scheduler(address=address))
        first = next(found)
        workers[0].kill()
        results = {done.job: done.result for done in [first, *found]}
    assert results == {n: n * n for n in range(8)}


@DASK
def test_a_worker_with_several_threads_is_refused() -> None:
    said = pytest.raises(OutputError, match="has 2 threads; start it with --nthreads 1")
    with _scheduler() as (_, address), _workers(address, 1, threads=2), said:
        list(run_jobs(abs, [1], scheduler=Scheduler(address=address)))


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _dask(*words: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join([ROOT, os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", *words], env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip


@contextmanager
def _scheduler() -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    port = _free_port()
    words = ["--host", "127.0.0.1", "--port", str(port), "--dashboard-address", ":0"]
    with _ended(_dask("distributed.cli.dask_scheduler", *words)) as process:
        late = time.monotonic() + 60.0
        while time.monotonic() < late:
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
                break
            time.sleep(0.2)
        yield process, f"tcp://127.0.0.1:{port}"


@contextmanager
def _workers(address: str, count: int, threads: int = 1) -> Iterator[list[subprocess.Popen[bytes]]]:
    words = ["distributed.cli.dask_worker", address, "--nthreads", str(threads), "--no-nanny", "--no-dashboard"]
    from distributed import Client

    with ExitStack() as stack:
        processes = [stack.enter_context(_ended(_dask(*words))) for _ in range(count)]
        with Client(address) as client:
            client.wait_for_workers(count, timeout=90.0)
        yield processes


@contextmanager
def _ended(process: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    with process:
        try:
            yield process
        finally:
            process.kill()
