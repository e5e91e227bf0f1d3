"""The one exception."""

from __future__ import annotations


class Error(Exception):
    """Something that Strandlight cannot do, in one line.

    ``path`` is the file that it is about, or ``None``. ``kind`` is one of:

    - ``io``: the operating system said no: missing, no permission, disk full
    - ``format``: a readable file, but of another kind
    - ``version``: written by a later version
    - ``damaged``: cut short, or contradicting itself
    - ``syntax``: a text that does not parse, or names an unknown key
    - ``value``: a value outside its range, an array of the wrong shape or type
    - ``map``: pixels that are no environment map
    - ``scene``, ``tables``, ``render``: what cannot be drawn or evaluated
    - ``bug``: a fault of the program; please report it
    """

    path: str | None
    kind: str

    def __init__(self, message: str, path: str | None = None, kind: str = "value") -> None:
        # All of them, so that the exception goes to another process and back.
        super().__init__(message, path, kind)
        self.message = message
        self.path = path
        self.kind = kind

    def __str__(self) -> str:
        return self.message
