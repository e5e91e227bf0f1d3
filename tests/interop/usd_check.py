"""USD files: what Strandlight reads and writes, against Pixar's own library.

python usd_check.py STRANDLIGHT TMPDIR [SAMPLES]

Every USD file of SAMPLES/usd, and files made here, are imported from text, binary (newest and old
versions) and packages, and compared with polylines evaluated here from the library's arrays, in
world space; widths and primvars likewise. What Strandlight writes must pass the library's own
validators, hold the same values, and come back. Exit code 1, with a line for each, if something
differs. Needs usd-core and numpy.
"""

import os
import struct
import subprocess
import sys

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdUtils, UsdValidation, Vt

FAILURES = []
N_CHECKED = 0
PIECES = 4
TOLERANCE = 2e-6
# What attributes of ours are called in USD, by what they are called there before.
NAMES = {
    "displayColor": "groom_color", "Cd": "groom_color", "st": "groom_root_uv",
    "surface_uv_coordinate": "groom_root_uv", "groom_guides": "groom_guide", "id": "groom_id",
    "group": "groom_group_id",
}
OLD_VERSIONS = ["0.0.1", "0.1.0", "0.4.0", "0.6.0", "0.13.0"]


def check(is_right, what):
    global N_CHECKED
    N_CHECKED += 1
    if not is_right:
        FAILURES.append(what)


def near(a, b, what, tolerance=TOLERANCE):
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape:
        return check(False, f"{what}: {a.shape} values, {b.shape} wanted")
    error = float(np.abs(a - b).max()) if a.size else 0.0
    scale = float(np.abs(b).max()) if b.size else 1.0
    check(error <= tolerance * max(scale, 1e-9), f"{what}: off by {error:g} of {scale:g}")


# ---- Curves as polylines, from their definition ----

BASES = {
    "bezier": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]], float),
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]], float) / 6,
    "catmullRom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]], float) / 2,
}


def weights(kind, basis, wrap, n):
    """Rows of weights of control points, and rows of weights of segment ends; None if invalid."""
    if kind == "linear":
        n_segments = n if wrap == "periodic" else n - 1
        if n < (3 if wrap == "periodic" else 2):
            return None
        rows = np.eye(n)
        return (np.vstack([rows, rows[:1]]),) * 2 if wrap == "periodic" else (rows, rows)
    step = 3 if basis == "bezier" else 1
    # Control points with those that are made up, as rows of weights of the real ones.
    points = list(np.eye(n))
    if wrap == "pinned" and basis != "bezier":
        if n < 2:
            return None
        points = [2 * points[0] - points[1]] + points + [2 * points[-1] - points[-2]]
    elif wrap == "periodic":
        if n < 3 or (basis == "bezier" and n % 3):
            return None
        points = points + points[:1] if basis == "bezier" else points[-1:] + points + points[:2]
    if len(points) < 4 or (basis == "bezier" and (len(points) - 4) % 3):
        return None
    points = np.array(points)
    n_segments = (len(points) - 4) // step + 1
    n_ends = n_segments if wrap == "periodic" else n_segments + 1
    of_points, of_ends = [], []
    for segment in range(n_segments):
        last = segment == n_segments - 1
        for k in range(PIECES + last):
            t = k / PIECES
            row = np.array([t**3, t**2, t, 1]) @ BASES[basis]
            of_points.append(row @ points[segment * step : segment * step + 4])
            ends = np.zeros(n_ends)
            ends[segment] += 1 - t
            ends[(segment + 1) % n_ends] += t
            of_ends.append(ends)
    return np.array(of_points), np.array(of_ends)


