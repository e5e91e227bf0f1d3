"""The scenes of `scenes.py` in Mitsuba."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from bsdf import FibreBsdf
from fibre import Fibre, Scattering
from scenes import EYE, FOV_DEG, HEIGHT, TARGET, WIDTH, Hair, Work, pixel_directions

Array = NDArray[np.float64]

# How many nodes of Mitsuba's bilinear map stand for one pixel.
FINER = 12
DEG = np.pi / 180.0


def fibre_of(hair: Hair) -> Fibre:
    root = np.sqrt(2.0)
    return Fibre(
        eta=hair.eta,
        sigma_a=hair.sigma_a,
        shift=tuple(DEG * x for x in hair.shift_deg),
        width=tuple(root * DEG * x for x in hair.width_deg),
        caustic_width=float(root * DEG * hair.caustic_width_deg),
    )


def for_mitsuba(pixels: Array) -> Array:
    """The map as Mitsuba's `envmap` shows the same radiance: it interpolates between nodes, whose columns are at
    pixel centres and whose rows stand from pole to pole. So pixels become FINER x FINER steps; a row of nodes
    on the edge of two pixels has the mean of both, which keeps the area under the ramp."""
    height, width = pixels.shape[:2]
    n = height * FINER
    rows = np.arange(n + 1)
    above = np.clip((rows - 1) // FINER, 0, height - 1)
    below = np.clip(rows // FINER, 0, height - 1)
    columns = np.arange(width * FINER) // FINER
    return 0.5 * (pixels[above] + pixels[below])[:, columns]


class InMitsuba(Work):
    """A scene's files, and both renderers of it."""

    def scattering(self, **changes: Any) -> Scattering:
        """Of the scene's fibre, or of one with other parameters."""
        return Scattering(fibre_of(replace(self.scene.hair, **changes)))

    def mitsuba(self, scattering: Scattering) -> mi.Scene:
        """The same scene for Mitsuba, with this fibre."""
        FibreBsdf.scattering, FibreBsdf.strands = scattering, self.strands
        hair = {"type": "linearcurve", "filename": self.at(".txt"), "bsdf": {"type": "strandlight_fibre"}}
        return mi.load_dict(self._around(hair))

    def mitsuba_with_its_hair(self, bsdf: dict[str, Any]) -> mi.Scene:
        """The same scene with a material of Mitsuba's, on the B-splines it is meant for."""
        hair = {"type": "bsplinecurve", "filename": self.at(".spline.txt"), "bsdf": bsdf}
        return mi.load_dict(self._around(hair))

    def _around(self, hair: dict[str, Any]) -> dict[str, Any]:
        film = {
            "type": "hdrfilm",
            "width": WIDTH,
            "height": HEIGHT,
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        }
        sensor = {
            "type": "perspective",
            "fov": FOV_DEG,
            "fov_axis": "y",
            "near_clip": 1.0,
            "far_clip": 1000.0,
            "to_world": mi.ScalarTransform4f().look_at(origin=EYE, target=TARGET, up=[0, 1, 0]),
            "film": film,
            "sampler": {"type": "independent"},
        }
        map_of = mi.Bitmap(for_mitsuba(self.pixels).astype(np.float32))
        return {"type": "scene", "sensor": sensor, "light": {"type": "envmap", "bitmap": map_of}, "hair": hair}


def traced(scene: mi.Scene, max_depth: int, seed: int, samples: int) -> Array:
    """Path traced by Mitsuba, rgba; max_depth 2 is single scattering, -1 is all."""
    integrator = mi.load_dict({"type": "path", "max_depth": max_depth, "rr_depth": 8, "hide_emitters": True})
    return np.array(mi.render(scene, integrator=integrator, seed=seed, spp=samples)).astype(np.float64)


def energy_in_mitsuba(scene: mi.Scene, n: int = 4096) -> Array:
    """Integral over the sphere of Mitsuba's map, by a grid of n x n / 2 directions."""
    omega = pixel_directions(n, n // 2)
    si = dr.zeros(mi.SurfaceInteraction3f, n * n // 2)
    si.wi = -mi.Vector3f(np.ascontiguousarray(omega.reshape(-1, 3).T.astype(np.float32)))
    found = np.array(scene.environment().eval(si)).astype(np.float64)
    weight = np.repeat(np.cos(np.pi * (0.5 - (np.arange(n // 2) + 0.5) / (n // 2))), n)
    return found @ weight * (2.0 * np.pi / n) * (np.pi / (n // 2))
