"""`jaxsph watch`: a page that follows a file, on this machine alone."""

import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.request

import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import Lattice
from jaxsph.cli import main
from jaxsph.io import TrajectoryWriter
from jaxsph.report.live import HOST, LivePage, server
from jaxsph.trajectory import Snapshot
from tests.docs.test_pages import ROOT
from tests.runs import random_run


def asked(address):
    with urllib.request.urlopen(address, timeout=30) as answer:
        return answer.read().decode()


def test_it_follows_a_run(tmp_path):
    scene = jaxsph.scenes.taylor_green(16, arrangement=Lattice())
    state = scene.state
    fields = map(np.asarray, (state.position, state.velocity, state.density, state.density))
    snapshot = Snapshot(*fields)
    live = LivePage(tmp_path / "t.h5", lambda: {"told": "this"}, seconds=0.5)
    with server(live) as serving:
        assert serving.server_address[0] == HOST == "127.0.0.1"
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        try:
            address = f"http://{HOST}:{serving.server_port}/"
            text = asked(address)
            assert "no such file" in text and 'content="0.5"' in text
            with TrajectoryWriter.create(tmp_path / "t.h5", scene) as writer:
                assert "nothing to draw yet" in asked(address)
                for k in range(2):
                    writer.append(k * 2, 0.04 * k, snapshot)
                    text = asked(address)
                    assert f"Snapshot {k + 1}, t = {0.04 * k:g} s" in text
                    assert "told" in text and text.count("<img") == 1
                    assert "http-equiv" in text and asked(address) == text  # drawn once
                writer.finish({"scene": scene.name})
            assert "http-equiv" not in asked(address)  # nothing more will come
            with pytest.raises(urllib.error.HTTPError, match="404"):
                asked(address + "etc")
        finally:
            serving.shutdown()
            thread.join()


def test_the_command_serves_until_it_is_interrupted(tmp_path):
    random_run(tmp_path / "t.h5", count=2)
    # tests that were started in the background pass on that interrupts are ignored
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    run = f"{heard}; import sys; from jaxsph.cli import main; sys.exit(main())"
    words = [sys.executable, "-c", run, "watch", "t.h5", "--fields", "vorticity"]
    running = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "PYTHONPATH": str(ROOT)})  # fmt: skip
    try:
        address = running.stdout.readline().split()[0]
        text = asked(address)
        assert "taylor-green" in text and "largest speed" in text and text.count("<img") == 1
    finally:
        running.send_signal(signal.SIGINT)
    assert running.wait(timeout=30) == 0


def test_a_port_that_is_taken_is_named(tmp_path, capsys):
    random_run(tmp_path / "t.h5", count=2)
    with socket.create_server((HOST, 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["watch", str(tmp_path / "t.h5"), "--port", port]) == 2
    assert f"--port: {port} cannot be had" in capsys.readouterr().err
