"""The report while it is computed: progress, what is known so far, the end; nothing else, to nobody else."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from compass_ros.errors import ConfigError
from compass_ros.reporting import write_report, write_result
from compass_ros.reporting.live import HOST, LiveReport
from compass_ros.types import Progress, Result, silent
from test.conftest import Run

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_cell"


def ask(live: LiveReport | int, path: str, method: str = "GET", host: str = "") -> tuple[int, bytes, dict[str, str]]:
    port = live if isinstance(live, int) else live.port
    connection = http.client.HTTPConnection(HOST, port, timeout=20)
    connection.request(method, path, headers={"Host": host or f"localhost:{port}"})
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content, dict(answer.getheaders())


def write(folder: Path, result: Result) -> None:
    write_report(result, folder / "report.html")
    write_result(result, folder / "result.json")


def test_progress_then_what_is_known_then_the_end(tmp_path: Path, result: Result) -> None:
    with LiveReport(tmp_path, 0, computing=True) as live:
        report = live.beside(silent)
        assert ask(live, "/report.html")[0] == 404
        assert report(Progress("calibrate", 3, 0.25, 0.125, float("nan")))
        state = json.loads(ask(live, "/state.json")[1])
        assert (state["stage"], state["done"], state["gap"], state["report"]) == ("calibrate", 0.25, 0.125, None)
        write(tmp_path, result)
        state = json.loads(ask(live, "/state.json")[1])
        assert state["report"] is not None
        assert not state["ended"]
        assert ask(live, "/report.html?1")[1] == (tmp_path / "report.html").read_bytes()
        live.end()
        state = json.loads(ask(live, "/state.json")[1])
        assert (state["stage"], state["done"], state["ended"]) == ("done", 1.0, True)
    with pytest.raises(ConnectionRefusedError):
        ask(live, "/")


def test_a_browser_that_watches_gets_the_last_report(tmp_path: Path, result: Result) -> None:
    """It asks for it after the end; nobody waits for a browser that was never there."""
    with LiveReport(tmp_path, 0, computing=True) as live:
        write(tmp_path, result)
        ask(live, "/state.json")
        live.end()
        got: list[int] = []
        late = threading.Timer(0.5, lambda: got.append(ask(live, "/report.html")[0]))
        late.start()
    late.join()
    assert got == [200]
    begun = time.monotonic()
    with LiveReport(tmp_path, 0, computing=True) as live:
        live.end()
    assert time.monotonic() - begun < 3


def test_the_server_ends_when_the_last_report_has_arrived_whole(tmp_path: Path, result: Result) -> None:
    """More than a socket holds, read slowly: a process that ended before would cut it off."""
    size, arrived, outlived = 64 << 20, 0, threading.Event()

    def slowly() -> None:
        nonlocal arrived
        connection = http.client.HTTPConnection(HOST, live.port, timeout=20)
        connection.request("GET", "/report.html", headers={"Host": f"localhost:{live.port}"})
        answer = connection.getresponse()
        outlived.wait(0.5)  # a server that does not wait ends in this time
        while piece := answer.read(1 << 16):
            arrived += len(piece)

    with LiveReport(tmp_path, 0, computing=True) as live:
        (tmp_path / "report.html").write_bytes(b" " * size)
        write_result(result, tmp_path / "result.json")
        ask(live, "/state.json")
        live.end()
        reader = threading.Thread(target=slowly)
        reader.start()
    when_ended = arrived
    outlived.set()
    reader.join()
    assert when_ended > size // 2
    assert arrived == size


def test_an_earlier_result_is_not_what_is_computed_now(tmp_path: Path, result: Result) -> None:
    write(tmp_path, result)
    with LiveReport(tmp_path, 0, computing=True) as live:
        assert json.loads(ask(live, "/state.json")[1])["report"] is None
        assert ask(live, "/result.json")[0] == 404
    with LiveReport(tmp_path, 0, computing=False) as live:
        assert ask(live, "/result.json")[0] == 200


def test_nothing_else_is_served_and_to_nobody_else(tmp_path: Path, result: Result) -> None:
    folder = tmp_path / "<b>out"
    write(folder, result)
    (tmp_path / "secret").write_text("secret")
    (folder / "notes.txt").write_text("secret")
    with LiveReport(folder, 0, computing=False) as live:
        for path in (
            "/../secret",
            "/%2e%2e/secret",
            "/notes.txt",
            "//etc/passwd",
            "/report.html/../notes.txt",
            "/result.json/",
        ):
            assert ask(live, path)[0] == 404, path
        for host in ("evil.example", f"evil.example:{live.port}", "localhost", f"[::1]:{live.port}"):
            assert ask(live, "/state.json", host=host)[0] == 403, host
        assert [ask(live, "/", method)[0] for method in ("POST", "PUT", "DELETE", "OPTIONS")] == [501] * 4
        status, page, headers = ask(live, "/")
        assert status == 200
        assert b"<b>out" not in page
        assert "Access-Control-Allow-Origin" not in headers
        assert headers["Cache-Control"] == "no-store"
        assert ask(live, "/", "HEAD")[1] == b""
        with pytest.raises(ConfigError, match=f"port {live.port}: cannot be served"):
            LiveReport(folder, live.port, computing=False)


def test_a_folder_that_is_not_there_is_one_line(tmp_path: Path, run: Run) -> None:
    status, out, err = run("report", tmp_path / "none", "--serve", "0")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "expected the folder of a result" in err


def test_a_watched_folder_is_served_until_the_process_is_interrupted(tmp_path: Path, result: Result) -> None:
    words = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"  # shells take it from background jobs
    )
    command = [sys.executable, "-c", f"{words}; from compass_ros.cli import main; main()"]
    with subprocess.Popen(
        [*command, "report", str(tmp_path), "--serve", "0"], stderr=subprocess.PIPE, text=True
    ) as one:
        try:
            assert one.stderr is not None
            port = int(one.stderr.readline().split("localhost:")[1].split("/")[0])
            assert json.loads(ask(port, "/state.json")[1])["report"] is None
            write(tmp_path, result)
            assert json.loads(ask(port, "/state.json")[1])["report"] is not None
            one.send_signal(signal.SIGINT)
            assert one.wait(20) == 0
            assert one.stderr.read() == ""
        finally:
            one.kill()


@pytest.mark.slow
def test_a_calibration_is_watched_to_its_end(tmp_path: Path) -> None:
    bags = [str(EXAMPLE / "bags" / f"swing_{i}") for i in (1, 2)]
    words = ["--cell", str(EXAMPLE / "pendulum.yaml"), "--out", str(tmp_path), "--serve", "0", "--no-discover"]
    command = [sys.executable, "-m", "compass_ros.cli", "calibrate", *words, "--progress", "none", *bags]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ}) as process:
        assert process.stderr is not None
        port = int(process.stderr.readline().split("localhost:")[1].split("/")[0])
        shares, state = [0.0], {"ended": False, "done": 0.0}
        while not state["ended"]:
            state = json.loads(ask(port, "/state.json")[1])
            shares.append(float(state["done"] or 0.0))
            time.sleep(0.1)
        assert shares == sorted(shares)
        assert ask(port, "/report.html")[0] == 200
        assert process.wait(30) == 0
