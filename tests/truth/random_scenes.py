"""First pictures of random scenes against path tracing.

python random_scenes.py STRANDLIGHT FOLDER MAP... [--scenes N]

Each of N scenes (100) has generated hair of a random style, number of strands, colour, index, widths and shifts, under
40 lights of one of the maps turned at random, seen from a random side, 150 x 100 pixels. Prints a line of JSON for each and
what all of them come to: relative RMSE of means over 4 x 4 pixels of the hair, noise of the truth (48 samples) taken out, and
mean colour over the truth's. FOLDER keeps the light sets.
"""

import json
import math
import random
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

STYLES = ("straight", "wavy", "curly", "ponytail", "bob", "layered")
EUMELANIN = (0.0, 0.05, 0.15, 0.3, 0.6, 1.3, 3.0, 8.0)


def run(*command: object) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stderr.strip())
    return done.stdout


def light_set(program: str, folder: Path, path: Path) -> Path:
    """Of a map, fitted once."""
    lights = folder / f"{path.name.split('.')[0]}.lights"
    if not lights.exists():
        run(program, "lights", path, "-o", lights, "--no-report")
    return lights


def scene(program: str, folder: Path, lights: list[Path], ix: int) -> dict[str, Any]:
    """Writes scene `ix`; what is random in it is the same for the same maps."""
    draw = random.Random(1000 + ix)
    style = draw.choice(STYLES)
    strands = int(10 ** draw.uniform(3.0, 4.0))
    points = draw.choice((16, 24, 32))
    run(program, "groom", "generate", "--style", style, "--strands", strands, "--points-per-strand", points,
        "--seed", ix, "-o", folder / "hair.groom")  # fmt: skip
    eumelanin = draw.choice(EUMELANIN) * draw.uniform(0.7, 1.4)
    pheomelanin = draw.choice((0.0, 0.0, 0.3, 1.0)) * draw.uniform(0.5, 1.5)
    width, shift = draw.uniform(4, 11), draw.uniform(0, 8)
    light = draw.choice(lights)
    side, distance = draw.uniform(0, 6.2832), draw.uniform(55, 85)
    x, y, z = distance * math.sin(side), draw.uniform(-5, 25), distance * math.cos(side)
    (folder / "scene.toml").write_text(f"""version = 1
[groom]
file = "hair.groom"
[lights]
file = "{light.name}"
rotate_deg = {draw.uniform(0, 360):.1f}
[hair]
melanin = {{ eumelanin = {eumelanin:.3f}, pheomelanin = {pheomelanin:.3f} }}
eta = {draw.uniform(1.45, 1.65):.3f}
width_deg = {{ r = {width:.2f}, tt = {width / 2:.2f}, trt = {2 * width:.2f} }}
shift_deg = {{ r = {-shift:.2f}, tt = {shift / 2:.2f}, trt = {1.5 * shift:.2f} }}
caustic_width_deg = {draw.uniform(4, 12):.2f}
diameter_cm = {draw.uniform(0.006, 0.012) * min(3.0, (10000 / strands) ** 0.5):.5f}
[camera]
position = [{x:.2f}, {y:.2f}, {z:.2f}]
target = [0.0, -2.0, 0.0]
fov_deg = 25.0
[render]
size = [150, 100]
background = "none"
""")
    return {"scene": ix, "style": style, "strands": strands, "eumelanin": eumelanin, "pheomelanin": pheomelanin, "lights": light.stem}


def measured(program: str, folder: Path) -> dict[str, Any]:
    run(program, "render", folder / "scene.toml", "-o", folder / "first.exr", "--aov", "terms")
    run(program, "reference", folder / "scene.toml", "--method", "path", "--samples", 48, "-o", folder / "truth.exr")
    text = run(program, "compare", folder / "first.exr", folder / "truth.exr", "--box", 4, "--layer", "total", "--json")
    hair = json.loads(text)["hair"]
    return {"error": hair["relative_rmse_without_noise"], "mean": hair["mean_ratio"]}


def main() -> None:
    words = sys.argv[1:]
    count = 100
    if "--scenes" in words:
        at = words.index("--scenes")
        count = int(words[at + 1])
        del words[at : at + 2]
    if len(words) < 3:
        raise SystemExit(__doc__)
    program, folder = words[0], Path(words[1])
    folder.mkdir(parents=True, exist_ok=True)
    maps = sorted((Path(word) for word in words[2:]), key=lambda path: path.name)
    lights = [light_set(program, folder, path) for path in maps]
    rows = []
    for ix in range(count):
        row = scene(program, folder, lights, ix) | measured(program, folder)
        print(json.dumps(row), flush=True)
        rows.append(row)
    # Noise may hide an error that is small.
    errors = sorted(row["error"] or 0.0 for row in rows)
    off = [abs(statistics.mean(row["mean"]) - 1) for row in rows]
    def at(share: float) -> float:
        return 100 * errors[min(int(share * len(errors)), len(errors) - 1)]
    print(f"{len(rows)} scenes: {at(0.5):.1f} % in the median, {at(0.9):.1f} % of nine in ten, {errors[-1] * 100:.1f} % at most; "
          f"means {100 * statistics.median(off):.1f} % off in the median")  # fmt: skip


if __name__ == "__main__":
    main()
