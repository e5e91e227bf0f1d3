"""A hair fibre's scattering function, written anew from the formulas of the documentation
(docs/book/src/theory/model.md and conventions.md); nothing here calls Strandlight.

Marschner et al. 2003 with the modes R, TT, TRT:

    S(omega_i, omega_o) = sum_t M_t(theta_i, theta_o) N_t(theta_d, phi) / cos^2 theta_d

Angles are radians; widths are Xu's, sqrt(2) times a standard deviation; sigma_a is per fibre radius. `_i` is
towards the light, `_o` towards the eye, as in Strandlight: Mitsuba's `wi` is the eye.

R and TT have closed forms. TRT, blurred by a circular Gaussian, is a table over theta_d and phi made by
quadrature in double precision; `TrtTable.worst_error` measures what its interpolation adds.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Nodes of the table of TRT over theta_d in 0..pi/2 and phi in 0..pi.
N_THETA, N_PHI = 1024, 2048
# Cosines of theta below this are grazing: both M and what arrives there are next to nothing.
MIN_COS = 1e-4


@dataclass(frozen=True)
class Fibre:
    """Parameters of a fibre; the order of modes is R, TT, TRT."""

    eta: float
    sigma_a: tuple[float, float, float]
    shift: tuple[float, float, float]
    """alpha_t, radians: one event shifts the inclination by twice this."""
    width: tuple[float, float, float]
    """beta_t, radians, Xu's: one event widens the inclination by twice this."""
    caustic_width: float
    """w_c, radians, Xu's."""


# Double precision, of NumPy: for the table, and for checks of what Mitsuba computes.


def fresnel_f64(cosine: Array, eta: float) -> Array:
    """Unpolarised dielectric reflectance at the cosine of incidence."""
    q = np.sqrt(eta * eta - 1.0 + cosine * cosine)
    s = (cosine - q) / (cosine + q)
    p = (eta * eta * cosine - q) / (eta * eta * cosine + q)
    return 0.5 * (s * s + p * p)


def section(fibre: Fibre, theta_d: Array) -> tuple[Array, Array]:
    """eta_eff, and sigma_eff with a last axis of colours, at the difference angle theta_d."""
    sin, cos = np.sin(theta_d), np.maximum(np.cos(theta_d), MIN_COS)
    eta_eff = np.sqrt(fibre.eta**2 - sin**2) / cos
    sigma_eff = np.array(fibre.sigma_a) / np.sqrt(1.0 - (sin / fibre.eta) ** 2)[..., None]
    return eta_eff, sigma_eff


