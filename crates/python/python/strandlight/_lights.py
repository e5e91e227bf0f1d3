"""Environments as spherical Gaussian lights."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arrays import PathLike, as_count, as_path, converted

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: What long work calls with the share that is done, 0..=1, in the thread that started it. What it
#: raises ends the work.
Progress = Callable[[float], object]


def _map(map: PathLike | ArrayLike) -> tuple[str | None, NDArray[np.float32] | None]:
    if isinstance(map, (str, os.PathLike)):
        return as_path(map, "map"), None
    return None, converted(map, np.float32, (None, None, 3), "map")


def fit_lights(
    map: PathLike | ArrayLike,
    *,
    count: int = 40,
    seed: int = 0,
    part: str | None = None,
    layer: str | None = None,
    report: bool = True,
    progress: Progress | None = None,
) -> LightSet:
    """Fits spherical Gaussian lights to an environment map.

    ``map`` is a file (OpenEXR or Radiance .hdr) or an array ``(height, width, 3)`` of linear
    Rec.709 radiance in OpenEXR's latitude-longitude layout, twice as wide as high, row 0 on top.
    ``count`` is 1..=1024. ``part`` and ``layer`` choose an image of an OpenEXR file. Without
    ``report`` the errors of the fit are not measured. Of a file,
    the result is what ``strandlight lights`` writes, byte for byte.

    >>> import numpy as np, strandlight as sl
    >>> sky = np.ones((16, 32, 3)) * np.linspace(2, 1, 16)[:, None, None]
    >>> lights = sl.fit_lights(sky, count=8)
    >>> lights.axes.shape, lights.evaluate([0, 1, 0]).shape
    ((8, 3), (3,))
    """
    path, pixels = _map(map)
    native = _native.fit_lights(
        path,
        pixels,
        as_count(count, "count"),
        as_count(seed, "seed", 2**64 - 1),
        part,
        layer,
        report,
        progress,
    )
    return LightSet(native)


class LightSet:
    """Lights that add up to an environment: ``rgb * exp(sharpness * (dot(axis, direction) - 1))``.

    Made by :func:`fit_lights`, :meth:`open` and :meth:`from_arrays`. Arrays are in the world of
    Strandlight: right-handed, +Y up. They cannot be written to.
    """

    __slots__ = ("_axes", "_lambdas", "_native", "_rgb", "_sharpness")

    def __init__(self, native: _native.LightSet) -> None:
        self._native = native
        self._axes = native.axes()
        self._sharpness = native.sharpness()
        self._lambdas = native.lambdas()
        self._rgb = native.rgb()

    @staticmethod
    def open(path: PathLike) -> LightSet:
        """Reads a ``.lights`` file."""
        return LightSet(_native.LightSet.open(as_path(path, "path")))

    @staticmethod
    def from_arrays(axes: ArrayLike, sharpness: ArrayLike, rgb: ArrayLike) -> LightSet:
        """Lights from elsewhere: ``axes (n, 3)``, of any length above 0, ``sharpness (n,)`` and
        ``rgb (n, 3)``, linear Rec.709. As in every set, they are by falling energy then."""
        of_axes = converted(axes, np.float64, (None, 3), "axes")
        n = len(of_axes)
        of_sharpness = converted(sharpness, np.float64, (n,), "sharpness")
        of_rgb = converted(rgb, np.float32, (n, 3), "rgb")
        return LightSet(_native.LightSet.from_arrays(of_axes, of_sharpness, of_rgb))

    @staticmethod
    def from_bytes(data: bytes) -> LightSet:
        """The light set of a file in memory."""
        return LightSet(_native.LightSet.from_bytes(data))

    def to_bytes(self) -> bytes:
        """The bytes of its file."""
        return self._native.to_bytes()

    def save(self, path: PathLike) -> None:
        """Writes a ``.lights`` file, whole or not at all."""
        self._native.save(as_path(path, "path"))

    @property
    def axes(self) -> NDArray[np.float32]:
        """Unit vectors towards the lights, ``(n, 3)``."""
        return self._axes

    @property
    def sharpness(self) -> NDArray[np.float64]:
        """Sharpness of each light, ``(n,)``: ``2 / lambdas**2``."""
        return self._sharpness

    @property
    def lambdas(self) -> NDArray[np.float32]:
        """Xu's bandwidths, ``(n,)``, radians."""
        return self._lambdas

    @property
    def rgb(self) -> NDArray[np.float32]:
        """Amplitudes, ``(n, 3)``, linear Rec.709."""
        return self._rgb

    @property
    def report(self) -> Mapping[str, Any] | None:
        """Errors of the fit, all relative: ``rel_l2``, ``energy_ratio`` (a channel each),
        ``irradiance_error``, ``fibre_error``; ``None`` if they were not measured."""
        return self._native.report()

    @property
    def info(self) -> Mapping[str, Any]:
        """What the file records about its making."""
        return self._native.info()

    def evaluate(self, directions: ArrayLike) -> NDArray[np.float64]:
        """Radiance ``(..., 3)`` from ``directions (..., 3)``, which need not be unit vectors."""
        array = np.asarray(directions)
        shape = array.shape
        flat = array.reshape(-1, 3) if array.ndim and shape[-1] == 3 else array
        rows = converted(flat, np.float64, (None, 3), "directions")
        return self._native.evaluate(rows).reshape(shape)

    def map(self, height: int, width: int | None = None) -> NDArray[np.float32]:
        """The environment as a latitude-longitude map ``(height, width, 3)``; ``width`` is twice
        ``height`` unless it is given."""
        rows = as_count(height, "height")
        columns = 2 * rows if width is None else as_count(width, "width")
        return self._native.map(rows, columns)

    def preview(self, map: PathLike | ArrayLike) -> bytes:
        """A PNG of map, light set, their difference and the lights, as ``strandlight lights
        --preview`` draws it."""
        path, pixels = _map(map)
        return self._native.png(path, pixels)

    def __len__(self) -> int:
        return len(self._native)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LightSet) and self.to_bytes() == other.to_bytes()

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __reduce__(self) -> tuple[Callable[[bytes], LightSet], tuple[bytes]]:
        return (LightSet.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        error = self.report and f", fibre error {100 * self.report['fibre_error']:.2f} %"
        return f"<strandlight.LightSet of {len(self)} lights{error or ''}>"

    def _repr_png_(self) -> bytes:
        return self._native.png()


__all__ = ["LightSet", "Progress", "fit_lights"]
