"""Alembic's own library reads what Strandlight writes and the other way round: arrays, scopes,
attributes, and points in the world.

python alembic_check.py STRANDLIGHT TMPDIR [SAMPLES]

Run with a Python that has alembic3d and numpy. SAMPLES is a folder of real files with a folder `abc`
in it. Exit code 1, with a line for each, if something differs.
"""

import glob
import json
import math
import os
import struct
import subprocess
import sys

import imath
import numpy as np
from alembic3d import Abc, AbcCoreAbstract, AbcGeom
from alembic3d.AbcGeom import BasisType, CurvePeriodicity, CurveType, GeometryScope

FAILURES = []
N_CHECKS = 0
PER_SEGMENT = 3


def check(is_right, what):
    global N_CHECKS
    N_CHECKS += 1
    if not is_right:
        FAILURES.append(what)


def near(a, b, what, tolerance=1e-6):
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape:
        check(False, f"{what}: {a.shape} values, {b.shape} wanted")
        return
    error = float(np.abs(a - b).max()) if a.size else 0.0
    scale = float(np.abs(b).max()) if b.size else 1.0
    check(error <= tolerance * max(scale, 1e-9), f"{what}: off by {error:g} of {scale:g}")


def strandlight(*words, fails=False):
    run = subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)
    line = run.stderr.strip()
    check((run.returncode != 0) == fails, f"strandlight {' '.join(map(str, words))}: {line}")
    check("panicked" not in line, f"strandlight {' '.join(map(str, words))}: {line}")
    return run


def at(name):
    return os.path.join(TMP, name)


def points_of(groom):
    """Points of a .groom in centimetres, and points per strand."""
    path = groom + ".data"
    strandlight("export", groom, "-o", path, "--format", "usc")
    with open(path, "rb") as file:
        data = file.read()
    (n,), offset = struct.unpack_from("<i", data), 4
    points, counts = [], []
    for _ in range(n):
        (count,) = struct.unpack_from("<i", data, offset)
        points.append(np.frombuffer(data, "<f4", 3 * count, offset + 4).reshape(-1, 3))
        counts.append(count)
        offset += 4 + 12 * count
    return 100.0 * np.concatenate(points).astype(float), counts


def imported(name, *words):
    """Points in centimetres, points per strand and the lines that were said about a file."""
    groom = at(os.path.basename(name) + ".groom")
    run = strandlight("groom", "import", name, "-o", groom, *words)
    if run.returncode != 0:
        return None
    return (*points_of(groom), run.stderr)


# ---- Python's arrays as Alembic's, and back ----

ARRAYS = {
    ("f4", 1): imath.FloatArray,
    ("f8", 1): imath.DoubleArray,
    ("i4", 1): imath.IntArray,
    ("i2", 1): imath.ShortArray,
    ("u4", 1): imath.UnsignedIntArray,
    ("u1", 1): imath.UnsignedCharArray,
    ("f4", 2): imath.V2fArray,
    ("f4", 3): imath.V3fArray,
}
# Alembic's samples point to arrays and do not hold them.
KEPT = []
ITEMS = {imath.V2fArray: imath.V2f, imath.V3fArray: imath.V3f, imath.C3fArray: imath.Color3f}


def array(values, kind="f4", of=None):
    values = np.asarray(values)
    width = values.shape[1] if values.ndim == 2 else 1
    of = of or ARRAYS[kind, width]
    made = of(len(values))
    KEPT.append(made)
    item = ITEMS.get(of)
    for ix, value in enumerate(values.tolist()):
        made[ix] = item(*value) if item else value
    return made


def strings(values):
    made = imath.StringArray(len(values))
    KEPT.append(made)
    for ix, value in enumerate(values):
        made[ix] = value
    return made


def numbers(values):
    """An array of Alembic's as numpy's."""
    out = []
    for value in values:
        is_several = hasattr(value, "__getitem__") and not isinstance(value, str)
        out.append([value[ix] for ix in range(len(value))] if is_several else value)
    return np.array(out)


def matrix(m):
    return np.array([[m[row][column] for column in range(4)] for row in range(4)])


# ---- curves, evaluated here ----