def moments(fibre: Fibre, p: int, theta_d: Array, orders: int, nodes: int = 400) -> Array:
    """m_n = 1/2 Int_-1^1 A_p(h) cos(n phi(p, h)) dh for n in 0..orders, [theta_d, n, colour].

    With these N_p convolved with any even function of azimuth is a sum of cosines, without roots of
    phi(p, h). The substitution h = sin gamma makes the integrand smooth.
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    # A_p is even in gamma, and cos(n phi) as well.
    gamma_i = 0.25 * np.pi * (x + 1.0)
    weight = 0.25 * np.pi * w * np.cos(gamma_i)
    h = np.sin(gamma_i)
    found = np.empty((len(theta_d), orders + 1, 3))
    eta_eff, sigma_eff = section(fibre, theta_d)
    for ix, theta in enumerate(theta_d):
        sin_t = h / eta_eff[ix]
        crossing = np.exp(-2.0 * sigma_eff[ix] * np.sqrt(1.0 - sin_t**2)[:, None])
        f = fresnel_f64(np.cos(theta) * np.cos(gamma_i), fibre.eta)[:, None]
        share = [f + 0.0 * crossing, (1 - f) ** 2 * crossing, (1 - f) ** 2 * f * crossing**2][p]
        phi = 2 * p * np.arcsin(sin_t) - 2 * gamma_i + p * np.pi
        cosines = np.cos(np.arange(orders + 1)[:, None] * phi)
        found[ix] = cosines @ (weight[:, None] * share)
    return found


def blur_of(width: float, orders: int) -> Array:
    """Fourier coefficients of the normalised circular Gaussian exp(2 (cos x - 1) / width^2)."""
    x = 2.0 * np.pi * np.arange(4096) / 4096
    kernel = np.exp(2.0 * (np.cos(x) - 1.0) / width**2)
    return np.array([kernel @ np.cos(n * x) for n in range(orders + 1)]) / kernel.sum()


class TrtTable:
    """N_TRT blurred by w_c, at theta_d and phi, bilinear between nodes."""

    def __init__(self, fibre: Fibre) -> None:
        self.fibre = fibre
        # Coefficients of the blur fall as exp(-(n w_c / 2)^2).
        self.orders = int(np.ceil(11.0 / fibre.caustic_width))
        self.blur = blur_of(fibre.caustic_width, self.orders)
        theta_d = np.linspace(0.0, 0.5 * np.pi, N_THETA)
        phi = np.linspace(0.0, np.pi, N_PHI)
        self.values = self.exact(theta_d, phi)
        self.texture = mi.Texture2f(
            mi.TensorXf(self.values.astype(np.float32)),
            filter_mode=dr.FilterMode.Linear,
            wrap_mode=dr.WrapMode.Clamp,
        )

    def exact(self, theta_d: Array, phi: Array) -> Array:
        """By quadrature, [theta_d, phi, colour]."""
        coefficients = moments(self.fibre, 2, theta_d, self.orders) * self.blur[:, None]
        coefficients[:, 1:] *= 2.0
        cosines = np.cos(phi[:, None] * np.arange(self.orders + 1)) / (2.0 * np.pi)
        return np.einsum("pn,tnc->tpc", cosines, coefficients)

    def worst_error(self, n: int = 101) -> float:
        """Largest error of the texture at n x n places off its nodes, relative to the peak over phi
        at the same theta_d."""
        theta_d = (np.arange(n) + 0.381966) / n * 1.5
        phi = (np.arange(n) + 0.618034) / n * np.pi
        grid = np.meshgrid(theta_d, phi, indexing="ij")
        found = np.array(self.at(*[mi.Float(x.ravel().astype(np.float32)) for x in grid]))
        exact = self.exact(theta_d, phi)
        off = np.abs(found.T.reshape(exact.shape) - exact)
        return float((off / exact.max(axis=1, keepdims=True)).max())

    def at(self, theta_d: mi.Float, phi: mi.Float) -> mi.Color3f:
        """Of any signs, phi wrapped to +-pi."""
        # Texel centres are half a texel inside.
        u = (dr.abs(phi) * ((N_PHI - 1) / np.pi) + 0.5) / N_PHI
        v = (dr.abs(theta_d) * ((N_THETA - 1) * 2.0 / np.pi) + 0.5) / N_THETA
        return mi.Color3f(self.texture.eval(mi.Point2f(u, v)))


# Single precision, compiled by Mitsuba.


def wrapped(phi: mi.Float) -> mi.Float:
    """An azimuth in +-pi."""
    return phi - dr.two_pi * dr.round(phi / dr.two_pi)


def gaussian(x: mi.Float, width: float) -> mi.Float:
    """Of unit mass; `width` is Xu's."""
    return dr.exp(-dr.square(x / width)) * float(1.0 / (np.sqrt(np.pi) * width))


def fresnel(cosine: mi.Float, eta: float) -> mi.Float:
    """As `fresnel_f64`."""
    q = dr.sqrt(eta * eta - 1.0 + cosine * cosine)
    s = (cosine - q) / (cosine + q)
    p = (eta * eta * cosine - q) / (eta * eta * cosine + q)
    return 0.5 * (s * s + p * p)


@dataclass
class Azimuths:
    """What R and TT need of theta_d and phi.

    With a = 1 / eta_eff, s = |sin(phi / 2)| for phi in 0..2 pi and D = 1 + a^2 - 2 a s, the root of TT has
    cos gamma_i = (s - a) / sqrt(D), cos gamma_t = (1 - a s) / sqrt(D), and
    1/2 |dphi/dh|^-1 = (1 - a s)(s - a) / (4 D^(3/2)); there is none where s < a.
    """

    cos_half: mi.Float
    """cos(phi / 2), phi in +-pi: the cosine of incidence of R in the cross section."""
    cos_i: mi.Float
    cos_t: mi.Float
    density: mi.Float
    """1/2 |dphi/dh|^-1 of TT, of unit mass over azimuths."""


def azimuths(eta: float, cos_d: mi.Float, sin_d: mi.Float, phi: mi.Float) -> Azimuths:
    """phi in +-pi."""
    a = cos_d / dr.sqrt(eta * eta - sin_d * sin_d)
    s = dr.abs(dr.sin(0.5 * phi))
    d = dr.maximum(1.0 + a * a - 2.0 * a * s, 1e-9)
    inverse = dr.rsqrt(d)
    is_met = s > a
    cos_i = dr.select(is_met, (s - a) * inverse, 0.0)
    cos_t = (1.0 - a * s) * inverse
    return Azimuths(dr.abs(dr.cos(0.5 * phi)), cos_i, cos_t, 0.25 * cos_i * cos_t * inverse)


