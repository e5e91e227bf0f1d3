"""Hair curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _native
from ._arrays import PathLike, as_count, as_path, converted, described
from ._error import Error
from ._lights import Progress

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

Unit = float | str
Axis = Literal["x", "y", "z"]
Domain = Literal["groom", "strand", "point"]


class Groom:
    """Hair as polylines, root first: centimetres, right-handed, +Y up.

    Made by :meth:`from_arrays`, :meth:`open` and :meth:`generate`. Its arrays share memory with it
    and cannot be written to.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _native.Groom) -> None:
        self._native = native

    @staticmethod
    def from_arrays(
        points: ArrayLike,
        counts: ArrayLike,
        widths: ArrayLike | None = None,
        *,
        unit: Unit = "cm",
        up: Axis = "y",
        **attributes: ArrayLike,
    ) -> Groom:
        """Hair from arrays.

        ``points (n, 3)`` are the points of all strands one after another, ``counts (strands,)`` how
        many each strand has, at least 2; or ``points (strands, m, 3)`` and ``counts`` the number m.
        ``widths`` are fibre diameters: one for all, ``(strands,)`` or ``(n,)``. ``unit`` (``mm``,
        ``cm``, ``in``, ``ft``, ``m`` or a number of centimetres) and ``up`` are those of ``points``
        and ``widths``. ``attributes`` have a value or a row of up to 4 for the groom, each strand or
        each point, by the length of the array; those with a meaning are listed in the book.

        >>> import numpy as np, strandlight as sl
        >>> groom = sl.Groom.from_arrays(np.random.rand(10, 3), [4, 6], widths=0.008)
        >>> groom.counts.tolist(), groom.attribute("diameter").tolist()
        ([4, 6], [0.00800000037997961])
        """
        array = np.asarray(points)
        per_strand = np.asarray(counts)
        if array.ndim == 3:
            if per_strand.ndim != 0 or int(per_strand) != array.shape[1]:
                raise Error(f"points has {described(array)}; counts must be {array.shape[1]}")
            per_strand = np.full(array.shape[0], array.shape[1])
            array = array.reshape(-1, array.shape[-1])
        counted = converted(per_strand, np.uint32, (None,), "counts").astype(np.uint64)
        offsets = np.zeros(len(counted) + 1, np.uint64)
        np.cumsum(counted, out=offsets[1:])
        if offsets[-1] != len(array):
            raise Error(f"counts add up to {offsets[-1]}, and points has {described(array)}")
        cm = centimetres(unit)
        placed = _y_up(converted(array, np.float64, (None, 3), "points") * cm, up)
        flat = converted(placed, np.float32, (None, 3), "points", finite=True)
        given = []
        if widths is not None:
            if "diameter" in attributes:
                raise Error("widths and diameter are the same; give one of them")
            scaled = converted(np.atleast_1d(widths), np.float64, (None,), "widths") * cm
            given.append(_attribute("diameter", scaled, len(counted), len(flat)))
        for name, values in attributes.items():
            given.append(_attribute(name, values, len(counted), len(flat)))
        return Groom(_native.Groom.from_arrays(flat, offsets.astype(np.uint32), given))

    @staticmethod
    def open(
        path: PathLike,
        *,
        unit: Unit | None = None,
        up: Axis | Literal["auto"] | None = None,
        guides: Literal["drop", "keep", "only"] = "drop",
        root: Literal["keep", "auto"] = "keep",
        prim: str | None = None,
        frame: int = 0,
        samples_per_segment: int | None = None,
        color_from: str | None = None,
    ) -> Groom:
        """Reads hair of any format that ``strandlight groom formats`` lists; the options are those of
        ``strandlight groom import``.

        ``unit`` and ``up``: of the file, ``"auto"`` to take the file's word or else estimate them;
        ``guides``: what becomes of guides among other strands; ``root="auto"`` turns strands whose
        tips are nearer to the middle of the roots; ``prim``: one object of the file; ``frame``: a
        point in time; ``samples_per_segment``: points that a cubic segment becomes;
        ``color_from``: the attribute to dye the hair by.
        """
        native = _native.Groom.open(
            as_path(path, "path"),
            None if unit is None else str(unit),
            up,
            prim,
            None if samples_per_segment is None else _samples(samples_per_segment),
            as_count(frame, "frame"),
            root,
            guides,
            color_from,
        )
        return Groom(native)

    @staticmethod
    def generate(
        style: str = "wavy",
        *,
        strands: int = 10_000,
        points_per_strand: int = 32,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> Groom:
        """Grows hair: ``straight``, ``wavy``, ``curly``, ``bob``, ``ponytail`` or ``layered``."""
        native = _native.Groom.generate(
            style,
            as_count(strands, "strands"),
            as_count(points_per_strand, "points_per_strand"),
            as_count(seed, "seed", 2**64 - 1),
            progress,
        )
        return Groom(native)

    @staticmethod
    def from_bytes(data: bytes) -> Groom:
        """The groom of a ``.groom`` file in memory."""
        return Groom(_native.Groom.from_bytes(data))

    def to_bytes(self) -> bytes:
        """The bytes of its ``.groom`` file."""
        return self._native.to_bytes()

    def save(
        self,
        path: PathLike,
        *,
        to: Literal["unreal", "blender", "unity", "usd", "mitsuba", "pbrt"] | None = None,
        format: str | None = None,
        unit: Unit | None = None,
        up: Axis | None = None,
    ) -> list[str]:
        """Writes a file, whole or not at all: in the format of its ending, or ``format``, or that
        which the program ``to`` takes. Answers the names of attributes that the file cannot hold.
        """
        of_unit = None if unit is None else str(unit)
        return self._native.save(as_path(path, "path"), to, format, of_unit, up)

    @property
    def points(self) -> NDArray[np.float32]:
        """Points of all strands one after another, ``(n, 3)``."""
        return self._native.points()

    @property
    def offsets(self) -> NDArray[np.uint32]:
        """First point of each strand, and the number of points at the end: ``(strands + 1,)``."""
        return self._native.offsets()

    @property
    def counts(self) -> NDArray[np.uint32]:
        """Points of each strand, ``(strands,)``."""
        return np.diff(self._native.offsets())

    @property
    def attributes(self) -> dict[str, Domain]:
        """Names of attributes, and what each has a value for."""
        return dict(self._native.attributes())

    def attribute(self, name: str) -> NDArray[np.float32]:
        """Values of an attribute: ``(elements,)`` or ``(elements, components)``."""
        found = self._native.attribute(name)
        if found is None:
            names = ", ".join(self.attributes) or "none"
            raise Error(f"there is no attribute {name!r}, only {names}")
        return found

    def strand(self, ix: int) -> NDArray[np.float32]:
        """Points of one strand, root first."""
        first, last = self.offsets[:-1][ix], self.offsets[1:][ix]
        return self.points[first:last]

    @property
    def source(self) -> Mapping[str, Any]:
        """Where it comes from: ``cm_per_unit`` and ``up`` of the file, ``hash``, ``format``,
        ``tool_version``."""
        return self._native.source()

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Groom) and self.to_bytes() == other.to_bytes()

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __reduce__(self) -> tuple[Callable[[bytes], Groom], tuple[bytes]]:
        return (Groom.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        return f"<strandlight.Groom of {len(self)} strands, {len(self.points)} points>"

    def _repr_png_(self) -> bytes:
        # Here, for pictures need grooms.
        from ._render import preview

        return preview(self)


def centimetres(unit: Unit) -> float:
    """Centimetres of a unit, a name or a number."""
    named = {"mm": 0.1, "cm": 1.0, "in": 2.54, "ft": 30.48, "m": 100.0}
    cm = named.get(unit) if isinstance(unit, str) else float(unit)
    if cm is None or not 1e-6 <= cm <= 1e6:
        raise Error(f"unit is {unit!r}, must be {', '.join(named)}, or centimetres in 1e-6..=1e6")
    return cm


def _y_up(points: NDArray[np.float64], up: str) -> NDArray[np.float64]:
    x, y, z = points.T
    if up == "y":
        return points
    if up == "z":
        return np.stack([x, z, -y], axis=1)
    if up == "x":
        return np.stack([-y, x, z], axis=1)
    raise Error(f"up is {up!r}, must be x, y or z")


def _samples(samples: int) -> int:
    return as_count(samples, "samples_per_segment")


def _attribute(
    name: str, values: ArrayLike, strands: int, points: int
) -> tuple[str, str, NDArray[np.float32]]:
    """Name, domain and rows of an attribute, by the length of its array."""
    array = np.asarray(values)
    lengths = {strands: "strand", points: "point", 1: "groom"}
    if array.ndim == 0:
        array = array.reshape(1)
    if array.ndim == 1 and len(array) not in lengths and len(array) <= 4 and name != "diameter":
        # One row for the whole groom.
        array = array.reshape(1, -1)
    if array.ndim not in (1, 2) or len(array) not in lengths:
        raise Error(
            f"{name} has {described(array)}; it must have 1, {strands} (strands) or {points}"
            " (points) values or rows"
        )
    rows = array.reshape(len(array), -1)
    if not 1 <= rows.shape[1] <= 4:
        raise Error(f"{name} has {described(array)}; a row must have 1 to 4 values")
    data = converted(rows, np.float32, (None, rows.shape[1]), name, finite=True)
    return name, lengths[len(array)], data


__all__ = ["Groom"]
