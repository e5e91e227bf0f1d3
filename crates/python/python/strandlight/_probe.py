"""The scattering model over arrays."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _native
from ._arrays import as_count, described
from ._error import Error
from ._lights import Progress
from ._tables import Tables

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Keys whose value is a colour: the last axis of an array has its 3 channels.
_RGB = ("sigma_a",)
#: Keys whose value is a whole number.
_WHOLE = ("k",)


@functools.cache
def _bundled() -> Tables:
    return Tables()


def probe(
    quantity: Literal["table_C", "table_H", "azimuthal", "single", "global", "local", "average"],
    /,
    *,
    method: Literal["runtime", "reference", "paper"] = "runtime",
    segments: int = 4,
    tables: Tables | None = None,
    progress: Progress | None = None,
    **keys: Any,
) -> NDArray[np.float64]:
    """Values of the scattering model, as ``strandlight probe`` answers them.

    ``keys`` are those of a query of that command: numbers, text, and dicts of them. Every number may
    be an array; arrays broadcast against each other, and the answer has their shape, with a last
    axis of 3 for RGB. A key that is a word of Python is written with an underscore (``lambda_``).

    ``method``: ``runtime``, the closed forms that the renderer evaluates; ``reference``, the exact
    model by double-precision quadrature; ``paper``, Xu's scheme as published, of ``segments`` 2 to
    64.

    >>> import numpy as np, strandlight as sl
    >>> sl.probe("table_C", k=[0, 1, 2], lambda_=0.2, phi=1.0).shape
    (3,)
    >>> light = {"theta": 0.1, "phi": np.linspace(0, 2 * np.pi, 5), "lambda": 0.3}
    >>> hair = {
    ...     "eta": 1.55, "sigma_a": [0.2, 0.3, 0.5], "caustic_width": 0.1,
    ...     "shift": {"r": -0.1, "tt": 0.05, "trt": 0.15}, "width": {"r": 0.18, "tt": 0.09, "trt": 0.36},
    ... }
    >>> view = {"theta": 0.0, "phi": 0.4}
    >>> sl.probe("single", mode="TT", light=light, view=view, hair=hair).shape
    (5, 3)
    """
    query: dict[str, Any] = {"q": quantity}
    arrays: dict[tuple[str, ...], NDArray[Any]] = {}
    plain = {key[:-1] if key.endswith("_") else key: value for key, value in keys.items()}
    for key, value in plain.items():
        kept = _taken(value, (key,), arrays)
        if kept is not None:
            query[key] = kept
    columns = {path: _column(path, array) for path, array in arrays.items()}
    try:
        shape = np.broadcast_shapes(*(column.shape[:-1] for column in columns.values()))
    except ValueError:
        shapes = ", ".join(f"{'.'.join(path)} {array.shape}" for path, array in arrays.items())
        raise Error(f"arrays do not broadcast: {shapes}") from None
    n = int(np.prod(shape, dtype=np.int64))
    flat = []
    for path, column in columns.items():
        width = column.shape[-1]
        whole = np.broadcast_to(column, (*shape, width)).reshape(n, width)
        flat.append((list(path), path[-1] in _WHOLE, np.ascontiguousarray(whole, np.float64)))
    used = _bundled() if tables is None else tables
    answer = _native.probe(
        json.dumps(query),
        flat,
        n,
        method,
        as_count(segments, "segments"),
        used._native,
        progress,
    )
    # One number, or RGB.
    return answer.reshape(shape) if answer.shape[1] == 1 else answer.reshape(*shape, answer.shape[1])


def _taken(value: Any, path: tuple[str, ...], arrays: dict[tuple[str, ...], NDArray[Any]]) -> Any:
    """What of a value stays in the query; arrays go to ``arrays``."""
    if isinstance(value, Mapping):
        inner = {}
        for key, below in value.items():
            kept = _taken(below, (*path, str(key)), arrays)
            if kept is not None:
                inner[str(key)] = kept
        return inner
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise Error(f"{'.'.join(path)} has {described(array)}; it must have numbers")
    if array.ndim == 0 and np.isfinite(array):
        return array.item()
    arrays[path] = array
    return None


def _column(path: tuple[str, ...], array: NDArray[Any]) -> NDArray[Any]:
    """The array with a last axis of what one query takes."""
    if path[-1] in _RGB:
        if array.ndim == 0 or array.shape[-1] != 3:
            raise Error(f"{'.'.join(path)} has {described(array)}; its last axis must be 3")
        return array
    if path[-1] in _WHOLE and array.dtype.kind == "f" and not np.all(array == np.floor(array)):
        raise Error(f"{'.'.join(path)} has {described(array)}; it must have whole numbers")
    return array[..., np.newaxis]


__all__ = ["probe"]
