"""The fibre of `fibre.py` as a BSDF of Mitsuba 3, on the curves of a shape `linearcurve`."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fibre import Scattering

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


class FibreBsdf(mi.BSDF):
    """Properties: `scattering`, `strands`. The tangent is interpolated between a segment's ends, as Strandlight
    has it; Mitsuba's own is constant along a segment."""

    # What a scene takes through its dictionary are plain values only.
    scattering: Scattering
    strands: Strands

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.GlossyTransmission
        self.m_components = [flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
        self.m_flags = self.m_components[0]
        strands = FibreBsdf.strands
        self.fibre = FibreBsdf.scattering
        self.points = mi.Float(strands.points.astype(np.float32).ravel())
        self.tangents = mi.Float(strands.tangents().astype(np.float32).ravel())
        self.segments = mi.UInt32(strands.segments())

    def _frame(self, si: mi.SurfaceInteraction3f, active: mi.Bool) -> mi.Frame3f:
        """n of the frame is the tangent u; s and t are v and w."""
        first = dr.gather(mi.UInt32, self.segments, si.prim_index, active)
        a, b = [dr.gather(mi.Point3f, self.points, first + k, active) for k in (0, 1)]
        along = dr.dot(si.p - a, b - a) / dr.maximum(dr.squared_norm(b - a), 1e-20)
        at = dr.clip(along, 0.0, 1.0)
        u, v = [dr.gather(mi.Vector3f, self.tangents, first + k, active) for k in (0, 1)]
        return mi.Frame3f(dr.normalize(dr.lerp(u, v, at)))

    @staticmethod
    def _to_fibre(frame: mi.Frame3f, omega: mi.Vector3f) -> mi.Vector3f:
        local = frame.to_local(omega)
        return mi.Vector3f(local.z, local.x, local.y)

    def eval_pdf(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        frame = self._frame(si, active)
        eye, light = [self._to_fibre(frame, si.to_world(omega)) for omega in (si.wi, wo)]
        s, density = self.fibre.evaluate(light, eye)
        return dr.select(active, s, 0.0), dr.select(active, density, 0.0)

    def eval(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):  # type: ignore[no-untyped-def]
        frame = self._frame(si, active)
        eye = self._to_fibre(frame, si.to_world(si.wi))
        light, is_inside = self.fibre.sample(eye, sample1, sample2)
        s, density = self.fibre.evaluate(light, eye)
        valid = active & is_inside & (density > 0.0)
        bs = mi.BSDFSample3f()
        bs.wo = si.to_local(frame.to_world(mi.Vector3f(light.y, light.z, light.x)))
        bs.pdf = dr.select(valid, density, 0.0)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        return bs, dr.select(valid, s / dr.maximum(density, 1e-30), 0.0)

    def to_string(self) -> str:
        return f"FibreBsdf[{self.fibre.fibre}]"


mi.register_bsdf("strandlight_fibre", FibreBsdf)
