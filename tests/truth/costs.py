"""What an error costs: both path tracers and `render --converge` on a scene that all of them draw.

Errors are relative RMSEs of means over 4 x 4 pixels, against the truth of the same program, which costs nothing: that
of `reference` for both programs here. It is two independent halves A and B, so that its noise does not count: a
picture P has the squared error mean (P - A)(P - B) / mean A B.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from findings import FOUND
from scenes import Work, channels_of
from statistics_of import tiles
from timing import Timed, used

Array = NDArray[np.float64]

GOALS = (0.05, 0.03, 0.01)
# Side of what is averaged, pixels.
BLOCK = 4
# Samples per pixel that errors are measured at.
SAMPLES = (4, 16, 64, 256)
# Pictures of few samples are cheap and scatter more.
SEEDS = (2, 2, 2, 1)


@dataclass
class Curve:
    """Errors over core-seconds."""

    samples: Sequence[int]
    errors: list[float]
    core_seconds: list[float]
    """Of a whole picture."""

    def error_of_one(self) -> float:
        """Error of one sample if it falls as n^-1/2, fitted over all numbers."""
        return float(np.exp(np.mean(np.log(np.array(self.errors) * np.sqrt(self.samples)))))

    def seconds_of_one(self) -> float:
        """Core-seconds of one more sample."""
        return (self.core_seconds[-1] - self.core_seconds[0]) / (self.samples[-1] - self.samples[0])

    def start(self) -> float:
        """Core-seconds before the first sample: files, hierarchy, tables."""
        return self.core_seconds[0] - self.samples[0] * self.seconds_of_one()

    def exponent(self) -> float:
        return float(np.polyfit(np.log(self.samples), np.log(self.errors), 1)[0])

    def paths_to(self, goal: float) -> float:
        """Core-seconds of the samples alone to an error that falls as n^-1/2."""
        return (self.error_of_one() / goal) ** 2 * self.seconds_of_one()

    def read_off(self, goal: float) -> float | None:
        """Core-seconds of the whole picture to an error, between the two numbers of samples about it; none beyond those
        that were measured, and those of the first where that is good enough."""
        for k, (error, seconds) in enumerate(zip(self.errors, self.core_seconds)):
            if error > goal:
                continue
            if k == 0:
                return seconds
            before, less = self.errors[k - 1], self.core_seconds[k - 1]
            return float(less * (seconds / less) ** (np.log(before / goal) / np.log(before / error)))
        return None


class Truth:
    """By two independent halves of pictures [picture, row, column, rgb]."""

    def __init__(self, pictures: Array) -> None:
        half = len(pictures) // 2
        self.halves = [blocks(part.mean(0)) for part in (pictures[:half], pictures[half:])]
        self.square = float((self.halves[0] * self.halves[1]).mean())

    def mean_square(self, picture: Array) -> float:
        """Square of a picture's relative error; below 0 where noise says so."""
        a, b = [blocks(picture) - half for half in self.halves]
        return float((a * b).mean()) / self.square

    def noise(self) -> float:
        a, b = self.halves
        return float(np.sqrt((0.25 * (a - b) ** 2).mean() / self.square))


def blocks(picture: Array) -> Array:
    return tiles(picture[None], BLOCK)[0]


def curve_of(draw: Callable[[int, int], Array], truth: Truth) -> Curve:
    """Of what `draw` draws with a seed and a number of samples."""
    curve = Curve(SAMPLES, [], [])
    for n, seeds in zip(SAMPLES, SEEDS):
        before = used()
        pictures = [draw(7000 + seed, n) for seed in range(seeds)]
        curve.core_seconds.append((used() - before) / seeds)
        square = float(np.mean([truth.mean_square(picture) for picture in pictures]))
        if square <= 0.0:
            raise SystemExit(f"the truth's noise hides the error of {n} samples; it needs more")
        curve.errors.append(float(np.sqrt(square)))
    return curve


def converged(work: Work, seed: int, samples: int) -> Array:
    """`render --converge --map`, rgb."""
    out = work.at(".converged.exr")
    work.run(
        "render", work.at(".toml"), "--converge", "--map", work.at(".exr"), "--until", samples, "--seed", seed,
        "--backend", "cpu", "-o", out,
    )  # fmt: skip
    values = channels_of(out)
    os.remove(out)
    return np.stack([values[c] for c in "RGB"], -1)


def costs(work: Work, theirs: Callable[[int, int], Array], ours_truth: Timed, their_truth: Timed) -> None:
    """Prints and keeps what all three cost; `theirs` draws in Mitsuba."""
    ours, judge = Truth(ours_truth.pictures), Truth(their_truth.pictures[..., :3])
    # What is compiled anew for this scene is not counted.
    theirs(0, 1)
    curves = {
        "reference": curve_of(lambda seed, n: work.ours(seed, n)["total"], ours),
        "converge": curve_of(lambda seed, n: converged(work, seed, n), ours),
        "mitsuba": curve_of(theirs, judge),
    }
    name = work.scene.name
    FOUND[f"{name} costs"] = {key: asdict(curve) for key, curve in curves.items()}
    print(f"        {name}, total: noise of the truth {100 * ours.noise():.2f} % here, {100 * judge.noise():.2f} % Mitsuba")
    show(curves)


def show(curves: dict[str, Curve]) -> None:
    for key, curve in curves.items():
        points = zip(curve.samples, curve.errors, curve.core_seconds)
        print(f"        {key}: " + ", ".join(f"{n}: {100 * e:.2f} % {s:.2f} core-s" for n, e, s in points)
              + f"; n^{curve.exponent():.2f}, {curve.start():.2f} core-s before samples")  # fmt: skip
    reference, mitsuba = curves["reference"], curves["mitsuba"]
    for goal in GOALS:
        alone = [curve.paths_to(goal) for curve in (reference, mitsuba)]
        marks = ["" if min(curve.errors) <= goal else " by n^-1/2" for curve in (reference, mitsuba)]
        found = curves["converge"].read_off(goal)
        most = "at most " if curves["converge"].errors[0] <= goal else ""
        reached = "not reached" if found is None else f"{most}{found:.2f} core-s"
        print(f"        to {100 * goal:.0f} %: samples alone reference {alone[0]:.2f}{marks[0]}, Mitsuba {alone[1]:.2f}{marks[1]}, "
              f"ratio {alone[1] / alone[0]:.2f}; whole reference {alone[0] + reference.start():.2f}, "
              f"--converge {reached}", flush=True)  # fmt: skip
