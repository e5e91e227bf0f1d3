"""Pictures with the processor time that they took."""

from __future__ import annotations

import resource
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes import Work
from statistics_of import FLOOR, tiles

Array = NDArray[np.float64]

# Of each side, whose spread is the noise.
PICTURES = 12


@dataclass
class Timed:
    """Pictures and the processor time that they took."""

    pictures: Array
    core_seconds: float

    def seconds_to(self, error: float) -> float:
        """Core-seconds until tiles of the whole picture err by this share of their mean, by noise alone."""
        parts = tiles_of(self.pictures)
        share = parts.var(0, ddof=1).mean() / parts.mean() ** 2
        return float(share / error**2 * self.core_seconds / len(self.pictures))


def tiles_of(pictures: Array) -> Array:
    """Grey tiles of 8 x 8 pixels where there is hair, [picture, tile]; alpha is left out."""
    grey = tiles(pictures)[..., :3].mean(-1)
    return grey[:, grey.mean(0) > FLOOR * grey.mean()]


def used() -> float:
    """Processor time of this process and its children so far, seconds."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(part.ru_utime + part.ru_stime for part in usage)


def ours_of(work: Work, samples: int, seed: int = 0) -> dict[str, Timed]:
    """Layers of `reference`, each picture with its own seed; time without what a picture of one sample takes."""
    start = used()
    work.ours(seed, 1)
    overhead = used() - start
    start = used()
    pictures = [work.ours(seed + number, samples) for number in range(PICTURES)]
    seconds = used() - start - PICTURES * overhead
    return {name: Timed(np.array([picture[name] for picture in pictures]), seconds) for name in pictures[0]}
