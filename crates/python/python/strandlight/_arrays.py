"""Arrays as the native module takes them: any type and layout is converted, or refused by name,
shape and type."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ._error import Error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike, NDArray

T = TypeVar("T", bound=np.generic)

#: A path, as ``open`` takes it.
PathLike = str | os.PathLike[str]


def described(array: NDArray[Any]) -> str:
    """Shape and type of an array, for messages."""
    return f"shape {array.shape} and dtype {array.dtype}"


def converted(
    value: ArrayLike,
    dtype: type[T],
    shape: Sequence[int | None],
    name: str,
    *,
    finite: bool = False,
) -> NDArray[T]:
    """``value`` as a contiguous array of ``dtype``; ``None`` in ``shape`` is any length.

    Numbers of any type are converted; what cannot hold a value (text, objects, complex numbers,
    fractions for whole numbers) is refused.
    """
    array = np.asarray(value)
    wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"
    refused = f"{name} has {described(array)}; it must have shape {wanted} and numbers"
    if array.dtype.kind not in "biuf":
        raise Error(refused)
    fits = len(shape) == array.ndim and all(
        n is None or n == found for n, found in zip(shape, array.shape)
    )
    if not fits:
        raise Error(refused)
    if np.issubdtype(dtype, np.integer):
        limits = np.iinfo(dtype)  # type: ignore[type-var]
        low, high = (array.min(), array.max()) if array.size else (0, 0)
        whole = array.dtype.kind in "biu" or bool(np.all(np.floor(array) == array))
        if not whole or low < limits.min or high > limits.max:
            raise Error(f"{name} must hold whole numbers in {limits.min}..={limits.max}")
    with np.errstate(over="ignore"):
        result = np.ascontiguousarray(array, dtype=dtype)
    if finite and not bool(np.all(np.isfinite(result))):
        raise Error(f"{name} has values that are not finite numbers of type {np.dtype(dtype)}")
    return result


def frozen(array: NDArray[T]) -> NDArray[T]:
    """The array, which nobody can change from now on."""
    array.setflags(write=False)
    return array


def as_path(value: object, name: str) -> str:
    """A path as text."""
    if isinstance(value, (str, os.PathLike)):
        path = os.fspath(value)
        if isinstance(path, str):
            return path
    raise Error(f"{name} is {type(value).__name__}; it must be a path")


def as_count(value: object, name: str, most: int = 2**32 - 1) -> int:
    """A whole number from 0 on."""
    import operator

    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise Error(f"{name} is {value!r}, must be a whole number") from None
    if not 0 <= number <= most:
        raise Error(f"{name} is {number}, must be in 0..={most}")
    return number
