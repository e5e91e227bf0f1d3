"""The evaluators of docs/book/src/how-to/light-sets.md give the radiance of an exported light set, and a light
rig for USD has the set's energy.

python lights_check.py STRANDLIGHT TMPDIR

Runs each of them: Python, JavaScript (node) and C as they are, WGSL on the adapter, GLSL and HLSL as C++
with the few types they need. The rig is opened by Pixar's library and its validators. Exit code 1, with a line for each, if one is off.
"""

import json
import os
import re
import subprocess
import sys

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FAILURES = []
BINARY, TMP = sys.argv[1:3]
BINARY = os.path.abspath(BINARY)
os.makedirs(TMP, exist_ok=True)

# A vector whose members xyz and w are all that the evaluators use.
SHIM = """
#include <cmath>
#include <cstdio>
using std::exp;
struct V3 { float x, y, z; };
static V3 make(float x, float y, float z) { V3 v = {x, y, z}; return v; }
static V3 make(float x) { return make(x, x, x); }
static V3 operator-(V3 a, V3 b) { return make(a.x - b.x, a.y - b.y, a.z - b.z); }
static V3 operator*(V3 a, float s) { return make(a.x * s, a.y * s, a.z * s); }
static V3 &operator+=(V3 &a, V3 b) { a = make(a.x + b.x, a.y + b.y, a.z + b.z); return a; }
static float dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
struct V4 { V3 xyz; float w; };
struct TYPE : V3 { TYPE(V3 v) : V3(v) {} TYPE(float x) : V3(make(x)) {} TYPE(float x, float y, float z) : V3(make(x, y, z)) {} };
"""
MAIN = """
int main() {
    float x, y, z;
    while (std::scanf("%f %f %f", &x, &y, &z) == 3) {
        V3 rgb = radiance(make(x, y, z));
        std::printf("%.9g %.9g %.9g\\n", rgb.x, rgb.y, rgb.z);
    }
}
"""


def strandlight(*words):
    subprocess.run([BINARY, *words], check=True, cwd=TMP, capture_output=True)


def numbers(text):
    return np.array([[float(x) for x in line.split()] for line in text.splitlines()])