def expected(path, frame, prim_path=None):
    """Of each prim: polylines in world space and centimetres, +Y up, and values per point."""
    stage = Usd.Stage.Open(path)
    cm = 100 * UsdGeom.GetStageMetersPerUnit(stage)
    up = UsdGeom.GetStageUpAxis(stage)
    prims = []
    for prim in stage.Traverse():
        own = [s for s in prim.GetPrimStack() if s.path.StripAllVariantSelections() == prim.GetPath()]
        if own and prim.IsA(UsdGeom.BasisCurves):
            prims.append(prim)
    times = set()
    for prim in prims:
        times |= set(UsdGeom.BasisCurves(prim).GetPointsAttr().GetTimeSamples())
        above = prim
        while above:
            if above.IsA(UsdGeom.Xformable):
                times |= set(UsdGeom.Xformable(above).GetTimeSamples())
            above = above.GetParent()
    times = sorted(times)
    time = Usd.TimeCode(times[frame]) if times else Usd.TimeCode.Default()
    result = []
    for prim in prims:
        if prim_path and not str(prim.GetPath()).startswith(prim_path):
            continue
        curves = UsdGeom.BasisCurves(prim)
        counts = curves.GetCurveVertexCountsAttr().Get(time)
        points = curves.GetPointsAttr().Get(time)
        if not counts or not points:
            continue
        kind, basis, wrap = (a.Get() for a in (curves.GetTypeAttr(), curves.GetBasisAttr(), curves.GetWrapAttr()))
        rows = [weights(kind, basis, wrap, n) for n in counts]
        if not any(rows):
            continue
        matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
        world = np.array(points, float) @ matrix[:3, :3] + matrix[3, :3]
        scale = abs(np.linalg.det(matrix[:3, :3])) ** (1 / 3)
        world = world * cm
        if up == "Z":
            world = np.stack([world[:, 0], world[:, 2], -world[:, 1]], axis=1)
        starts = np.concatenate([[0], np.cumsum(counts)])
        n_varying = [r[1].shape[1] if r else 0 for r in rows]
        ends = np.concatenate([[0], np.cumsum(n_varying)])
        kept = [ix for ix, r in enumerate(rows) if r]
        lines = [rows[ix][0] @ world[starts[ix] : starts[ix + 1]] for ix in kept]

        def per_point(values, label):
            values = np.array(values, float)
            values = values.reshape(len(values), -1)
            n = len(values)
            if n == ends[-1] and label == "varying":
                return np.vstack([rows[i][1] @ values[ends[i] : ends[i + 1]] for i in kept])
            if n == starts[-1]:
                return np.vstack([rows[i][0] @ values[starts[i] : starts[i + 1]] for i in kept])
            if n == ends[-1]:
                return np.vstack([rows[i][1] @ values[ends[i] : ends[i + 1]] for i in kept])
            if n == len(counts):
                return np.vstack([np.repeat(values[i : i + 1], len(rows[i][0]), 0) for i in kept])
            if n == 1:
                return np.repeat(values, sum(len(rows[i][0]) for i in kept), 0)
            return None

        values = {}
        widths = curves.GetWidthsAttr().Get(time)
        api = UsdGeom.PrimvarsAPI(prim)
        for primvar in api.FindPrimvarsWithInheritance():
            flat = primvar.ComputeFlattened(time)
            name = NAMES.get(primvar.GetPrimvarName(), primvar.GetPrimvarName())
            if flat is None or isinstance(flat, (str, Vt.StringArray, Vt.TokenArray)):
                continue
            if name == "widths":
                widths = flat
                continue
            flat = flat if hasattr(flat, "__len__") and not isinstance(flat, (Gf.Vec2f, Gf.Vec3f)) else [flat]
            found = per_point(flat, primvar.GetInterpolation())
            if found is not None:
                values.setdefault(name.lower() if name not in NAMES.values() else name, found)
        if widths:
            diameters = per_point(widths, curves.GetWidthsInterpolation()) * scale * cm
            if diameters.min() >= 0 and diameters.max() <= 10:
                values["widths"] = np.maximum(diameters, 1e-6)
        result.append((str(prim.GetPath()), lines, values))
    return result, len(times)


# ---- Strandlight ----


