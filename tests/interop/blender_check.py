"""Blender reads what Strandlight writes and the other way round: points, radii and frames; sun lamps.

python blender_check.py STRANDLIGHT TMPDIR

Run with a Python that has Blender's module `bpy`. Exit code 1, with a line for each, if something
differs.
"""

import json
import math
import os
import struct
import subprocess
import sys

import numpy as np

FAILURES = []


def check(is_right, what):
    if not is_right:
        FAILURES.append(what)


def near(a, b, tolerance, what):
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape:
        FAILURES.append(f"{what}: {a.shape} values, {b.shape} wanted")
        return
    error = float(np.abs(a - b).max()) if a.size else 0.0
    scale = float(np.abs(b).max()) if b.size else 1.0
    check(error <= tolerance * max(scale, 1e-9), f"{what}: off by {error:g} of {scale:g}")


# ---- Blender, in processes of its own: an importer that crashes must not end the check ----


def curves_of_scene():
    """World-space points (metres, Z up), points per curve and radii of all curves, by frame."""
    import bpy

    depsgraph = bpy.context.evaluated_depsgraph_get()
    points, counts, radii = [], [], []
    for item in sorted(bpy.data.objects, key=lambda item: item.name):
        if item.type != "CURVES":
            continue
        evaluated = item.evaluated_get(depsgraph)
        data = evaluated.data
        local = np.empty(3 * len(data.points), np.float32)
        data.attributes["position"].data.foreach_get("vector", local)
        world = np.array(evaluated.matrix_world)
        local = local.reshape(-1, 3)
        points.append(local @ world[:3, :3].T + world[:3, 3])
        counts += [curve.points_length for curve in data.curves]
        if "radius" in data.attributes:
            radius = np.empty(len(data.points), np.float32)
            data.attributes["radius"].data.foreach_get("value", radius)
            scale = abs(np.linalg.det(world[:3, :3])) ** (1 / 3)
            radii.append(radius * scale)
    flat = np.concatenate(points) if points else np.empty((0, 3))
    radius = np.concatenate(radii) if radii else np.empty(0)
    return {"points": flat.tolist(), "counts": counts, "radii": radius.tolist()}


def blender_import(path, out, frames):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".abc"):
        bpy.ops.wm.alembic_import(filepath=path)
    else:
        bpy.ops.wm.usd_import(filepath=path)
    found = []
    for frame in range(frames):
        bpy.context.scene.frame_set(frame)
        found.append(curves_of_scene())
    with open(out, "w") as file:
        json.dump(found, file)


def blender_export(out, folder):
    """A groom that Blender makes, under a transform, as .abc, .usda and .usdc."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    curves = bpy.data.hair_curves.new("hair")
    counts = [4 + ix % 5 for ix in range(60)]
    curves.add_curves(counts)
    random = np.random.default_rng(1)
    n = sum(counts)
    points = random.normal(size=(n, 3)).astype(np.float32)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    radius = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", random.uniform(0.001, 0.002, n).astype(np.float32))
    item = bpy.data.objects.new("hair", curves)
    item.location = (0.3, -0.2, 1.5)
    item.rotation_euler = (0.2, 0.5, -0.3)
    item.scale = (0.1, 0.1, 0.1)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    truth = curves_of_scene()
    bpy.ops.wm.alembic_export(filepath=os.path.join(folder, "blender.abc"), start=1, end=1)
    for name in ["blender.usda", "blender.usdc"]:
        bpy.ops.wm.usd_export(filepath=os.path.join(folder, name), export_hair=True)
    with open(out, "w") as file:
        json.dump(truth, file)


def blender_lamps(path, out):
    """Lamps of a USD file by name: what they are, where they come from (Y up)."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path)
    lamps = {}
    for item in bpy.data.objects:
        if item.type == "LIGHT":
            lamp = item.data
            x, y, z = item.matrix_world.col[2][:3]
            length = math.sqrt(x * x + y * y + z * z)
            lamps[item.name] = {
                "type": lamp.type,
                "angle": lamp.angle,
                "irradiance": [lamp.energy * c for c in lamp.color],
                "is_normalized": lamp.normalize,
                "direction": [x / length, z / length, -y / length],
            }
    with open(out, "w") as file:
        json.dump(lamps, file)


def in_blender(*words):
    """Runs this file in another process; what it wrote, or `None` where Blender failed."""
    run = subprocess.run(
        [sys.executable, __file__, "--inside", *map(str, words)], capture_output=True, text=True
    )
    if run.returncode != 0:
        FAILURES.append(f"Blender failed on {words}: {run.returncode}\n{run.stderr[-800:]}")
        return None
    with open(words[1]) as file:
        return json.load(file)


# ---- Strandlight ----


def strandlight(*words):
    run = subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)
    if run.returncode != 0:
        FAILURES.append(f"strandlight {' '.join(map(str, words))}: {run.stderr.strip()}")
    return run


def points_of(groom):
    """Points of a .groom in metres, Y up, and points per strand."""
    path = groom + ".data"
    strandlight("export", groom, "-o", path, "--format", "usc")
    with open(path, "rb") as file:
        data = file.read()
    (n,), at = struct.unpack_from("<i", data), 4
    points, counts = [], []
    for _ in range(n):
        (count,) = struct.unpack_from("<i", data, at)
        points.append(np.frombuffer(data, "<f4", 3 * count, at + 4).reshape(-1, 3))
        counts.append(count)
        at += 4 + 12 * count
    return np.concatenate(points), counts


def y_up(points):
    """From Blender's axes, Z up, to Strandlight's."""
    points = np.asarray(points).reshape(-1, 3)
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)