def weights(basis, t):
    s = 1 - t
    if basis == BasisType.kBezierBasis:
        return np.array([s**3, 3 * t * s * s, 3 * t * t * s, t**3])
    if basis == BasisType.kBsplineBasis:
        return np.array([s**3, 3 * t**3 - 6 * t * t + 4, -3 * t**3 + 3 * t * t + 3 * t + 1, t**3]) / 6
    return np.array([-t + 2 * t * t - t**3, 2 - 5 * t * t + 3 * t**3, t + 4 * t * t - 3 * t**3, t**3 - t * t]) / 2


def polyline(cvs, kind, basis, wrap):
    """A curve drawn with PER_SEGMENT pieces a segment."""
    n, is_closed = len(cvs), wrap == CurvePeriodicity.kPeriodic
    if kind == CurveType.kLinear:
        return np.concatenate([cvs, cvs[:1]]) if is_closed else cvs
    step = 3 if basis == BasisType.kBezierBasis else 1
    if is_closed:
        starts = range(0 if step == 3 else -1, n if step == 3 else n - 1, step)
    else:
        starts = range(0, n - 3, step)
    points = []
    for start in starts:
        four = cvs[[(start + ix) % n for ix in range(4)]]
        points += [weights(basis, k / PER_SEGMENT) @ four for k in range(PER_SEGMENT)]
    points.append(weights(basis, 1.0) @ four)
    return np.array(points)


def de_boor(cvs, knots, n_pieces):
    """A cubic B-spline with knots, by the recursion of its definition."""

    def base(ix, degree, x):
        if degree == 0:
            inside = knots[ix] <= x < knots[ix + 1]
            ends = knots[ix] < x == knots[ix + 1] == knots[-1]
            return 1.0 if inside or ends else 0.0
        total = 0.0
        if knots[ix + degree] > knots[ix]:
            total += (x - knots[ix]) / (knots[ix + degree] - knots[ix]) * base(ix, degree - 1, x)
        if knots[ix + degree + 1] > knots[ix + 1]:
            right = knots[ix + degree + 1]
            total += (right - x) / (right - knots[ix + 1]) * base(ix + 1, degree - 1, x)
        return total

    n, points = len(cvs), []
    for span in range(3, n):
        start, end = knots[span], knots[span + 1]
        if end > start:
            points += [start + (end - start) * k / n_pieces for k in range(n_pieces)]
    points.append(knots[n])
    return np.array([sum(base(ix, 3, x) * cvs[ix] for ix in range(n)) for x in points])


# ---- files that Alembic's library writes ----

RANDOM = np.random.default_rng(3)


def clustered(counts):
    """Curves somewhere, one after another."""
    return (RANDOM.normal(size=(sum(counts), 3)) * 5).astype("f4")


def split(points, counts):
    return np.split(points, np.cumsum(counts)[:-1])


def bases():
    cases = [
        (CurveType.kLinear, BasisType.kNoBasis, False, [2, 3, 7]),
        (CurveType.kLinear, BasisType.kCatmullromBasis, False, [4, 5]),
        (CurveType.kLinear, BasisType.kNoBasis, True, [3, 5]),
        (CurveType.kCubic, BasisType.kBezierBasis, False, [4, 7, 10]),
        (CurveType.kCubic, BasisType.kBezierBasis, True, [6, 9]),
        (CurveType.kCubic, BasisType.kBsplineBasis, False, [4, 5, 9]),
        (CurveType.kCubic, BasisType.kBsplineBasis, True, [4, 7]),
        (CurveType.kCubic, BasisType.kCatmullromBasis, False, [4, 6, 6]),
        (CurveType.kCubic, BasisType.kCatmullromBasis, True, [5, 6]),
    ]
    for ix, (kind, basis, is_closed, counts) in enumerate(cases):
        name = at(f"basis_{ix}.abc")
        wrap = CurvePeriodicity.kPeriodic if is_closed else CurvePeriodicity.kNonPeriodic
        points = clustered(counts)
        archive = Abc.OArchive(name)
        curves = AbcGeom.OCurves(archive.getTop(), "curves")
        widths = AbcGeom.OFloatGeomParamSample()
        sample = AbcGeom.OCurvesSchemaSample(array(points), array(counts, "i4"), kind, wrap, widths)
        sample.setBasis(basis)
        curves.getSchema().set(sample)
        del curves, archive
        found = imported(name, "--samples-per-segment", PER_SEGMENT)
        if found:
            wanted = [polyline(cvs.astype(float), kind, basis, wrap) for cvs in split(points, counts)]
            check(found[1] == [len(line) for line in wanted], f"basis {ix}: points per strand")
            near(found[0], np.concatenate(wanted), f"basis {ix}: points")


