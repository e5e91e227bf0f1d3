"""Hair from Blender to a picture in ten lines, inside Blender's Python.

python blender_python_check.py STRANDLIGHT TMPDIR

Run with a Python that has Blender's module `bpy` and `strandlight`. Exit code 1, with a line for
each, if something differs.
"""

import os
import subprocess
import sys

import bpy
import numpy as np

FAILURES = []
BINARY, TMP = os.path.abspath(sys.argv[1]), sys.argv[2]


def check(is_right, what):
    if not is_right:
        FAILURES.append(what)


def make_hair():
    """Hair curves in Blender: 4,000 strands on a cap, in metres, Z up, under a transform."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    random = np.random.default_rng(1)
    counts = [12 + ix % 5 for ix in range(4000)]
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves(counts)
    points = []
    for count in counts:
        root = random.normal(size=3)
        root[2] = abs(root[2])
        root *= 0.09 / np.linalg.norm(root)
        s = np.linspace(0, 1, count)[:, None]
        points.append(root * (1 + 0.5 * s**0.7) + [0, 0, -1] * (0.16 * s**2))
    flat = np.concatenate(points).astype(np.float32)
    curves.attributes["position"].data.foreach_set("vector", flat.ravel())
    radius = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(len(flat), 0.00015, np.float32))
    item = bpy.data.objects.new("hair", curves)
    item.location = (0.02, 0.0, 1.6)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()


make_hair()
# ---- ten lines ----
import strandlight as sl

hair = bpy.data.objects["hair"]
points = np.empty((len(hair.data.points), 3), np.float32)
hair.data.attributes["position"].data.foreach_get("vector", points.ravel())
radii = np.empty(len(points), np.float32)
hair.data.attributes["radius"].data.foreach_get("value", radii)
world = points @ np.array(hair.matrix_world)[:3, :3].T + np.array(hair.matrix_world)[:3, 3]
groom = sl.Groom.from_arrays(world, [c.points_length for c in hair.data.curves], 2 * radii, unit="m", up="z")
lights = sl.fit_lights(np.ones((32, 64, 3)) * np.linspace(2, 0.3, 32)[:, None, None], count=16)
sl.render(groom=groom, lights=lights, set={"hair.preset": "auburn"}, width=360, height=360).save(f"{TMP}/blender.png")
# ---- ten lines ----

# The groom is that which Blender's USD export becomes.
usd = os.path.join(TMP, "blender.usda")
bpy.ops.wm.usd_export(filepath=usd, export_hair=True)
exported = sl.Groom.open(usd, samples_per_segment=1)
check(np.array_equal(exported.counts, groom.counts), "points per strand differ from Blender's export")
if np.array_equal(exported.counts, groom.counts):
    off = np.abs(exported.points - groom.points).max()
    check(off < 2e-6 * np.abs(groom.points).max(), f"points are off by {off} cm of Blender's export")
    widths = exported.attribute("diameter")
    check(np.allclose(widths, 0.03, rtol=1e-4), f"diameters of Blender's export: {widths[:4]}")
check(np.allclose(groom.attribute("diameter"), 0.03, rtol=1e-6), "diameters")
check(160 < groom.points[:, 1].max() < 180, "the head stands upright, in centimetres")

# And the picture is the command's.
groom.save(os.path.join(TMP, "a.groom"))
lights.save(os.path.join(TMP, "a.lights"))
scene = os.path.join(TMP, "a.toml")
with open(scene, "w") as file:
    file.write("version = 1\ngroom.file = 'a.groom'\nlights.file = 'a.lights'\nhair.preset = 'auburn'\nrender.size = [360, 360]\n")
out = os.path.join(TMP, "command.png")
run = subprocess.run([BINARY, "render", scene, "--backend", "cpu", "-o", out], capture_output=True, text=True)
check(run.returncode == 0, f"strandlight render: {run.stderr}")


def pixels(path):
    image = bpy.data.images.load(path)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], -1)


if run.returncode == 0:
    ours, its = pixels(os.path.join(TMP, "blender.png")), pixels(out)
    check(ours.shape == its.shape == (360, 360, 4), f"shapes {ours.shape}, {its.shape}")
    check(np.array_equal(ours, its), "the picture is not the command's")
    check(ours[..., :3].std() > 0.05, "nothing to see")

for failure in FAILURES:
    print(failure)
print(f"{len(FAILURES)} failures")
sys.exit(1 if FAILURES else 0)
