"""The fibre of `fibre.py` as a BSDF of Mitsuba 3, on the curves of a shape `linearcurve`."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from fibre import Scattering
from strands import Strands


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
