"""Fits lights to every map of a folder, and says how well.

python fit_folder.py MAPS OUT
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import strandlight as sl


def fit_folder(maps: Path, out: Path) -> dict[str, float]:
    """Writes a `.lights` file for each map; answers their errors by name."""
    errors: dict[str, float] = {}
    for path in sorted(maps.glob("*.exr")) + sorted(maps.glob("*.hdr")):
        try:
            lights = sl.fit_lights(path, count=40)
        except sl.Error as error:
            print(f"left out ({error.kind}): {error}", file=sys.stderr)
            continue
        lights.save(out / f"{path.stem}.lights")
        errors[path.name] = float(lights.report["fibre_error"]) if lights.report else np.nan
    return errors


if __name__ == "__main__":
    for name, error in fit_folder(Path(sys.argv[1]), Path(sys.argv[2])).items():
        print(f"{name}: {100 * error:.2f} %")
