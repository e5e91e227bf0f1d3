"""Baked tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from ._arrays import PathLike, as_path
from ._lights import Progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Tables:
    """The tables that the closed forms read. ``Tables()`` are those that come with the program."""

    __slots__ = ("_native",)

    def __init__(self, native: _native.Tables | None = None) -> None:
        self._native = _native.Tables.bundled() if native is None else native

    @staticmethod
    def open(path: PathLike) -> Tables:
        """Reads a ``.tables`` file."""
        return Tables(_native.Tables.open(as_path(path, "path")))

    @staticmethod
    def bake(
        *,
        fresnel: Literal["dielectric", "schlick"] = "dielectric",
        lean: bool = False,
        progress: Progress | None = None,
    ) -> Tables:
        """Computes tables, as ``strandlight tables`` does; ``lean`` leaves out those of the paper's
        scheme."""
        return Tables(_native.Tables.bake(fresnel, lean, progress))

    @staticmethod
    def from_bytes(data: bytes) -> Tables:
        """The tables of a file in memory."""
        return Tables(_native.Tables.from_bytes(data))

    def to_bytes(self) -> bytes:
        """The bytes of their file."""
        return self._native.to_bytes()

    def save(self, path: PathLike) -> None:
        """Writes a ``.tables`` file, whole or not at all."""
        self._native.save(as_path(path, "path"))

    @property
    def names(self) -> list[str]:
        """Names of the tables, in the order of the file."""
        return self._native.names()

    @property
    def fresnel(self) -> str:
        """The Fresnel term: ``dielectric`` or ``schlick``."""
        return self._native.fresnel()

    def __getitem__(self, name: str) -> NDArray[np.float32]:
        """Texels of a table, ``(axes..., channels)``."""
        return self._native.values(name)

    def axes(self, name: str) -> list[Mapping[str, Any]]:
        """Of each axis of a table ``name``, ``spacing`` and ``values`` at the texels' centres."""
        return self._native.axes(name)

    def channels(self, name: str) -> list[str]:
        """What each value of a texel is."""
        return self._native.channels(name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tables) and self.to_bytes() == other.to_bytes()

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __reduce__(self) -> tuple[Callable[[bytes], Tables], tuple[bytes]]:
        return (Tables.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        return f"<strandlight.Tables, {self.fresnel}: {', '.join(self.names)}>"


__all__ = ["Tables"]
