"""Whether two sets of noisy pictures have the same mean.

Each side is traced several times with different seeds; the spread of these is its noise, so nothing is assumed of it
but that tiles of pixels are about normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Side of a tile, pixels.
TILE = 8
# Tiles with less than this share of the mean radiance are not looked at: their noise is not normal.
FLOOR = 0.02


@dataclass(frozen=True)
class Verdict:
    """Two means beside each other."""

    ratio: Array
    """Mean colour of the first over that of the second."""
    error: Array
    """Standard error of the ratio."""
    z_squared: Array
    """Mean of z^2 over tiles, by colour: 1 if the means are the same."""
    z_squared_error: float
    """Standard deviation that z_squared has if the means are the same."""
    z_largest: float
    n_tiles: int
    rms: Array
    """Relative RMS difference of tiles, what noise makes of it taken out; 0 if that is more."""

    def z_of_ratio(self) -> float:
        return float(np.abs((self.ratio - 1.0) / self.error).max())

    def z_of_tiles(self) -> float:
        return float(((self.z_squared - 1.0) / self.z_squared_error).max())

    def agrees(self) -> bool:
        """4 standard errors each of the mean colour and of the mean z^2, 5 of any tile."""
        return self.z_of_ratio() < 4.0 and self.z_of_tiles() < 4.0 and self.z_largest < 5.0

    def __str__(self) -> str:
        ratio = " ".join(f"{r:.4f}+-{e:.4f}" for r, e in zip(self.ratio, self.error))
        z = " ".join(f"{x:.2f}" for x in self.z_squared)
        rms = " ".join(f"{100 * x:.2f}" for x in self.rms)
        return (
            f"ratio {ratio}; {self.n_tiles} tiles: mean z^2 {z} (1.00+-{self.z_squared_error:.2f}), "
            f"largest |z| {self.z_largest:.1f}; differ by {rms} % beyond noise"
        )


def tiles(pictures: Array, side: int = TILE) -> Array:
    """Means of tiles, [picture, tile, colour], of pictures [picture, row, column, colour]."""
    n, height, width, colours = pictures.shape
    parts = pictures.reshape(n, height // side, side, width // side, side, colours)
    return parts.mean((2, 4)).reshape(n, -1, colours)


def mean_and_square_error(values: Array) -> tuple[Array, Array]:
    """Over the first axis: mean, and the square of its standard error."""
    return values.mean(0), values.var(0, ddof=1) / len(values)


def compare(first: Array, second: Array) -> Verdict:
    """Pictures of the two sides, [picture, row, column, colour]."""
    a, b = tiles(first), tiles(second)
    (mean_a, square_a), (mean_b, square_b) = mean_and_square_error(a), mean_and_square_error(b)
    counts = mean_b.mean(-1) > FLOOR * mean_b.mean()
    mean_a, mean_b, square_a, square_b = [x[counts] for x in (mean_a, mean_b, square_a, square_b)]
    variance = square_a + square_b
    z = (mean_a - mean_b) / np.sqrt(np.maximum(variance, 1e-30))
    # z has Student's distribution; degrees of freedom by Welch and Satterthwaite.
    degrees = variance**2 / (square_a**2 / (len(a) - 1) + square_b**2 / (len(b) - 1))
    # To mean square 1.
    z_squared = z**2 * (degrees - 2.0) / degrees
    (all_a, all_square_a), (all_b, all_square_b) = [mean_and_square_error(x[:, counts].mean(1)) for x in (a, b)]
    ratio = all_a / all_b
    error = ratio * np.sqrt(all_square_a / all_a**2 + all_square_b / all_b**2)
    n = int(counts.sum())
    excess = ((mean_a - mean_b) ** 2 - variance).mean(0)
    return Verdict(
        ratio=ratio,
        error=error,
        z_squared=z_squared.mean(0),
        # Of the square of Student's z, kurtosis 3 + 6 / (degrees - 4), over n tiles.
        z_squared_error=float(np.sqrt((2.0 + 6.0 / (degrees.mean() - 4.0)) / n)),
        z_largest=float(np.sqrt(z_squared.max())),
        n_tiles=n,
        rms=np.sqrt(np.maximum(excess, 0.0)) / mean_b.mean(0),
    )