def knots():
    """Knots as XGen and Maya write them: all, and without the ends; clamped and uniform."""
    for ix, (inner, drop, counts) in enumerate([("clamped", 0, [5, 8]), ("clamped", 1, [6]), ("uniform", 0, [7, 7]), ("uneven", 0, [6])]):
        name = at(f"knots_{ix}.abc")
        points, stored, wanted = clustered(counts), [], []
        for n, cvs in zip(counts, split(points, counts)):
            if inner == "uniform":
                own = [float(k) for k in range(n + 4)]
            else:
                middle = [float(k) for k in range(1, n - 3)]
                if inner == "uneven":
                    middle = [k * k / 2 for k in middle]
                end = (middle or [0.0])[-1] + 1
                own = [0.0] * 4 + middle + [end] * 4
            stored += own[drop : len(own) - drop]
            wanted.append(de_boor(cvs.astype(float), own, PER_SEGMENT))
        archive = Abc.OArchive(name)
        curves = AbcGeom.OCurves(archive.getTop(), "curves")
        sample = AbcGeom.OCurvesSchemaSample(
            array(points), array(counts, "i4"), CurveType.kCubic, CurvePeriodicity.kNonPeriodic
        )
        sample.setBasis(BasisType.kBsplineBasis)
        sample.setKnots(array(stored))
        curves.getSchema().set(sample)
        del curves, archive
        found = imported(name, "--samples-per-segment", PER_SEGMENT)
        if found:
            check(found[1] == [len(line) for line in wanted], f"knots {ix}: points per strand")
            near(found[0], np.concatenate(wanted), f"knots {ix}: points")


def op(kind, *values):
    made = AbcGeom.XformOp(kind)
    for ix, value in enumerate(values):
        made.setChannelValue(ix, value)
    return made


def stacks():
    """Every operation, nested, with and without inheritance; widths follow the scale."""
    kinds = AbcGeom.XformOperationType
    turned = imath.M44d(0.6, 0.8, 0.1, 0, -0.8, 0.6, 0, 0, 0.2, 0, 1.1, 0, 4, -2, 0.5, 1)
    outer = [op(kinds.kTranslateOperation, 1, 2, 3), op(kinds.kRotateOperation, 1, 1, 0.5, 30.0), op(kinds.kScaleOperation, 2, 2, 2)]
    inner = [op(kinds.kRotateXOperation, 20.0), op(kinds.kRotateYOperation, -50.0), op(kinds.kRotateZOperation, 110.0)]
    matrix_op = AbcGeom.XformOp(kinds.kMatrixOperation)
    matrix_op.setMatrix(turned)
    deep = [matrix_op, op(kinds.kScaleOperation, 0.5, 1.5, 1.0)]
    for inherits in [True, False]:
        name = at(f"stack_{int(inherits)}.abc")
        archive = Abc.OArchive(name)
        parent, world, scale = archive.getTop(), np.eye(4), 1.0
        for level, ops in enumerate([outer, inner, deep]):
            sample = AbcGeom.XformSample()
            for each in ops:
                sample.addOp(each)
            keeps = inherits or level != 1
            sample.setInheritsXforms(keeps)
            xform = AbcGeom.OXform(parent, f"level{level}")
            xform.getSchema().set(sample)
            own = matrix(sample.getMatrix())
            world = own @ world if keeps else own
            parent = xform
        counts = [3, 4]
        points, widths = clustered(counts), np.array([0.1, 0.2], "f4")
        curves = AbcGeom.OCurves(parent, "hair")
        sample = AbcGeom.OCurvesSchemaSample(
            array(points), array(counts, "i4"), CurveType.kLinear, CurvePeriodicity.kNonPeriodic,
            AbcGeom.OFloatGeomParamSample(array(widths), GeometryScope.kUniformScope),
        )
        curves.getSchema().set(sample)
        del curves, parent, xform, archive
        found = imported(name)
        if not found:
            continue
        near(found[0], points.astype(float) @ world[:3, :3] + world[3, :3], f"stack, inherits {inherits}: points")
        scale = abs(np.linalg.det(world[:3, :3])) ** (1 / 3)
        back = exported(name + ".groom")
        near(back["width"][0], widths * scale, f"stack, inherits {inherits}: widths")
        check(back["width"][1] == GeometryScope.kUniformScope, "stack: scope of widths")


