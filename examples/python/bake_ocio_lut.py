"""Bakes a view of an OpenColorIO config to a .cube file for `render.lut`, and says how exact it is.

python bake_ocio_lut.py OUT.cube [--config CONFIG] [--display DISPLAY] [--view VIEW]

Needs `pip install opencolorio numpy`. Without options: the ACES 2.0 view of OpenColorIO's own config,
for an sRGB display. The file takes radiance encoded as `render.lut_input = "log2"` says, which is the
default there: (log2(v / 0.18) + 10) / 20 of scene-linear Rec.709 v.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio

# Names of scene-linear Rec.709 in the configs that are about.
SOURCES = ["Linear Rec.709 (sRGB)", "lin_rec709", "Utility - Linear - sRGB", "Linear Rec.709"]
# Stops below and above middle grey that the LUT covers; `LutInput::Log2` in crates/scene/src/lut.rs.
BELOW, ABOVE = 10.0, 10.0


def linear(encoded: np.ndarray) -> np.ndarray:
    """Radiance of what the LUT takes."""
    return 0.18 * np.exp2(encoded * (BELOW + ABOVE) - BELOW)


def interpolated(grid: np.ndarray, places: np.ndarray) -> np.ndarray:
    """What `grid[blue, green, red]` has at `places` in 0..1, by tetrahedra, as Strandlight does."""
    size = len(grid)
    at = np.clip(places, 0.0, 1.0) * (size - 1)
    corner = np.minimum(at.astype(int), size - 2)
    fraction = at - corner
    order = np.argsort(-fraction, axis=1, kind="stable")
    rows = np.arange(len(at))
    previous = np.ones(len(at))
    mixed = np.zeros_like(at)
    for step in range(4):
        following = fraction[rows, order[:, step]] if step < 3 else np.zeros(len(at))
        sample = grid[corner[:, 2], corner[:, 1], corner[:, 0]]
        mixed += (previous - following)[:, None] * sample
        if step < 3:
            corner[rows, order[:, step]] += 1
        previous = following
    return mixed


def errors(grid: np.ndarray, view: ocio.CPUProcessor, encoded: np.ndarray) -> np.ndarray:
    """Largest difference of the LUT from the view over the channels of a colour, in 8-bit levels."""
    exact = linear(encoded).astype(np.float32)
    view.applyRGB(exact)
    found = np.clip(interpolated(grid, encoded), 0.0, 1.0)
    return 255.0 * np.abs(found - np.clip(exact, 0.0, 1.0)).max(axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("out", type=Path, help=".cube file to write")
    parser.add_argument("--config", default="ocio://default", help="path, or the name of a built-in config")
    parser.add_argument("--display", help="display of the config; pictures are read as sRGB [its default]")
    parser.add_argument("--view", help="view of the display [its default]")
    parser.add_argument("--source", help="colour space that is scene-linear Rec.709 [by its usual names]")
    parser.add_argument("--size", type=int, default=65, help="samples along an edge, 2 to 129 [65]")
    args = parser.parse_args()
    if not 2 <= args.size <= 129:
        parser.error(f"--size is {args.size}, must be in 2..=129")

    config = ocio.Config.CreateFromFile(args.config)
    display = args.display or config.getDefaultDisplay()
    view = args.view or config.getDefaultView(display)
    known = [name for name in SOURCES if config.getColorSpace(name)]
    if not (args.source or known):
        parser.error("no colour space with a usual name of scene-linear Rec.709: name it by --source")
    source = args.source or known[0]
    try:
        processor = config.getProcessor(source, display, view, ocio.TRANSFORM_DIR_FORWARD)
    except ocio.Exception as error:
        parser.error(str(error))
    transform = processor.getDefaultCPUProcessor()

    axis = np.linspace(0.0, 1.0, args.size)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    samples = linear(np.stack([red, green, blue], axis=-1)).astype(np.float32).reshape(-1, 3)
    transform.applyRGB(samples)
    with args.out.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# render.lut_input = \"log2\", from {source}\n# config: {config.getName()}\n")
        file.write(f'TITLE "{display}, {view}"\nLUT_3D_SIZE {args.size}\n')
        np.savetxt(file, samples, fmt="%.6f")
    print(f"{args.out}: {display}, {view}, {args.size}^3")

    grid = samples.reshape(args.size, args.size, args.size, 3).astype(float)
    random = np.random.default_rng(0)
    colors = random.random((200_000, 3))
    # Hair and skin: a stop or two between the channels, red largest.
    muted = random.random((200_000, 1)) - np.sort(random.random((200_000, 3)), axis=1) * 2.0 / (BELOW + ABOVE)
    for name, places in [("any colours", colors), ("colours of hair", np.clip(muted, 0.0, 1.0))]:
        found = errors(grid, transform, places)
        mean, most = found.mean(), found.max()
        print(f"{name}: mean {mean:.3f}, 99 % below {np.percentile(found, 99):.3f}, largest {most:.2f} levels of 255")


if __name__ == "__main__":
    sys.exit(main())
