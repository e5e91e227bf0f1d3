"""Roughnesses of the hair material of Chiang et al. 2016, which Mitsuba and Cycles have, for fibres of `scenes.py`."""

from __future__ import annotations

import numpy as np

from scenes import Hair

ROUGHNESS = np.linspace(0.0, 1.0, 100_001)


def longitudinal_roughness(hair: Hair) -> float:
    """For the same variance of R, TT and TRT along the fibre."""
    # Full-angle deviation of R; the variance of TT is a quarter, of TRT four times that of R, as in `hair`.
    deviation = 2.0 * np.radians(hair.width_deg[0])
    assert hair.width_deg == tuple(hair.width_deg[0] * x for x in (1.0, 0.5, 2.0))
    deviations = 0.726 * ROUGHNESS + 0.812 * ROUGHNESS**2 + 3.7 * ROUGHNESS**20
    return float(np.interp(deviation, deviations, ROUGHNESS))


def azimuthal_roughness(deviation_deg: float) -> float:
    """For this standard deviation of the logistic distribution."""
    s = np.sqrt(np.pi / 8.0) * (0.265 * ROUGHNESS + 1.194 * ROUGHNESS**2 + 5.372 * ROUGHNESS**22)
    return float(np.interp(np.radians(deviation_deg), s * np.pi / np.sqrt(3.0), ROUGHNESS))
