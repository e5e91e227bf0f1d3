"""Pictures."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _native
from ._arrays import PathLike, as_count, as_path, converted
from ._error import Error
from ._groom import Groom
from ._lights import LightSet, Progress

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

ToneMap = Literal["filmic", "agx", "aces2", "none"]
LutInput = Literal["log2", "srgb", "linear"]


class Picture(np.ndarray[tuple[int, int, int], np.dtype[np.float32]]):
    """A picture as an array ``(height, width, 4)``: linear Rec.709 radiance, premultiplied, and alpha.

    It is an array like any other, and knows how its scene shows it: ``exposure`` (stops), ``tone_map``
    and, in its place where there is one, ``lut``, the path of a .cube file that takes radiance encoded
    as ``lut_input`` says. What is computed from it is one too; ``np.asarray`` makes it a plain array.
    """

    exposure: float
    tone_map: ToneMap
    lut: str | None
    lut_input: LutInput

    def __array_finalize__(self, obj: object) -> None:
        self.exposure = getattr(obj, "exposure", 0.0)
        self.tone_map = getattr(obj, "tone_map", "filmic")
        self.lut = getattr(obj, "lut", None)
        self.lut_input = getattr(obj, "lut_input", "log2")

    def __reduce__(self) -> Any:
        return (_picture, (np.asarray(self), *self._shown()))

    def _shown(self) -> tuple[float, ToneMap, str | None, LutInput]:
        return (self.exposure, self.tone_map, self.lut, self.lut_input)

    def srgb8(self) -> NDArray[np.uint8]:
        """8-bit sRGB with straight alpha, ``(height, width, 4)``."""
        return _native.to_srgb8(_pixels(self), *self._shown())

    def save(self, path: PathLike) -> None:
        """Writes a .png (8-bit sRGB) or .exr (linear float) file."""
        name = as_path(path, "path")
        ending = os.path.splitext(name)[1].lower()
        if ending not in (".png", ".exr"):
            raise Error(f"{name}: the name must end in .png or .exr", name)
        data = _native.picture_file(_pixels(self), ending == ".exr", *self._shown())
        _native.write_file(name, data)

    def _repr_png_(self) -> bytes | None:
        if self.ndim != 3 or self.shape[2] != 4:
            return None
        return _native.picture_file(_pixels(self), False, *self._shown())


def _picture(
    pixels: NDArray[np.float32],
    exposure: float,
    tone_map: ToneMap,
    lut: str | None = None,
    lut_input: LutInput = "log2",
) -> Picture:
    picture = pixels.view(Picture)
    picture.exposure = exposure
    picture.tone_map = tone_map
    picture.lut = lut
    picture.lut_input = lut_input
    return picture


def _pixels(picture: ArrayLike) -> NDArray[np.float32]:
    return converted(np.asarray(picture), np.float32, (None, None, 4), "picture")


def to_srgb8(
    picture: ArrayLike,
    *,
    exposure: float = 0.0,
    tone_map: ToneMap = "filmic",
    lut: PathLike | None = None,
    lut_input: LutInput = "log2",
) -> NDArray[np.uint8]:
    """A linear picture ``(height, width, 4)`` in 8-bit sRGB with straight alpha: radiance times
    ``2**exposure`` through the tone map, or through the .cube file ``lut`` in its place."""
    path = None if lut is None else as_path(lut, "lut")
    return _native.to_srgb8(_pixels(picture), exposure, tone_map, path, lut_input)


def render(
    scene: PathLike | Mapping[str, Any] | None = None,
    *,
    groom: Groom | None = None,
    lights: LightSet | None = None,
    set: Mapping[str, Any] | None = None,
    width: int | None = None,
    height: int | None = None,
    samples: int | None = None,
    time: float = 0.0,
    progress: Progress | None = None,
) -> Picture:
    """Renders a scene on the CPU, as ``strandlight render --backend cpu`` does.

    ``scene`` is a scene file, or a dict with the same keys (paths start from the working folder).
    ``groom`` and ``lights`` take the place of the scene's files; with both, no scene is needed.
    ``set`` has keys of the scene by their names, as ``{"hair.preset": "auburn"}``. ``samples``
    samples the pixels, as the GPU does; without, a visibility list says what they show.
    ``time`` is in seconds, of hair that moves.
    """
    path = text = None
    if isinstance(scene, Mapping):
        text = _json(scene, "scene")
    elif scene is not None:
        path = as_path(scene, "scene")
    elif groom is None or lights is None:
        raise Error("without a scene, both groom and lights must be given")
    pixels, shown = _native.render(
        path,
        text,
        None if groom is None else groom._native,
        None if lights is None else lights._native,
        _json(set or {}, "set"),
        (_side(width, "width"), _side(height, "height")),
        None if samples is None else as_count(samples, "samples"),
        float(time),
        progress,
    )
    lut = None if shown["lut"] is None else os.fspath(shown["lut"])
    return _picture(pixels, shown["exposure"], shown["tone_map"], lut, shown["lut_input"])


def _side(side: int | None, name: str) -> int | None:
    return None if side is None else as_count(side, name)


def _json(value: Mapping[str, Any], name: str) -> str:
    def plain(found: object) -> object:
        if isinstance(found, (np.ndarray, np.generic)):
            return found.tolist()
        if isinstance(found, os.PathLike):
            return os.fspath(found)
        raise Error(f"{name} holds a {type(found).__name__}, which a scene does not have")

    try:
        return json.dumps(value, default=plain)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: {error}") from None


def preview(groom: Groom) -> bytes:
    """A PNG of a groom in soft light from above."""
    axes = [[0.3, 1.0, 0.4], [-1.0, 0.3, 0.5], [0.0, -1.0, 0.0]]
    rgb = [[6.0] * 3, [3.0] * 3, [1.0] * 3]
    soft = LightSet.from_arrays(axes, [8.0, 3.0, 0.5], rgb)
    keys = {"hair.preset": "auburn", "render.background": [0.9, 0.9, 0.9]}
    picture = render(groom=groom, lights=soft, width=360, height=360, set=keys)
    shown = picture._repr_png_()
    assert shown is not None
    return shown


__all__ = ["Picture", "render", "to_srgb8"]