def exported(groom):
    """What Alembic's library reads of a groom that is exported: arrays and scopes by name."""
    path = groom + ".out.abc"
    strandlight("export", groom, "-o", path)
    return arrays_of(path)


def arrays_of(path, object_path="/groom/hair"):
    item = Abc.IArchive(path).getTop()
    for name in object_path.strip("/").split("/"):
        item = item.getChild(name)
    schema = AbcGeom.ICurves(item.getParent(), item.getName()).getSchema()
    value = schema.getValue()
    found = {
        "P": (numbers(value.getPositions()), GeometryScope.kVertexScope),
        "nVertices": (numbers(value.getCurvesNumVertices()), GeometryScope.kUniformScope),
        "type": (value.getType(), value.getWrap()),
        "bounds": (value.getSelfBounds().min(), value.getSelfBounds().max()),
        "samples": schema.getNumSamples(),
    }
    widths = schema.getWidthsParam()
    if widths.valid():
        sample = widths.getExpandedValue()
        found["width"] = (numbers(sample.getVals()), sample.getScope())
    params = schema.getArbGeomParams()
    for ix in range(params.getNumProperties()) if params.valid() else []:
        header = params.getPropertyHeader(ix)
        for reader in READERS:
            if reader.matches(header):
                sample = reader(params, header.getName()).getExpandedValue()
                found[header.getName()] = (numbers(sample.getVals()), sample.getScope(), reader.__name__)
                break
        else:
            check(False, f"{path}: no type of Alembic's matches {header.getName()}")
    return found


READERS = [
    AbcGeom.IC4fGeomParam,
    AbcGeom.IC3fGeomParam,
    AbcGeom.IV2fGeomParam,
    AbcGeom.IV3fGeomParam,
    AbcGeom.IFloatGeomParam,
    AbcGeom.IInt16GeomParam,
    AbcGeom.IInt32GeomParam,
    AbcGeom.IStringGeomParam,
]


def param(kind, parent, name, values, scope, indices=None):
    made = getattr(AbcGeom, f"O{kind}GeomParam")(parent, name, indices is not None, scope, 1)
    sample = getattr(AbcGeom, f"O{kind}GeomParamSample")
    words = [values] if indices is None else [values, array(indices, "u4")]
    made.set(sample(*words, scope))


