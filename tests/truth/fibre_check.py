"""The fibre of `fibre.py` against `strandlight probe --method reference`, and against itself.

Each is another way to the same number: the probe integrates over the offset h in double precision and never
looks for roots; `fibre.py` has the roots in closed form, in single precision, and a table.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fibre import Fibre, Scattering, moments, section

Array = NDArray[np.float64]
Check = Callable[[bool, str], None]

MODES = ("R", "TT", "TRT")
# Width of the light that the probe is asked about: S hardly changes across it.
LAMBDA = 0.03
QUERIES = 100
# Relative to the value, or to this share of the mode's largest where the value is less: the table of TRT is
# as good as its peak, not as its tails.
TOLERANCE, FLOOR = 2e-4, 1e-2


def random_fibre(rng: np.random.Generator) -> Fibre:
    """Ordinary hair of all kinds."""
    sigma = rng.uniform(0.02, 1.0, 3)
    width = rng.uniform(0.07, 0.3)
    return Fibre(
        eta=float(rng.uniform(1.45, 1.65)),
        sigma_a=(float(sigma[0]), float(sigma[1]), float(sigma[2])),
        shift=tuple(rng.uniform(-0.2, 0.2, 3).tolist()),
        width=(float(width), float(0.5 * width), float(2.0 * width)),
        caustic_width=float(rng.uniform(0.1, 0.3)),
    )


def as_json(fibre: Fibre) -> dict[str, Any]:
    """As the probe takes it."""
    names = [mode.lower() for mode in MODES]
    return {
        "eta": fibre.eta,
        "sigma_a": fibre.sigma_a,
        "shift": dict(zip(names, fibre.shift)),
        "width": dict(zip(names, fibre.width)),
        "caustic_width": fibre.caustic_width,
        "eccentricity": 1.0,
    }


def ask(strandlight: str, queries: list[dict[str, Any]]) -> Array:
    """What the probe answers, [query, colour]."""
    lines = "".join(json.dumps(query) + "\n" for query in queries)
    command = [strandlight, "probe", "--method", "reference"]
    run = subprocess.run(command, input=lines, capture_output=True, text=True, check=True)
    answers = [json.loads(line) for line in run.stdout.splitlines()]
    assert len(answers) == len(queries) and all("value" in answer for answer in answers), answers[:1]
    return np.array([np.broadcast_to(answer["value"], 3) for answer in answers])


def direction(theta: Array, phi: Array) -> Array:
    """In the fibre's frame, last axis u, v, w."""
    return np.stack([np.sin(theta), np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi)], -1)


def to_mitsuba(omega: Array) -> mi.Vector3f:
    return mi.Vector3f(np.ascontiguousarray(omega.reshape(-1, 3).T.astype(np.float32)))


def lit_by(scattering: Scattering, axis: Array, eye: Array, n_radial: int, n_turn: int) -> Array:
    """Integral of S cos theta_i under the light exp(2 (omega . axis - 1) / LAMBDA^2), [query, colour]."""
    # t = 1 - cos of the angle to the axis, where the light is exp(-2 t / LAMBDA^2).
    x, w = np.polynomial.legendre.leggauss(n_radial)
    t_most = 9.0 * LAMBDA**2
    t, w = 0.5 * t_most * (x + 1.0), 0.5 * t_most * w
    turn = 2.0 * np.pi * (np.arange(n_turn) + 0.5) / n_turn
    helper = np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    a = np.cross(axis, helper)
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(axis, a)
    around = a[:, None] * np.cos(turn)[:, None] + b[:, None] * np.sin(turn)[:, None]
    sin = np.sqrt(t * (2.0 - t))
    omega = axis[:, None, None] * (1 - t)[:, None, None] + around[:, None] * sin[:, None, None]
    weight = np.repeat(w * np.exp(-2.0 * t / LAMBDA**2) * 2.0 * np.pi / n_turn, n_turn)
    eyes = np.repeat(eye, n_radial * n_turn, axis=0)
    s, _ = scattering.evaluate(to_mitsuba(omega), to_mitsuba(eyes))
    return np.einsum("cqk,k->qc", np.array(s).reshape(3, len(axis), -1), weight)


