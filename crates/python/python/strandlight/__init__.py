"""Strandlight: hair under environment lighting.

- :func:`fit_lights`: an environment map becomes a :class:`LightSet`.
- :class:`Groom`: hair from NumPy arrays and files, and to them.
- :func:`render`: hair and lights become a :class:`Picture`, an array.
- :func:`probe`: the scattering model over arrays; :class:`Tables`: what it reads.

Arrays of any number type and layout are taken. What goes wrong is an :class:`Error`. Long work runs
on all cores without the interpreter's lock, and ends at Ctrl+C.
"""

from ._error import Error
from ._groom import Groom
from ._lights import LightSet, fit_lights
from ._native import __version__
from ._probe import probe
from ._render import Picture, render, to_srgb8
from ._tables import Tables

__all__ = [
    "Error",
    "Groom",
    "LightSet",
    "Picture",
    "Tables",
    "__version__",
    "fit_lights",
    "probe",
    "render",
    "to_srgb8",
]
