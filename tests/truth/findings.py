"""What the checks of a run found: lines as they come, numbers and failures for its end."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from statistics_of import Verdict

FAILURES: list[str] = []
FOUND: dict[str, Any] = {}


def check(is_right: bool, what: str) -> None:
    print(("ok      " if is_right else "FAILED  ") + what, flush=True)
    if not is_right:
        FAILURES.append(what)


def note(key: str, verdict: Verdict) -> None:
    """Keeps a verdict's numbers."""
    numbers = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in asdict(verdict).items()}
    FOUND[key] = numbers | {"agrees": verdict.agrees()}


def timed(what: str, step: Callable[[], None]) -> None:
    start = time.monotonic()
    step()
    print(f"        {what}: {time.monotonic() - start:.0f} s", flush=True)


def end(file: str) -> int:
    """Writes what was found; the exit code."""
    with open(file, "w", encoding="utf-8") as text:
        json.dump(FOUND | {"failures": FAILURES}, text, indent=1)
    if FAILURES:
        print(*FAILURES, sep="\n", file=sys.stderr)
    return 1 if FAILURES else 0