def run(*arguments):
    done = subprocess.run([STRANDLIGHT, *arguments], capture_output=True, text=True)
    return done.returncode, done.stderr


def imported(path, name, frame=0):
    """The polylines (cm, +Y up) of what Strandlight makes of `path`, and the .usda that it writes."""
    groom = os.path.join(TMP, name + ".groom")
    flags = ["--frame", str(frame)] if frame else []
    code, text = run("groom", "import", "--quiet", *flags, path, "-o", groom)
    if code != 0:
        check(False, f"{path}: not imported: {text.strip()}")
        return None
    data, usda = (os.path.join(TMP, name + end) for end in (".data", ".out.usda"))
    for out in (data, usda):
        code, text = run("export", "--quiet", groom, "-o", out)
        if code != 0:
            check(False, f"{path}: not exported: {text.strip()}")
            return None
    with open(data, "rb") as file:
        content = file.read()
    lines, at = [], 4
    for _ in range(struct.unpack_from("<i", content)[0]):
        (n,) = struct.unpack_from("<i", content, at)
        lines.append(100 * np.frombuffer(content, np.float32, 3 * n, at + 4).reshape(n, 3).astype(float))
        at += 4 + 12 * n
    return lines, usda


def validate(path):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    stage = Usd.Stage.Open(path)
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    check(len(validators) > 20, f"only {len(validators)} validators")
    for error in errors:
        check(False, f"{path}: {error.GetName()}: {error.GetMessage()}")


def compare(path, name, frame, wanted):
    found = imported(path, name, frame)
    if found is None:
        return
    lines, usda = found
    wanted_lines = [line for _, lines, _ in wanted for line in lines]
    check(len(lines) == len(wanted_lines), f"{path}: {len(lines)} strands, {len(wanted_lines)} wanted")
    if [len(a) for a in lines] != [len(a) for a in wanted_lines]:
        return check(False, f"{path}: numbers of points differ")
    near(np.vstack(lines), np.vstack(wanted_lines), f"{path} frame {frame}: points")
    # Ours again, by the library: one prim with all of it.
    validate(usda)
    ours, _ = expected(usda, 0)
    check(len(ours) == 1, f"{usda}: {len(ours)} prims")
    _, our_lines, our_values = ours[0]
    near(np.vstack(our_lines), np.vstack(wanted_lines), f"{usda} frame {frame}: points")
    everywhere = set.intersection(*(set(values) for _, _, values in wanted))
    for key in sorted(everywhere):
        whole = np.vstack([values[key] for _, _, values in wanted])
        if key not in our_values:
            check(False, f"{path}: {key} is missing")
        elif key in ("groom_id", "groom_group_id", "groom_guide") and len(our_values[key]) == len(whole):
            # Integers are not interpolated.
            rounded = np.all(our_values[key] == np.round(our_values[key]))
            check(rounded and np.abs(our_values[key] - whole).max() <= 0.5 + 1e-6, f"{path}: {key}")
        else:
            near(our_values[key], whole, f"{path} frame {frame}: {key}")
    # And back: the same values again.
    again = imported(usda, name + ".again")
    if again is not None:
        back, _ = expected(again[1], 0)
        near(np.vstack(back[0][1]), np.vstack(our_lines), f"{usda}: points that came back", 3e-7)
        check(set(back[0][2]) == set(our_values), f"{usda}: {set(back[0][2])} came back of {set(our_values)}")
        for key, values in back[0][2].items():
            near(values, our_values.get(key, values), f"{usda}: {key} that came back", 3e-7)


EXPORT = """
import sys
from pxr import Sdf
Sdf.Layer.FindOrOpen(sys.argv[1]).Export(sys.argv[2])
"""