def attributes():
    """Unreal's schema and Houdini's names, with indices and without, in every type."""
    constant, uniform, vertex = GeometryScope.kConstantScope, GeometryScope.kUniformScope, GeometryScope.kVertexScope
    counts = [3, 2, 4]
    n, total = len(counts), sum(counts)
    points = clustered(counts)
    uv = RANDOM.uniform(size=(2, 2)).astype("f4")
    color = RANDOM.uniform(size=(total, 3)).astype("f4")
    closest = np.array([[0, 1, 2], [2, 1, 0], [1, 1, 1]], "f4")
    name = at("attributes.abc")
    archive = Abc.OArchive(name)
    top = AbcGeom.OXform(archive.getTop(), "groom")
    whole = top.getSchema().getUserProperties()
    Abc.OInt16Property(whole, "groom_version_major").setValue(1)
    Abc.OStringProperty(whole, "groom_tool").setValue("a test")
    curves = AbcGeom.OCurves(top, "hair")
    # One width a point under the label of one for all, as Blender writes them.
    widths = AbcGeom.OFloatGeomParamSample(array(np.full(total, 0.25)), constant)
    sample = AbcGeom.OCurvesSchemaSample(
        array(points), array(counts, "i4"), CurveType.kLinear, CurvePeriodicity.kNonPeriodic, widths
    )
    schema = curves.getSchema()
    schema.set(sample)
    arb, user = schema.getArbGeomParams(), schema.getUserProperties()
    param("Int16", arb, "groom_guide", array([0], "i2"), constant)
    param("Int32", arb, "groom_id", array([7, 5, 3], "i4"), uniform)
    param("V2f", arb, "groom_root_uv", array(uv), uniform, [1, 0, 1])
    param("C3f", arb, "groom_color", array(color, of=imath.C3fArray), vertex)
    param("C3f", arb, "Cd", array(color, of=imath.C3fArray), vertex)
    param("String", arb, "groom_group_name", strings(["fringe", "back"]), uniform, [0, 1, 0])
    param("V3f", arb, "groom_closest_guides", array(closest), uniform)
    param("Double", arb, "Twist.a", array([0.5, 0.25, 0.125], "f8"), uniform)
    param("Int32", arb, "too_big", array([1 << 25, 0, 1], "i4"), uniform)
    param("Float", arb, "odd", array([1.0, 2.0]), vertex)
    param("Int32", user, "clump", array([4, 4, 5], "i4"), uniform)
    del arb, user, schema, curves, whole, top, archive
    found = imported(name)
    if not found:
        return
    near(found[0], points, "attributes: points")
    for needle in ["too_big", "odd"]:
        check(needle in found[2], f"attributes: nothing is said of {needle}: {found[2]}")
    back = exported(name + ".groom")
    near(back["width"][0], np.full(total, 0.25), "attributes: width")
    near(back["groom_width"][0], np.full(total, 0.25), "attributes: groom_width")
    near(back["groom_root_uv"][0], uv[[1, 0, 1]], "attributes: groom_root_uv")
    near(back["groom_color"][0], color, "attributes: groom_color")
    near(back["groom_id"][0], [7, 5, 3], "attributes: groom_id", 0)
    near(back["groom_closest_guides"][0], closest, "attributes: groom_closest_guides", 0)
    near(back["twist_a"][0], [0.5, 0.25, 0.125], "attributes: twist_a", 0)
    near(back["clump"][0], [4, 4, 5], "attributes: clump", 0)
    near(back["groom_guide"][0], [0], "attributes: groom_guide", 0)
    for key, scope, kind in [
        ("groom_root_uv", uniform, "IV2fGeomParam"),
        ("groom_color", vertex, "IC3fGeomParam"),
        ("groom_id", uniform, "IInt32GeomParam"),
        ("groom_group_id", uniform, "IInt32GeomParam"),
        ("groom_guide", constant, "IInt16GeomParam"),
        ("groom_group_name", uniform, "IStringGeomParam"),
        ("groom_width", vertex, "IFloatGeomParam"),
    ]:
        check(back[key][1:] == (scope, kind), f"attributes: {key} is {back[key][1:]}")
    names = back["groom_group_name"][0].tolist()
    check(names == ["fringe", "back", "fringe"], f"attributes: names of groups are {names}")
    ids = back["groom_group_id"][0].tolist()
    check(ids == [0, 1, 0], f"attributes: groups are {ids}")
    missing = {"too_big", "odd", "Cd"} & set(back)
    check(not missing, f"attributes: {missing} should be left out")


def several():
    """Curves in several objects, guides among them, with a mesh."""
    name = at("several.abc")
    archive = Abc.OArchive(name)
    top = AbcGeom.OXform(archive.getTop(), "head")
    made = {}
    for key, counts, guide in [("fringe", [2, 3], 0), ("back", [4], 0), ("guides", [3, 3], 1)]:
        curves = AbcGeom.OCurves(top, key)
        made[key] = clustered(counts)
        sample = AbcGeom.OCurvesSchemaSample(
            array(made[key]), array(counts, "i4"), CurveType.kLinear, CurvePeriodicity.kNonPeriodic
        )
        curves.getSchema().set(sample)
        param("Int16", curves.getSchema().getArbGeomParams(), "groom_guide", array([guide], "i2"), GeometryScope.kConstantScope)
    mesh = AbcGeom.OPolyMesh(top, "skin")
    points = array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh.getSchema().set(AbcGeom.OPolyMeshSchemaSample(points, array([0, 1, 2], "i4"), array([3], "i4")))
    empty = AbcGeom.OCurves(top, "empty")
    nothing = AbcGeom.OCurvesSchemaSample(imath.V3fArray(0), imath.IntArray(0), CurveType.kLinear, CurvePeriodicity.kNonPeriodic)
    empty.getSchema().set(nothing)
    del empty, mesh, curves, top, archive
    found = imported(name)
    if found:
        near(found[0], np.concatenate([made["fringe"], made["back"]]), "several: points")
        for needle in ["2 guides", "1 meshes", "/head/empty"]:
            check(needle in found[2], f"several: nothing is said of {needle}: {found[2]}")
        back = exported(name + ".groom")
        check(back["groom_group_id"][0].tolist() == [0, 0, 1], "several: groups")
        check(back["groom_group_name"][0].tolist() == ["/head/fringe"] * 2 + ["/head/back"], "several: names of groups")
    found = imported(name, "--prim", "/head/guides")
    if found:
        near(found[0], made["guides"], "several: one object")
        check("2 curves, all guides" in found[2], f"several: guides are not named: {found[2]}")
    strandlight("groom", "import", name, "--prim", "/head/face", "-o", at("none.groom"), fails=True)