class Scattering:
    """S of one fibre, and directions drawn by it; everything in the fibre's frame (u, v, w)."""

    def __init__(self, fibre: Fibre, modes: tuple[bool, bool, bool] = (True, True, True)) -> None:
        self.fibre = fibre
        self.modes = modes
        self.trt = TrtTable(fibre)
        energies = np.array([moments(fibre, p, np.zeros(1), 0)[0, 0].mean() for p in range(3)])
        # How often each mode is drawn: by energy, but none seldom.
        chances = np.where(modes, np.maximum(energies / energies.sum(), 0.1), 0.0)
        self.chances: list[float] = (chances / chances.sum()).tolist()

    def _longitudinal(self, theta_i: mi.Float, theta_o: mi.Float) -> list[mi.Float]:
        """M_t."""
        pairs = zip(self.fibre.shift, self.fibre.width)
        return [gaussian(theta_i + theta_o - 2.0 * shift, 2.0 * width) for shift, width in pairs]

    def evaluate(self, omega_i: mi.Vector3f, omega_o: mi.Vector3f) -> tuple[mi.Color3f, mi.Float]:
        """S cos theta_i, and the density per solid angle with which `sample` draws omega_i."""
        eta = self.fibre.eta
        theta_i, phi_i = angles(omega_i)
        theta_o, phi_o = angles(omega_o)
        phi = wrapped(phi_o - phi_i)
        theta_d = 0.5 * (theta_o - theta_i)
        sin_d, cos_d = dr.sincos(theta_d)
        cos_d = dr.maximum(cos_d, MIN_COS)
        cos_i = dr.maximum(dr.cos(theta_i), MIN_COS)
        at = azimuths(eta, cos_d, sin_d, phi)
        m = self._longitudinal(theta_i, theta_o)

        n_r = mi.Color3f(0.25 * at.cos_half * fresnel(cos_d * at.cos_half, eta))
        entering = dr.square(1.0 - fresnel(cos_d * at.cos_i, eta))
        absorbed = dr.rsqrt(1.0 - dr.square(sin_d / eta)) * at.cos_t * -2.0
        n_tt = at.density * entering * dr.exp(mi.Color3f(self.fibre.sigma_a) * absorbed)
        n_trt = self.trt.at(theta_d, phi)

        s, density = mi.Color3f(0.0), mi.Float(0.0)
        drawn = [0.25 * at.cos_half, at.density, mi.Float(0.5 / np.pi)]
        for m_t, n_t, azimuthal, chance, is_on in zip(m, [n_r, n_tt, n_trt], drawn, self.chances, self.modes):
            if is_on:
                s += m_t * n_t
                density += chance * m_t * azimuthal
        return s * cos_i / dr.square(cos_d), density / cos_i

    def sample(self, omega_o: mi.Vector3f, u: mi.Float, v: mi.Point2f) -> tuple[mi.Vector3f, mi.Bool]:
        """A direction towards the light; False where the draw leaves the range of inclinations.

        `u` draws the mode, `v` the inclination by M_t and the azimuth: by an even offset h for R and TT,
        evenly for TRT.
        """
        fibre = self.fibre
        theta_o, phi_o = angles(omega_o)
        is_r = u < self.chances[0]
        is_tt = ~is_r & (u < self.chances[0] + self.chances[1])

        def of_mode(values: list[float]) -> mi.Float:
            return dr.select(is_r, values[0], dr.select(is_tt, values[1], mi.Float(values[2])))

        # erfinv of +-1 is infinite.
        x = dr.erfinv(dr.clip(2.0 * v.x - 1.0, -0.9999999, 0.9999999))
        theta_i = 2.0 * of_mode(list(fibre.shift)) - theta_o + 2.0 * of_mode(list(fibre.width)) * x
        is_inside = dr.abs(theta_i) < 0.5 * np.pi
        sin_d, cos_d = dr.sincos(0.5 * (theta_o - theta_i))
        a = dr.maximum(cos_d, MIN_COS) / dr.sqrt(fibre.eta**2 - sin_d * sin_d)
        h = 2.0 * v.y - 1.0
        gamma_i = dr.safe_asin(h)
        phi = dr.select(is_r, -2.0 * gamma_i, 2.0 * dr.safe_asin(a * h) - 2.0 * gamma_i + np.pi)
        phi = dr.select(is_r | is_tt, phi, np.pi * h)
        sin_i, cos_i = dr.sincos(theta_i)
        sin_phi, cos_phi = dr.sincos(phi_o - phi)
        return mi.Vector3f(sin_i, cos_i * cos_phi, cos_i * sin_phi), is_inside


def angles(omega: mi.Vector3f) -> tuple[mi.Float, mi.Float]:
    """Inclination theta and azimuth phi of a direction in the fibre's frame."""
    return dr.atan2(omega.x, dr.hypot(omega.y, omega.z)), dr.atan2(omega.z, omega.y)