def flags_for(name):
    """Blender takes USD by its own unit and axes, and any Alembic as metres with y up."""
    return ["--to", "blender"] if name.endswith(".usda") else ["--unit", "m", "--up", "y"]


def reads_ours():
    groom = os.path.join(TMP, "ours.groom")
    strandlight("groom", "generate", "--style", "layered", "--strands", 300, "--points-per-strand", 9, "-o", groom)
    points, counts = points_of(groom)
    info = json.loads(strandlight("inspect", groom, "--json").stdout)
    widest = info["diameter_cm"]["max"] / 100
    thinnest = info["diameter_cm"]["min"] / 100
    for name in ["ours.abc", "ours.usda"]:
        path = os.path.join(TMP, name)
        strandlight("groom", "export", groom, *flags_for(name), "-o", path)
        found = in_blender("import", os.path.join(TMP, "found.json"), path, 1)
        if not found:
            continue
        found = found[0]
        check(found["counts"] == counts, f"{name}: points per curve differ")
        near(y_up(found["points"]), points, 2e-6, f"{name}: points in Blender")
        near(max(found["radii"], default=0), widest / 2, 1e-5, f"{name}: largest radius in Blender")
        near(min(found["radii"], default=0), thinnest / 2, 1e-5, f"{name}: smallest radius in Blender")


def reads_our_frames():
    names = []
    for frame in range(3):
        name = os.path.join(TMP, f"frame.{frame}.groom")
        strandlight("groom", "generate", "--style", "bob", "--strands", 40, "--points-per-strand", 6, "-o", name)
        moved = os.path.join(TMP, f"moved.{frame}.groom")
        strandlight("groom", "transform", name, "--translate", f"0,{frame + 1},0", "-o", moved)
        names.append(moved)
    for name in ["ours_moving.abc", "ours_moving.usda"]:
        path = os.path.join(TMP, name)
        strandlight("groom", "export", *names, *flags_for(name), "--fps", 24, "-o", path)
        found = in_blender("import", os.path.join(TMP, "found.json"), path, 3)
        for frame, curves in enumerate(found or []):
            points, _ = points_of(names[frame])
            near(y_up(curves["points"]), points, 2e-6, f"{name}: points of frame {frame} in Blender")


def we_read_its():
    truth = in_blender("export", os.path.join(TMP, "truth.json"), TMP)
    if not truth:
        return
    for name in ["blender.abc", "blender.usda", "blender.usdc"]:
        groom = os.path.join(TMP, name + ".groom")
        # Blender's Alembic is in metres and does not say so; its USD does.
        unit = ["--unit", "m"] if name.endswith(".abc") else []
        strandlight("groom", "import", os.path.join(TMP, name), *unit, "--samples-per-segment", 1, "-o", groom)
        points, counts = points_of(groom)
        # Blender writes Catmull-Rom curves: ours pass through the same points.
        check(counts == truth["counts"], f"{name}: points per strand differ: {counts[:5]}, {truth['counts'][:5]} wanted")
        if counts == truth["counts"]:
            near(points, y_up(truth["points"]), 2e-6, f"{name}: points")
        info = json.loads(strandlight("inspect", groom, "--json").stdout)
        diameter = info["diameter_cm"]
        near(diameter["max"] / 200, max(truth["radii"]), 1e-4, f"{name}: largest radius")
        near(diameter["min"] / 200, min(truth["radii"]), 1e-4, f"{name}: smallest radius")


if sys.argv[1] == "--inside":
    _, _, what, out, *rest = sys.argv
    if what == "lamps":
        blender_lamps(rest[0], out)
    elif what == "import":
        blender_import(rest[0], out, int(rest[1]))
    else:
        blender_export(out, rest[0])
    sys.exit(0)

def lamps_are_our_lights():
    """`export --for blender`: each lamp has the width of its light, and its irradiance."""
    lights = os.path.join(TMP, "studio.lights")
    rig, out = os.path.join(TMP, "rig.usda"), os.path.join(TMP, "lamps.json")
    strandlight("lights", os.path.join(ROOT, "data/sample/studio.exr"), "--no-report", "--count", 12, "-o", lights)
    strandlight("export", lights, "--for", "blender", "-o", rig)
    strandlight("export", lights, "-o", lights + ".json")
    lamps = in_blender("lamps", out, rig)
    if lamps is None:
        return
    with open(lights + ".json") as file:
        wanted = json.load(file)["lights"]
    check(len(lamps) == len(wanted) == 12, f"{rig}: {len(lamps)} lamps")
    for name, light in zip(sorted(lamps), wanted):
        lamp, s = lamps[name], light["sharpness"]
        check(lamp["type"] == "SUN" and lamp["is_normalized"], f"{name}: {lamp}")
        # The disc's mean of 1 - cos is the light's, up to half the sphere.
        mean = min(1 / s - 2 / math.expm1(2 * s), 0.5) if s < 50 else 1 / s
        half = 2 * math.asin(math.sqrt(mean))
        near(lamp["angle"], 2 * half, 1e-5, f"{name}: angle")
        energy = np.array(light["rgb"]) * 2 * math.pi / s * -math.expm1(-2 * s)
        # A normalised sun lamp of Blender has strength for irradiance: seen in a picture by Cycles.
        near(lamp["irradiance"], energy * (1 + math.cos(half)) / 2, 1e-5, f"{name}: irradiance")
        near(lamp["direction"], light["direction"], 1e-5, f"{name}: direction")


BINARY, TMP = sys.argv[1:3]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.makedirs(TMP, exist_ok=True)
lamps_are_our_lights()
reads_ours()
reads_our_frames()
we_read_its()
for line in FAILURES:
    print(f"blender_check: {line}")
print(f"blender_check: {len(FAILURES)} failures")
sys.exit(1 if FAILURES else 0)