def check_probe(strandlight: str, check: Check) -> None:
    """S of each mode at random directions of light and eye, of two fibres."""
    rng = np.random.default_rng(5)
    for number in range(2):
        fibre = random_fibre(rng)
        theta = rng.uniform(-1.1, 1.1, (2, QUERIES))
        # Near the lobes, where there is something to compare.
        theta[1] = np.clip(-theta[0] + rng.normal(0.0, 0.25, QUERIES), -1.3, 1.3)
        phi = rng.uniform(-np.pi, np.pi, (2, QUERIES))
        light, eye = direction(theta[0], phi[0]), direction(theta[1], phi[1])
        for ix, mode in enumerate(MODES):
            one = Scattering(fibre, modes=(ix == 0, ix == 1, ix == 2))
            query = {"q": "single", "mode": mode, "hair": as_json(fibre)}
            queries = [
                query | {"light": {"theta": a, "phi": b, "lambda": LAMBDA}, "view": {"theta": c, "phi": d}}
                for a, b, c, d in zip(theta[0], phi[0], theta[1], phi[1])
            ]
            # R has a kink at phi = pi, which takes a finer rule.
            nodes = (96, 288) if mode == "R" else (48, 96)
            expected, found = ask(strandlight, queries), lit_by(one, light, eye, *nodes)
            off = np.abs(found - expected) / np.maximum(expected, FLOOR * expected.max())
            looked_at = off[expected > FLOOR * expected.max()]
            check(
                bool(off.max() < TOLERANCE and len(looked_at) >= QUERIES // 3),
                f"fibre {number}, {mode}: S at {off.size} values is off the probe's by {off.max():.1e} at most, "
                f"{np.median(looked_at):.1e} in the median of {len(looked_at)}",
            )
        error = Scattering(fibre).trt.worst_error()
        check(error < 1e-4, f"fibre {number}: the table of TRT is off by {error:.1e} of its peak at most")


def albedo(fibre: Fibre, theta_o: float) -> Array:
    """Int S cos theta_i over all directions, in double precision, by moments."""
    n = 400
    theta_i = np.pi * ((np.arange(n) + 0.5) / n - 0.5)
    theta_d = 0.5 * (theta_o - theta_i)
    found = np.zeros(3)
    for p in range(3):
        x = (theta_i + theta_o - 2.0 * fibre.shift[p]) / (2.0 * fibre.width[p])
        m = np.exp(-x * x) / (np.sqrt(np.pi) * 2.0 * fibre.width[p])
        # Int N dphi is twice 1/2 Int_0^1 A dh of the moments, which are of both halves already.
        share = m * (np.cos(theta_i) / np.cos(theta_d)) ** 2
        found += np.pi / n * share @ moments(fibre, p, theta_d, 0)[:, 0]
    return found


def check_itself(fibre: Fibre, check: Check, n_draws: int = 1 << 22) -> None:
    """What is drawn by `sample` integrates S to its albedo, and `evaluate` has the density of the draws."""
    scattering = Scattering(fibre)
    assert np.all(section(fibre, np.zeros(1))[0] == fibre.eta)
    for theta_o in (-0.9, 0.0, 0.5, 1.2):
        eye = mi.Vector3f(*direction(np.array(theta_o), np.array(0.7)).tolist())
        random = mi.PCG32(n_draws, initstate=3)
        u, v = random.next_float32(), mi.Point2f(random.next_float32(), random.next_float32())
        light, is_inside = scattering.sample(eye, u, v)
        s, density = scattering.evaluate(light, eye)
        weight = np.array(dr.select(is_inside, s / density, 0.0), dtype=np.float64)
        mean, deviation = weight.mean(1), weight.std(1) / np.sqrt(n_draws)
        expected = albedo(fibre, theta_o)
        z = np.abs(mean - expected) / (deviation + 1e-5 * expected)
        check(bool(z.max() < 4.0), f"albedo at {theta_o}: {mean.round(5)} of draws, {expected.round(5)} by quadrature")
        # Draws by density as the draws claim, in cells: evenly drawn directions against those drawn.
        even = direction(np.arcsin(np.array(random.next_float32()) * 2.0 - 1.0), np.array(random.next_float32()) * 2 * np.pi)
        _, of_even = scattering.evaluate(to_mitsuba(even), eye)
        expected_in, drawn_in = cells(even), cells(np.array(light).T[np.array(is_inside)])
        claimed = np.array(of_even, dtype=np.float64) * 4.0 * np.pi
        mass = np.bincount(expected_in, claimed, minlength=CELLS) / n_draws
        square = np.bincount(expected_in, claimed**2, minlength=CELLS) / n_draws
        drawn = np.bincount(drawn_in, minlength=CELLS) / n_draws
        enough = drawn * n_draws > 100
        z = (drawn - mass)[enough] / np.sqrt((drawn + square - mass**2)[enough] / n_draws)
        check(
            bool(np.abs(z).max() < 5.0 and 0.7 < (z**2).mean() < 1.4),
            f"draws at {theta_o}: mean z^2 {(z**2).mean():.2f}, largest |z| {np.abs(z).max():.1f} in {enough.sum()} cells",
        )


CELLS = 16 * 24


def cells(omega: Array) -> NDArray[np.int64]:
    """Which of 16 x 24 cells of equal solid angle around u a direction lies in."""
    across = np.clip((omega[:, 0] + 1.0) * 8.0, 0, 15).astype(np.int64)
    around = np.clip((np.arctan2(omega[:, 2], omega[:, 1]) / np.pi + 1.0) * 12.0, 0, 23).astype(np.int64)
    return across * 24 + around