def moving():
    """Samples of points and of a transform, at even, cyclic and arbitrary times."""
    core = AbcCoreAbstract
    samplings = [
        core.TimeSampling(1 / 24, 0.5),
        core.TimeSampling(core.TimeSamplingType(2, 1.0), doubles([0.0, 0.25])),
        core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), doubles([0.0, 1.0, 1.5])),
    ]
    for ix, sampling in enumerate(samplings):
        name = at(f"moving_{ix}.abc")
        archive = Abc.OArchive(name)
        number = archive.addTimeSampling(sampling)
        xform = AbcGeom.OXform(archive.getTop(), "groom", number)
        curves = AbcGeom.OCurves(xform, "hair", number)
        counts, wanted = [2, 3], []
        for frame in range(3):
            points = clustered(counts)
            sample = AbcGeom.XformSample()
            sample.setTranslation(imath.V3d(frame, 10.0 * frame, 0))
            xform.getSchema().set(sample)
            curves.getSchema().set(AbcGeom.OCurvesSchemaSample(
                array(points), array(counts, "i4"), CurveType.kLinear, CurvePeriodicity.kNonPeriodic
            ))
            wanted.append(points + np.array([frame, 10.0 * frame, 0]))
        del curves, xform, archive
        for frame in range(3):
            found = imported(name, "--frame", frame)
            if found:
                near(found[0], wanted[frame], f"moving {ix}: points of frame {frame}")
        strandlight("groom", "import", name, "--frame", 3, "-o", at("none.groom"), fails=True)


def doubles(values):
    made = AbcCoreAbstract.TimeVector()
    for value in values:
        made.append(value)
    return made


def varying_topology():
    name = at("growing.abc")
    archive = Abc.OArchive(name)
    number = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 0.0))
    curves = AbcGeom.OCurves(archive.getTop(), "hair", number)
    for frame in range(3):
        counts = [3] * (frame + 1)
        curves.getSchema().set(AbcGeom.OCurvesSchemaSample(
            array(clustered(counts)), array(counts, "i4"), CurveType.kLinear, CurvePeriodicity.kNonPeriodic
        ))
    del curves, archive
    run = strandlight("groom", "import", name, "-o", at("none.groom"), fails=True)
    check("/hair: number of points" in run.stderr, f"strands that come are not named: {run.stderr}")


# ---- files that Strandlight writes ----


def ours():
    groom = at("ours.groom")
    strandlight("groom", "generate", "--style", "layered", "--strands", 300, "--points-per-strand", 9, "-o", groom)
    points, counts = points_of(groom)
    found = exported(groom)
    near(found["P"][0], points, "ours: points", 2e-7)
    check(found["nVertices"][0].tolist() == counts, "ours: points per curve")
    check(found["type"] == (CurveType.kLinear, CurvePeriodicity.kNonPeriodic), "ours: kind of curves")
    near(found["bounds"], [found["P"][0].min(0), found["P"][0].max(0)], "ours: bounds", 0)
    check(found["samples"] == 1, "ours: number of samples")
    info = json.loads(strandlight("inspect", groom, "--json").stdout)
    if "width" in found:
        near(found["width"][0].max(), info["diameter_cm"]["max"], "ours: widest")
    # Out and in again: nothing changes.
    again = imported(groom + ".out.abc")
    if again:
        near(again[0], points, "ours, read again: points", 0)
    with open(groom + ".out.abc", "rb") as file:
        first = file.read()
    strandlight("export", groom, "-o", at("again.abc"))
    with open(at("again.abc"), "rb") as file:
        check(file.read() == first, "ours: the same groom makes other bytes")
    top = Abc.IArchive(groom + ".out.abc").getTop().getChild("groom")
    whole = AbcGeom.IXform(top.getParent(), "groom").getSchema().getUserProperties()
    versions = [Abc.IInt16Property(whole, f"groom_version_{key}").getValue() for key in ["major", "minor"]]
    check(versions == [1, 5], f"ours: version {versions}")