def run(words, text=None):
    done = subprocess.run(words, input=text, cwd=TMP, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{words[0]}: {done.stderr.strip()[-600:]}")
    return done.stdout


def write(name, text):
    with open(os.path.join(TMP, name), "w") as file:
        file.write(text)


def of_python(code):
    scope = {}
    exec(code, scope)
    return [scope["radiance"](w, LIGHTS) for w in DIRECTIONS]


def of_js(code):
    write("radiance.js", code + """
const document = JSON.parse(require("fs").readFileSync("lights.json"));
for (const { direction } of document.test_directions) console.log(radiance(direction, document.lights).join(" "));
""")
    return numbers(run(["node", "radiance.js"]))


def of_c(code):
    write("radiance.c", code)
    run(["cc", "-std=c99", "-Wall", "-Werror", "-o", "radiance_c", "radiance.c", "-lm"])
    return numbers(run(["./radiance_c"], WORDS))


def as_cpp(code, name):
    rows = ", ".join(
        "{{%.9gf, %.9gf, %.9gf}, %.9gf}, {{%.9gf, %.9gf, %.9gf}, 0.0f}"
        % (*light["direction"], light["sharpness"], *light["rgb"])
        for light in LIGHTS
    )
    array = f"static const int N_LIGHTS = {len(LIGHTS)};\nstatic const V4 lights[] = {{{rows}}};\n"
    shim = SHIM.replace("TYPE", {"glsl": "vec3", "hlsl": "float3"}[name])
    write(f"{name}.cpp", shim + array + code + MAIN)
    run(["c++", "-O1", "-o", f"radiance_{name}", f"{name}.cpp"])
    return numbers(run([f"./radiance_{name}"], WORDS))


def of_wgsl(code):
    from wgpu.utils.compute import compute_with_buffers

    shader = """
        @group(0) @binding(0) var<storage, read> lights: array<vec4f>;
        @group(0) @binding(1) var<storage, read> directions: array<vec4f>;
        @group(0) @binding(2) var<storage, read_write> found: array<vec4f>;
        @compute @workgroup_size(1)
        fn main(@builtin(global_invocation_id) id: vec3u) {
            found[id.x] = vec4f(radiance(directions[id.x].xyz), 0.0);
        }
    """ + code
    lights = np.array(
        [[*light["direction"], light["sharpness"], *light["rgb"], 0] for light in LIGHTS], np.float32
    )
    directions = np.array([[*w, 0] for w in DIRECTIONS], np.float32)
    n = len(DIRECTIONS)
    out = compute_with_buffers({0: lights, 1: directions}, {2: (4 * n, "f")}, shader, n=n)
    return np.array(out[2]).reshape(n, 4)[:, :3]


strandlight("lights", os.path.join(ROOT, "data/sample/studio.exr"), "--no-report", "-o", "studio.lights")
for name in ["lights.json", "lights.npy", "lights.h", "fitted.exr"]:
    strandlight("export", "studio.lights", "-o", name)
with open(os.path.join(TMP, "lights.json")) as file:
    DOCUMENT = json.load(file)
LIGHTS = DOCUMENT["lights"]
DIRECTIONS = [test["direction"] for test in DOCUMENT["test_directions"]]
TRUTH = np.array([test["radiance"] for test in DOCUMENT["test_directions"]])
WORDS = "".join("%.17g %.17g %.17g\n" % tuple(w) for w in DIRECTIONS)

with open(os.path.join(ROOT, "docs/book/src/how-to/light-sets.md")) as file:
    BLOCKS = dict(re.findall(r"```(python|js|c|wgsl|glsl|hlsl)\n(.*?)```", file.read(), re.S))
RUNNERS = {
    "python": of_python,
    "js": of_js,
    "c": of_c,
    "wgsl": of_wgsl,
    "glsl": lambda code: as_cpp(code, "glsl"),
    "hlsl": lambda code: as_cpp(code, "hlsl"),
}
for name, runner in RUNNERS.items():
    try:
        found = np.array(runner(BLOCKS[name]), float)
    except Exception as error:
        FAILURES.append(f"{name}: {error!r}")
        continue
    error = np.abs(found - TRUTH).max() / np.abs(TRUTH).max()
    print(f"lights_check: {name}: {error:.1e} of the largest radiance")
    if not error < 2e-6:
        FAILURES.append(f"{name}: off by {error:g}")

# The array has the same lights, and the harmonics are those of the exported map.
array = np.load(os.path.join(TMP, "lights.npy"))
rows = [[*light["direction"], light["sharpness"], *light["rgb"]] for light in LIGHTS]
if not np.allclose(array, rows, rtol=1e-6, atol=0):
    FAILURES.append("lights.npy: other numbers than in lights.json")


def check(is_right, what):
    if not is_right:
        FAILURES.append(what)


def write_map_with_sun(name, width=512):
    """A Radiance map without run lengths: a sky, and a sun of a degree in radius at (0.6, 0.64, 0.48)."""
    height = width // 2
    y, x = np.mgrid[0:height, 0:width] + 0.5
    lat, lon = np.pi * (0.5 - y / height), np.pi - 2 * np.pi * x / width
    up = np.sin(lat)
    direction = np.stack([np.cos(lat) * np.sin(lon), up, np.cos(lat) * np.cos(lon)], -1)
    rgb = np.stack([0.3 + 0.1 * up, 0.4 + 0.2 * up, 0.6 + 0.3 * up], -1)
    rgb[direction @ np.array([0.6, 0.64, 0.48]) > np.cos(0.015)] = [9000.0, 7500.0, 5400.0]
    mantissa, exponent = np.frexp(rgb.max(-1))
    scale = np.ldexp(256.0, -exponent)[..., None]
    rgbe = np.concatenate([rgb * scale, exponent[..., None] + 128.0], -1).astype(np.uint8)
    with open(os.path.join(TMP, name), "wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + rgbe.tobytes())


def check_rig(name, lights, has_dome):
    """Pixar's library opens the rig without complaint; its lights are those of the set."""
    from pxr import Gf, Usd, UsdGeom, UsdLux, UsdValidation

    path = os.path.join(TMP, name)
    stage = Usd.Stage.Open(path)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    check(len(validators) > 20, f"{name}: only {len(validators)} validators")
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        check(False, f"{name}: {error.GetName()}: {error.GetMessage()}")
    check(UsdGeom.GetStageUpAxis(stage) == "Y", f"{name}: up")
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdLux.DistantLight)]
    check(len(prims) == len(lights), f"{name}: {len(prims)} lights for {len(lights)}")
    worst = 0.0
    for prim, light in zip(prims, lights):
        lamp = UsdLux.DistantLight(prim)
        check(lamp.GetNormalizeAttr().Get() is True, f"{name}: normalize")
        half = np.radians(lamp.GetAngleAttr().Get()) / 2
        irradiance = lamp.GetIntensityAttr().Get() * np.array(lamp.GetColorAttr().Get())
        # As UsdLux has it: a normalised distant light has radiance intensity / (pi sin^2).
        energy = irradiance / (np.pi * np.sin(half) ** 2) * 4 * np.pi * np.sin(half / 2) ** 2
        s = light["sharpness"]
        wanted = np.array(light["rgb"]) * 2 * np.pi / s * -np.expm1(-2 * s)
        worst = max(worst, np.abs(energy / wanted - 1).max())
        # It shines along its -Z.
        to_world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        towards = -np.array(to_world.TransformDir(Gf.Vec3d(0, 0, -1)))
        check(np.abs(towards - light["direction"]).max() < 1e-6, f"{name}: direction {towards}")
        axes = np.array(to_world)[:3, :3]
        check(np.abs(axes @ axes.T - np.eye(3)).max() < 1e-6, f"{name}: not a rotation")
    check(worst < 2e-6, f"{name}: energy off by {worst:g}")
    domes = [UsdLux.DomeLight(prim) for prim in stage.Traverse() if prim.IsA(UsdLux.DomeLight)]
    check(len(domes) == has_dome, f"{name}: {len(domes)} domes")
    for dome in domes:
        file = dome.GetTextureFileAttr().Get().resolvedPath
        check(os.path.samefile(file, os.path.join(TMP, "rest.exr")), f"{name}: {file}")
        check(dome.GetTextureFormatAttr().Get() == "latlong", f"{name}: format")
    print(f"lights_check: {name}: {len(prims)} lights, energy off by {worst:.1e}")


def lights_in(name):
    strandlight("export", name, "-o", name + ".json")
    with open(os.path.join(TMP, name + ".json")) as file:
        return json.load(file)["lights"]


strandlight("export", "studio.lights", "-o", "studio.usda")
check_rig("studio.usda", LIGHTS, False)
write_map_with_sun("sky.hdr")
strandlight("lights", "sky.hdr", "--suns", "4", "--residual", "rest.exr", "-o", "sun.lights")
strandlight("export", "sun.lights", "-o", "sun.usda", "--residual", "rest.exr")
SUNS = lights_in("sun.lights")
check(len(SUNS) == 1, f"{len(SUNS)} suns")
check(np.abs(np.array(SUNS[0]["direction"]) - [0.6, 0.64, 0.48]).max() < 2e-3, f"{SUNS[0]}")
check_rig("sun.usda", SUNS, True)

for line in FAILURES:
    print(f"lights_check: {line}")
print(f"lights_check: {len(FAILURES)} failures")
sys.exit(1 if FAILURES else 0)
