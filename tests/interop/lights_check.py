"""The evaluators of docs/book/src/how-to/light-sets.md give the radiance of an exported light set.

python lights_check.py STRANDLIGHT TMPDIR

Runs each of them: Python, JavaScript (node) and C as they are, WGSL on the adapter, GLSL and HLSL as C++
with the few types they need. Exit code 1, with a line for each, if one is off.
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
for line in FAILURES:
    print(f"lights_check: {line}")
print(f"lights_check: {len(FAILURES)} failures")
sys.exit(1 if FAILURES else 0)
