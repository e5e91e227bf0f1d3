"""Mitsuba draws the curves that Strandlight writes as Strandlight draws the groom: mean coverage and
silhouette from the same camera, to 1 %.

python mitsuba_check.py STRANDLIGHT TMPDIR [FOLDER]

FOLDER, of real hair, is not used. Run with a Python that has mitsuba and numpy. Exit code 1, with a line for each, if something
differs.
"""

import os
import re
import subprocess
import sys

import mitsuba as mi
import numpy as np

# Large enough for strands wider than a pixel: Strandlight draws thinner ones a pixel wide with less
# opacity, which is the same on average alone.
WIDTH, HEIGHT = 800, 600
# Rays per pixel of Mitsuba: the mean of coverage is then good to some 0.1 %.
SAMPLES = 64
TOLERANCE = 0.01
# Coverage above is in the silhouette, below is not.
COVERED = 0.5
# Side of a block, pixels; divides both sides of the picture.
BLOCK = 40
FAILURES = []


def check(is_right, what):
    print(("ok      " if is_right else "FAILED  ") + what)
    if not is_right:
        FAILURES.append(what)


def strandlight(*words):
    run = subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"strandlight {' '.join(map(str, words))}: {run.stderr.strip()}")
    return run


def at(name):
    return os.path.join(TMP, name)


def coverage_of_ours(name, camera):
    """Coverage by the CPU renderer."""
    scene = at(name + ".toml")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(
            f"version = 1\n[groom]\nfile = '{name}.groom'\n[lights]\nfile = 'sky.lights'\n"
            f"[camera]\nposition = {list(camera['eye'])}\ntarget = {list(camera['target'])}\n"
            f"up = [0.0, 1.0, 0.0]\nfov_deg = {camera['fov']}\n"
        )
    strandlight(
        "render", scene, "-o", at(name + ".exr"), "--aov", "coverage", "--size",
        f"{WIDTH}x{HEIGHT}", "--shadow-maps", 0, "--scattering", "single", "--backend", "cpu",
    )  # fmt: skip
    picture = mi.Bitmap(at(name + ".exr"))
    names = [picture.struct_()[ix].name for ix in range(len(picture.struct_()))]
    channel = next(ix for ix, name in enumerate(names) if name.startswith("coverage"))
    return np.array(picture, copy=False)[..., channel].astype(float)


def coverage_of_mitsuba(file, camera):
    """Share of a pixel's rays that meet a curve."""
    scene = mi.load_dict(
        {
            "type": "scene",
            # Its picture's alpha is 1 where a ray meets something.
            "integrator": {"type": "depth"},
            "sensor": {
                "type": "perspective",
                "fov": camera["fov"],
                "fov_axis": "y",
                "near_clip": 1.0,
                "far_clip": 10000.0,
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=camera["eye"], target=camera["target"], up=[0, 1, 0]
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": WIDTH,
                    "height": HEIGHT,
                    "pixel_format": "rgba",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "independent", "sample_count": SAMPLES},
            },
            "light": {"type": "constant"},
            "hair": {"type": "linearcurve", "filename": file},
        }
    )
    return np.array(mi.render(scene, spp=SAMPLES, seed=1))[..., 3].astype(float)


def bounds_of(groom):
    text = strandlight("inspect", groom).stdout
    low, high = re.search(r"bounds \[(.*?)\] to \[(.*?)\]", text).groups()
    return [np.array([float(x) for x in side.split(",")]) for side in (low, high)]


def compare(name, words):
    """Draws a generated groom with both."""
    groom = at(name + ".groom")
    strandlight("groom", "generate", *words, "-o", groom)
    file = at(name + ".txt")
    strandlight("export", groom, "-o", file)
    low, high = bounds_of(groom)
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    camera = {
        "eye": [float(x) for x in centre + size * np.array([0.6, 0.4, 1.9])],
        "target": [float(x) for x in centre],
        "fov": 30.0,
    }
    ours = coverage_of_ours(name, camera)
    theirs = coverage_of_mitsuba(file, camera)
    mean, other = ours.mean(), theirs.mean()
    share = abs(mean - other) / other
    check(share < TOLERANCE, f"{name}: mean coverage {mean:.5f}, Mitsuba {other:.5f} ({share:.2%})")
    # In blocks, where neither the noise of rays nor the filter of pixels counts.
    blocks, others = [
        picture.reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK).mean((1, 3))
        for picture in (ours, theirs)
    ]
    share = float(np.abs(blocks - others).mean() / others.mean())
    check(share < TOLERANCE, f"{name}: blocks of {BLOCK} pixels differ by {share:.2%} on average")
    silhouette, theirs_too = ours > COVERED, theirs > COVERED
    # Noise and filter decide about pixels that are half covered; most are not.
    clear = np.abs(theirs - COVERED) > 0.2
    hair = max(theirs_too.sum(), 1)
    differs = float((silhouette != theirs_too)[clear].sum()) / hair
    check(differs < TOLERANCE, f"{name}: {differs:.2%} of the silhouette differ")
    area = abs(float(silhouette.sum()) - float(theirs_too.sum())) / hair
    check(area < TOLERANCE, f"{name}: silhouettes of {silhouette.sum()} and {theirs_too.sum()} pixels")
    check(clear.mean() > 0.9, f"{name}: {clear.mean():.2%} of the picture are in the silhouette or out of it")
    # The comparison itself can fail: against the picture moved by four pixels it does.
    moved = np.roll(theirs_too, 4, axis=1)
    wrong = float((silhouette != moved)[clear].sum()) / hair
    check(wrong > TOLERANCE, f"{name}: moved by four pixels {wrong:.2%} differ")


def main():
    strandlight("demo", "-o", at("demo"))
    lights = [name for name in os.listdir(at("demo")) if name.endswith(".lights")]
    os.replace(os.path.join(at("demo"), lights[0]), at("sky.lights"))
    # Strandlight draws smooth curves through few points, Mitsuba the polyline: so many points that
    # these are one.
    for style, strands, points in [("straight", 400, 48), ("wavy", 1500, 24), ("curly", 800, 40)]:
        words = ["--style", style, "--strands", strands, "--points-per-strand", points]
        compare(style, words)


if len(sys.argv) not in (3, 4):
    sys.exit(__doc__)
BINARY, TMP = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
os.makedirs(TMP, exist_ok=True)
mi.set_variant("scalar_rgb")
main()
if FAILURES:
    print(*FAILURES, sep="\n", file=sys.stderr)
    sys.exit(1)