def in_all_encodings(path):
    """The file itself, as text and binary of several versions by the library, and packaged."""
    stem = os.path.join(TMP, os.path.splitext(os.path.basename(path))[0])
    layer = Sdf.Layer.FindOrOpen(path)
    files = [path]
    for end in (".text.usda", ".binary.usdc", ".any.usd"):
        layer.Export(stem + end)
        files.append(stem + end)
    # An environment variable is the only way to have old versions written.
    for version in OLD_VERSIONS:
        old = f"{stem}.{version}.usdc"
        environment = dict(os.environ, USD_WRITE_NEW_USDC_FILES_AS_VERSION=version)
        # It reports versions that it writes and no longer reads as failures.
        subprocess.run([sys.executable, "-c", EXPORT, path, old], env=environment, capture_output=True)
        check(os.path.exists(old), f"{old}: not written by the library")
        files.append(old)
    package = stem + ".usdz"
    if os.path.exists(package):
        os.remove(package)
    UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(stem + ".binary.usdc"), package)
    return files + [package]


# ---- Files made here ----


def stage_of(name, meters=0.01, up="Y"):
    path = os.path.join(TMP, name + ".usda")
    if os.path.exists(path):
        os.remove(path)
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageMetersPerUnit(stage, meters)
    UsdGeom.SetStageUpAxis(stage, up)
    return path, stage


def curves_at(stage, path, counts, kind, basis, wrap, seed, size=10.0):
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(kind)
    if kind == "cubic" and basis != "bezier":
        curves.CreateBasisAttr(basis)
    if wrap != "nonperiodic":
        curves.CreateWrapAttr(wrap)
    curves.CreateCurveVertexCountsAttr(counts)
    random = np.random.default_rng(seed)
    points = random.uniform(-size, size, (sum(counts), 3)).astype(np.float32)
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    return curves, random


def make_kinds():
    files = []
    for kind, basis in (("linear", "bezier"), ("cubic", "bezier"), ("cubic", "bspline"), ("cubic", "catmullRom")):
        for wrap in ("nonperiodic", "pinned", "periodic"):
            name = f"{basis if kind == 'cubic' else kind}_{wrap}"
            counts = [6, 9, 3, 12] if basis == "bezier" and wrap == "periodic" else [7, 4, 13, 10, 4]
            path, stage = stage_of(name)
            for ix, interpolation in enumerate(("constant", "uniform", "varying", "vertex")):
                curves, random = curves_at(stage, f"/hair/{interpolation}", counts, kind, basis, wrap, ix)
                ends = sum(weights(kind, basis, wrap, n)[1].shape[1] for n in counts)
                n = {"constant": 1, "uniform": len(counts), "varying": ends, "vertex": sum(counts)}[interpolation]
                curves.CreateWidthsAttr(Vt.FloatArray.FromNumpy(random.uniform(0.1, 0.2, n).astype(np.float32)))
                curves.SetWidthsInterpolation(interpolation)
                api = UsdGeom.PrimvarsAPI(curves)
                color = api.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation)
                color.Set(Vt.Vec3fArray.FromNumpy(random.uniform(0, 1, (n, 3)).astype(np.float32)))
                stiff = api.CreatePrimvar("Stiff.ness".replace(".", "_"), Sdf.ValueTypeNames.HalfArray, interpolation)
                stiff.Set(Vt.HalfArray([float(x) for x in random.uniform(0, 1, n)]))
            stage.Save()
            files.append(path)
    return files


