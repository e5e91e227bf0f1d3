"""Long work: progress, Ctrl+C, other threads, other processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import sky

import strandlight as sl


def long_work(progress=None):
    """Some 10 s on a core."""
    hair = {"eta": 1.55, "sigma_a": [0.2, 0.3, 0.5], "shift": {"r": -0.1, "tt": 0.05, "trt": 0.15},
            "width": {"r": 0.18, "tt": 0.09, "trt": 0.36}, "caustic_width": 0.1}
    light = {"theta": np.linspace(-1.5, 1.5, 10**6), "phi": 2.0, "lambda": 0.3}
    sl.probe("single", method="reference", mode="all", light=light, view={"theta": 0, "phi": 0.4}, hair=hair, progress=progress)


def test_progress_grows_to_1(folder):
    lights = sl.LightSet.open(folder / "sky.lights")
    groom = sl.Groom.open(folder / "bob.groom")
    for work in [
        lambda progress: sl.fit_lights(sky(), progress=progress),
        lambda progress: sl.render(groom=groom, lights=lights, width=400, height=300, progress=progress),
        lambda progress: sl.Groom.generate("curly", strands=2000, progress=progress),
    ]:
        shares, threads = [], set()

        def progress(share):
            shares.append(share)
            threads.add(threading.get_ident())

        work(progress)
        assert shares == sorted(shares) and shares[-1] == 1.0 and shares[0] >= 0
        assert threads == {threading.get_ident()}


def test_what_progress_raises_ends_the_work():
    def progress(share):
        raise RuntimeError("enough")

    start = time.monotonic()
    with pytest.raises(RuntimeError, match="enough"):
        long_work(progress)
    assert time.monotonic() - start < 30


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_the_work():
    # What is started in the background of a shell ignores the signal.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heed}; import test_work; print('go', flush=True); test_work.long_work()"
    here = os.path.dirname(__file__)
    child = subprocess.Popen(
        [sys.executable, "-c", code], cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "go\n"
    time.sleep(1.0)
    start = time.monotonic()
    child.send_signal(signal.SIGINT)
    _, error = child.communicate(timeout=60)
    assert time.monotonic() - start < 20
    assert "KeyboardInterrupt" in error and "panic" not in error, error
    assert child.returncode in (-signal.SIGINT, 1, 130)


def test_other_threads_run_meanwhile():
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    sl.fit_lights(sky(), count=40)
    end = time.monotonic()
    stop.set()
    thread.join()
    during = [at for at in ticks if start < at < end]
    assert len(during) > 5, "the lock was held"


def test_threads_work_side_by_side(folder):
    wanted = sl.LightSet.open(folder / "sky.lights")
    found = [None] * 4

    def fit(ix):
        found[ix] = sl.fit_lights(folder / "sky.exr", count=12)

    threads = [threading.Thread(target=fit, args=(ix,)) for ix in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert all(it == wanted for it in found)


def in_a_process(lights):
    return float(lights.evaluate([0, 1, 0])[0]), sl.fit_lights(sky(16), count=3)


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_processes_have_threads_of_their_own(folder, start):
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip("not on this system")
    lights = sl.LightSet.open(folder / "sky.lights")
    # The threads of this process are there: a forked one has none of them.
    lights.evaluate([0, 1, 0])
    with multiprocessing.get_context(start).Pool(1) as pool:
        value, fitted = pool.apply_async(in_a_process, (lights,)).get(timeout=120)
    assert value == lights.evaluate([0, 1, 0])[0]
    assert fitted == sl.fit_lights(sky(16), count=3)
    with pytest.raises(sl.Error) as found:
        with multiprocessing.get_context(start).Pool(1) as pool:
            pool.apply_async(sl.LightSet.open, ("not/there.lights",)).get(timeout=120)
    assert found.value.kind == "io" and found.value.path == "not/there.lights"
