"""Devices, bench, threads, Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import swarmfit


def test_devices() -> None:
    devices = swarmfit.devices()
    assert {"cpu", "reference"} <= {d.backend for d in devices}
    cpu = next(d for d in devices if d.backend == "cpu")
    assert cpu.usable
    assert isinstance(cpu.limits, dict)
    assert "cpu" in repr(cpu)


def test_bench() -> None:
    rows: list[str] = []
    report = swarmfit.bench(
        backends=["cpu"], models=["plane"], points=[1000], particles=[64], seconds=0.01, progress=rows.append
    )
    assert len(report.rows) == len(rows) == 1
    row = report.rows[0]
    assert (row.backend, row.model, row.points, row.particles) == ("cpu", "plane", 1000, 64)
    assert row.evaluations_per_s > 0
    assert row.max_relative_error < 1e-3
    assert json.loads(report.to_json())
    cloud = np.random.default_rng(1).uniform(size=(500, 3))
    assert swarmfit.bench(backends=["cpu"], models=["plane"], particles=[64], seconds=0.01, cloud=cloud).rows[0].points == 500
    with pytest.raises(ValueError, match="seconds"):
        swarmfit.bench(seconds=-1)


def test_other_threads_run_meanwhile() -> None:
    points = np.random.default_rng(1).uniform(size=(200_000, 3)).astype(np.float32)
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    swarmfit.fit(points, "plane", threshold=0.2, backend="reference", max_models=1, time_budget_ms=300)
    seconds = time.monotonic() - start
    done.set()
    thread.join()
    assert ticks > 20 * seconds


def test_fits_side_by_side(corner: np.ndarray) -> None:
    counts: list[int] = []
    threads = [
        threading.Thread(target=lambda: counts.append(len(swarmfit.fit(corner, threshold=0.01).models))) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counts == [3, 3, 3, 3]


@pytest.mark.parametrize("how", ["fit(points, **o)", "fit(points, on_model=print, **o)", "find_models(points, **o).result()"])
def test_ctrl_c_stops_a_fit(how: str) -> None:
    # What runs in the background of a script starts with Ctrl-C ignored.
    program = f"""
import signal
import numpy as np, swarmfit
signal.signal(signal.SIGINT, signal.default_int_handler)
points = np.random.default_rng(1).uniform(size=(300_000, 3))
o = dict(model="sphere", threshold=0.05, backend="reference", stall=10**8, iterations=10**8)
print("go", flush=True)
swarmfit.{how}
"""
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        assert child.stdout.readline() == b"go\n"
        time.sleep(0.5)
        assert child.poll() is None, child.stderr.read()
        start = time.monotonic()
        child.send_signal(signal.SIGINT)
        try:
            child.wait(60)
        finally:
            child.kill()
        assert b"KeyboardInterrupt" in child.stderr.read()
        assert time.monotonic() - start < 30