def make_transforms():
    path, stage = stage_of("transforms", 1.0, "Z")
    top = UsdGeom.Xform.Define(stage, "/top")
    top.AddTranslateOp().Set((0.1, 0.2, 1.7))
    top.AddRotateXYZOp().Set((10, 20, 30))
    top.AddScaleOp().Set((0.5, 0.5, 0.5))
    orders = [
        "RotateX", "RotateY", "RotateZ", "RotateXYZ", "RotateXZY", "RotateYXZ", "RotateYZX", "RotateZXY",
        "RotateZYX", "Orient", "Transform", "pivot", "reset", "double", "half", "uneven",
    ]
    for ix, order in enumerate(orders):
        curves, random = curves_at(stage, f"/top/{order}", [4, 5], "cubic", "bspline", "pinned", ix, 0.1)
        curves.CreateWidthsAttr([0.001])
        curves.SetWidthsInterpolation("constant")
        if order.startswith("Rotate") and len(order) == 7:
            getattr(curves, f"Add{order}Op")().Set(33.0 + ix)
        elif order.startswith("Rotate"):
            getattr(curves, f"Add{order}Op")().Set((11.0, -25.0, 140.0))
        elif order == "Orient":
            curves.AddOrientOp().Set(Gf.Quatf(0.9, 0.1, -0.3, 0.2).GetNormalized())
        elif order == "Transform":
            matrix = Gf.Matrix4d(0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.5, 0.0, 0.3, 0.4, 0.5, 1.0)
            curves.AddTransformOp().Set(matrix)
        elif order == "pivot":
            pivot = curves.AddTranslateOp(opSuffix="pivot")
            pivot.Set((0.1, 0.1, 0.3))
            curves.AddRotateYOp(UsdGeom.XformOp.PrecisionDouble).Set(45.0)
            curves.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
        elif order == "reset":
            curves.AddTranslateOp().Set((0.0, 0.0, 1.5))
            curves.SetResetXformStack(True)
        elif order == "double":
            curves.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(0.5, 0.5, -0.5, 0.5))
            curves.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set((2.0, 2.0, 2.0))
        elif order == "half":
            curves.AddOrientOp(UsdGeom.XformOp.PrecisionHalf).Set(Gf.Quath(0.5, 0.5, 0.5, 0.5))
            curves.AddTranslateOp(UsdGeom.XformOp.PrecisionHalf).Set(Gf.Vec3h(1, 2, 0.5))
        elif order == "uneven":
            curves.AddScaleOp().Set((1.0, -2.0, 3.0))
    stage.Save()
    return path