def our_frames():
    names, wanted = [], []
    for frame in range(3):
        still, moved = at(f"still.{frame}.groom"), at(f"moved.{frame}.groom")
        strandlight("groom", "generate", "--style", "bob", "--strands", 40, "--points-per-strand", 6, "-o", still)
        strandlight("groom", "transform", still, "--translate", f"0,{frame + 1},0", "-o", moved)
        names.append(moved)
        wanted.append(points_of(moved)[0])
    path = at("ours_moving.abc")
    strandlight("groom", "export", *names, "--fps", 24, "-o", path)
    schema = AbcGeom.ICurves(Abc.IArchive(path).getTop().getChild("groom"), "hair").getSchema()
    check(schema.getNumSamples() == 3, "our frames: number of samples")
    for frame in range(3):
        selector = Abc.ISampleSelector(frame / 24)
        value = schema.getValue(selector)
        near(numbers(value.getPositions()), wanted[frame], f"our frames: points of frame {frame}", 2e-7)
        again = imported(path, "--frame", frame)
        if again:
            near(again[0], wanted[frame], f"our frames, read again: points of frame {frame}", 2e-7)


# ---- files of others ----


def curves_in(item, world=np.eye(4)):
    """Objects of curves below `item` with their transforms, by Alembic's library."""
    header = item.getHeader()
    if AbcGeom.IXform.matches(header):
        sample = AbcGeom.IXform(item.getParent(), header.getName()).getSchema().getValue()
        own = matrix(sample.getMatrix())
        world = own @ world if sample.getInheritsXforms() else own
    if AbcGeom.ICurves.matches(header):
        yield item, world
    for ix in range(item.getNumChildren()):
        yield from curves_in(item.getChild(ix), world)


def samples(folder):
    """Real files: what a curve passes through or near, at its first frame."""
    paths = sorted(glob.glob(os.path.join(folder, "abc", "*.abc")))
    check(bool(paths), f"no .abc in {folder}")
    for path in paths:
        found = imported(path, "--samples-per-segment", PER_SEGMENT, "--unit", "cm", "--up", "y")
        if not found:
            continue
        wanted = []
        for item, world in curves_in(Abc.IArchive(path).getTop()):
            schema = AbcGeom.ICurves(item.getParent(), item.getName()).getSchema()
            value = schema.getValue()
            cvs = numbers(value.getPositions()) @ world[:3, :3] + world[3, :3]
            counts = numbers(value.getCurvesNumVertices())
            own = numbers(value.getKnots()) if value.getKnots() else []
            for line in split(cvs, counts):
                wrap = value.getWrap()
                if wrap == CurvePeriodicity.kPeriodic and np.allclose(line[:3], line[-3:], atol=1e-5):
                    wrap = CurvePeriodicity.kNonPeriodic
                if len(own) == len(cvs) + 4 * len(counts):
                    mine, own = own[: len(line) + 4], own[len(line) + 4 :]
                    wanted.append(de_boor(line, list(mine), PER_SEGMENT))
                else:
                    wanted.append(polyline(line, value.getType(), value.getBasis(), wrap))
        name = os.path.basename(path)
        check(found[1] == [len(line) for line in wanted], f"{name}: points per strand {found[1][:5]}")
        if found[1] == [len(line) for line in wanted]:
            near(found[0], np.concatenate(wanted), f"{name}: points")


if __name__ == "__main__":
    BINARY, TMP = sys.argv[1:3]
    os.makedirs(TMP, exist_ok=True)
    for test in [bases, knots, stacks, attributes, several, moving, varying_topology, ours, our_frames]:
        try:
            test()
        except Exception as error:  # the other tests still run
            FAILURES.append(f"{test.__name__}: {error!r}")
    if len(sys.argv) > 3:
        samples(sys.argv[3])
    for line in FAILURES:
        print(f"alembic_check: {line}")
    print(f"alembic_check: {N_CHECKS} checks, {len(FAILURES)} failures")
    sys.exit(1 if FAILURES else 0)
