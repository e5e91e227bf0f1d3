"""Strands as polylines, and their text as Mitsuba and Strandlight read it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Strands:
    """Polylines: points in cm, [n, 3], and the number of points of each strand."""

    def __init__(self, points: Array, lengths: list[int], radius: float) -> None:
        self.points = points
        self.lengths = lengths
        self.radius = radius

    @staticmethod
    def read(file: str) -> Strands:
        """Of a text of curves of Mitsuba's: `x y z radius`, an empty line between curves."""
        with open(file, encoding="utf-8") as text:
            curves = [np.loadtxt(curve.splitlines(), ndmin=2) for curve in text.read().split("\n\n") if curve.strip()]
        rows = np.concatenate(curves)
        radius = float(rows[0, 3])
        assert np.all(rows[:, 3] == rows[0, 3]), "one radius for all"
        return Strands(rows[:, :3], [len(curve) for curve in curves], radius)

    def smooth(self, times: int, radius: float) -> Strands:
        """With corners cut (Chaikin), each time to half their turn; of another radius."""
        smooth = self.strands()
        for _ in range(times):
            smooth = [cut_corners(points) for points in smooth]
        return Strands(np.concatenate(smooth), [len(points) for points in smooth], radius)

    def strands(self) -> list[Array]:
        return np.split(self.points, np.cumsum(self.lengths)[:-1])

    def tangents(self) -> Array:
        """Unit tangents at the points, root to tip: the mean of the directions of the two segments that meet,
        or that of the only one."""
        found = []
        for points in self.strands():
            way = np.diff(points, axis=0)
            way /= np.linalg.norm(way, axis=1, keepdims=True)
            ends = np.concatenate([way[:1], way[:-1] + way[1:], way[-1:]])
            found.append(ends / np.linalg.norm(ends, axis=1, keepdims=True))
        return np.concatenate(found)

    def segments(self) -> NDArray[np.uint32]:
        """First point of each segment, in the order of Mitsuba's primitives."""
        starts = np.cumsum([0, *self.lengths[:-1]])
        return np.concatenate([start + np.arange(n - 1) for start, n in zip(starts, self.lengths)]).astype(np.uint32)

    def write(self, file: str, phantom_ends: bool = False) -> None:
        """As text of curves, polylines as the first line says to Strandlight. `phantom_ends` puts a control point
        beyond each end instead, so that a uniform B-spline begins and ends where the polyline does."""
        note = "" if phantom_ends else " # linearcurve"
        with open(file, "w", encoding="utf-8") as text:
            for points in self.strands():
                if phantom_ends:
                    points = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
                rows = [f"{x:.9g} {y:.9g} {z:.9g} {self.radius:.9g}\n" for x, y, z in points]
                rows[0] = rows[0].replace("\n", note + "\n")
                text.write("".join(rows) + "\n")
                note = ""


def cut_corners(points: Array) -> Array:
    """Points at a quarter and three quarters of each segment, and both ends."""
    a, b = points[:-1], points[1:]
    cut = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], 1).reshape(-1, 3)
    return np.concatenate([points[:1], cut[1:-1], points[-1:]])