def make_primvars():
    path, stage = stage_of("primvars", 0.001)
    counts = [3] * 40
    top = UsdGeom.Xform.Define(stage, "/hair")
    above = UsdGeom.PrimvarsAPI(top).CreatePrimvar("groom_roughness", Sdf.ValueTypeNames.Float, "constant")
    above.Set(0.25)
    curves, random = curves_at(stage, "/hair/strands", counts, "linear", "bezier", "nonperiodic", 1, 100)
    # All the same: stored as a table of one value.
    curves.CreateWidthsAttr([0.7] * 120)
    curves.SetWidthsInterpolation("vertex")
    api = UsdGeom.PrimvarsAPI(curves)
    types = Sdf.ValueTypeNames

    def add(name, kind, interpolation, values, indices=None):
        primvar = api.CreatePrimvar(name, kind, interpolation)
        primvar.Set(values)
        if indices is not None:
            primvar.SetIndices(indices)

    add("st", types.TexCoord2fArray, "uniform", [(0.1, 0.2), (0.3, 0.4), (0.5, 0.6)], [ix % 3 for ix in range(40)])
    add("groom_id", types.Int64Array, "uniform", [1000 * ix for ix in range(40)])
    add("groom_group_id", types.IntArray, "uniform", [ix // 7 for ix in range(40)])
    add("groom_closest_guides", types.Int3Array, "uniform", [(ix, ix + 1, ix + 2) for ix in range(40)])
    add("groom_guide_weights", types.Float3Array, "uniform", [(0.5, 0.25, 0.25)] * 40)
    add("displayColor", types.Color3fArray, "vertex", [(0.1, 0.2, 0.3), (0.9, 0.8, 0.7)], [ix % 2 for ix in range(120)])
    add("dye", types.Float4Array, "constant", [(0.5, 0.25, 1.0, 0.75)])
    add("clump", types.DoubleArray, "uniform", [ix / 7 for ix in range(40)])
    add("whole", types.FloatArray, "vertex", [float(ix % 50) for ix in range(120)])
    add("steps", types.FloatArray, "vertex", [0.1 * (ix % 5) for ix in range(120)])
    add("flag", types.BoolArray, "uniform", [ix % 3 == 0 for ix in range(40)])
    add("label", types.StringArray, "uniform", ["a"] * 40)
    stage.Save()
    return path


def make_samples():
    path, stage = stage_of("samples")
    stage.SetTimeCodesPerSecond(25)
    top = UsdGeom.Xform.Define(stage, "/top")
    turn = top.AddOrientOp()
    turn.Set(Gf.Quatf(1, 0, 0, 0), 1.0)
    turn.Set(Gf.Quatf(0.5, 0.5, 0.5, 0.5), 5.0)
    move = top.AddTranslateOp()
    move.Set((0, 0, 0), 2.0)
    move.Set((10, 0, 0), 4.0)
    curves, random = curves_at(stage, "/top/hair", [4, 6, 5], "cubic", "catmullRom", "pinned", 3)
    points = curves.GetPointsAttr()
    for time in (1.0, 2.5, 3.0, 6.0):
        moved = random.uniform(-10, 10, (15, 3)).astype(np.float32)
        points.Set(Vt.Vec3fArray.FromNumpy(moved), time)
    curves.CreateWidthsAttr().Set([0.01], 1.0)
    curves.GetWidthsAttr().Set([0.03], 3.0)
    stage.Save()
    return path


def make_variants():
    path, stage = stage_of("variants")
    prim = UsdGeom.Xform.Define(stage, "/head").GetPrim()
    sets = prim.GetVariantSets().AddVariantSet("style")
    for ix, style in enumerate(("short", "long")):
        sets.AddVariant(style)
        sets.SetVariantSelection(style)
        with sets.GetVariantEditContext():
            curves_at(stage, "/head/hair", [4 + ix, 5], "linear", "bezier", "nonperiodic", ix)
            UsdGeom.XformCommonAPI(prim).SetTranslate((ix, 2, 3))
    curves, _ = curves_at(stage, "/off", [4], "linear", "bezier", "nonperiodic", 9)
    curves.GetPrim().SetActive(False)
    stage.CreateClassPrim("/kind")
    UsdGeom.BasisCurves(stage.OverridePrim("/kind/hair"))
    UsdGeom.BasisCurves.Define(stage, "/empty")
    blocked, _ = curves_at(stage, "/blocked", [4], "linear", "bezier", "nonperiodic", 9)
    blocked.GetPointsAttr().Block()
    stage.Save()
    return path


def main():
    samples = []
    if len(sys.argv) > 3:
        folder = os.path.join(sys.argv[3], "usd")
        ends = (".usd", ".usda", ".usdc", ".usdz")
        samples = [os.path.join(folder, f) for f in sorted(os.listdir(folder)) if f.endswith(ends)]
        check(len(samples) > 0, f"no USD files in {folder}")
    made = make_kinds() + [make_transforms(), make_primvars(), make_samples(), make_variants()]
    has_frames = "--frame" in run_help()
    for path in samples + made:
        files = in_all_encodings(path)
        # The library writes versions that it no longer reads: what is wanted is that of the first.
        _, n_frames = expected(path, 0)
        for frame in range(max(1, n_frames) if has_frames else 1):
            wanted, _ = expected(path, frame)
            for ix, file in enumerate(files):
                compare(file, f"{os.path.basename(path)}.{ix}.{frame}", frame, wanted)
    for failure in FAILURES:
        print(failure)
    print(f"USD: {N_CHECKED} comparisons, {len(FAILURES)} differences, {len(samples)} sample files")
    sys.exit(1 if FAILURES or N_CHECKED < 100 else 0)


def run_help():
    done = subprocess.run([STRANDLIGHT, "groom", "import", "--help"], capture_output=True, text=True)
    return done.stdout


if __name__ == "__main__":
    STRANDLIGHT, TMP = sys.argv[1], sys.argv[2]
    os.makedirs(TMP, exist_ok=True)
    main()
