"""Grooms: from and to arrays exactly, from and to files as the command."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import strandlight as sl


def hair(n=40):
    random = np.random.default_rng(2)
    counts = random.integers(2, 9, n)
    points = random.normal(size=(counts.sum(), 3)).astype(np.float32) * 10
    return points, counts


def test_arrays_come_back_exactly(tmp_path):
    points, counts = hair()
    widths = np.linspace(0.004, 0.01, len(points), dtype=np.float32)
    uv = np.random.default_rng(3).random((len(counts), 2), np.float32)
    groom = sl.Groom.from_arrays(points, counts, widths, root_uv=uv, group=3)
    groom.save(tmp_path / "a.groom")
    for again in [groom, sl.Groom.open(tmp_path / "a.groom"), pickle.loads(pickle.dumps(groom))]:
        assert np.array_equal(again.points, points) and again.points.dtype == np.float32
        assert np.array_equal(again.counts, counts) and len(again) == len(counts)
        assert again.attributes == {"diameter": "point", "root_uv": "strand", "group": "groom"}
        assert np.array_equal(again.attribute("diameter"), widths)
        assert np.array_equal(again.attribute("root_uv"), uv)
        assert again.attribute("group").tolist() == [3]
        assert again == groom and hash(again) == hash(groom)
    first, last = counts[:3].sum(), counts[:4].sum()
    assert np.array_equal(groom.strand(3), points[first:last])
    assert np.array_equal(groom.strand(-1), points[-counts[-1] :])


def test_arrays_of_any_type_and_layout():
    points, counts = hair()
    wanted = sl.Groom.from_arrays(points, counts)
    for other in [points.astype(np.float64), np.asfortranarray(points), points[::-1][::-1], points.tolist()]:
        assert sl.Groom.from_arrays(other, counts) == wanted
    for other in [counts.astype(np.uint8), counts.astype(float), counts.tolist()]:
        assert sl.Groom.from_arrays(points, other) == wanted
    even = points[:30].reshape(6, 5, 3)
    assert np.array_equal(sl.Groom.from_arrays(even, 5).points, points[:30])


def test_units_and_axes():
    groom = sl.Groom.from_arrays([[0, 0, 1.7], [0.1, 0.2, 1.6]], [2], 0.0001, unit="m", up="z")
    assert np.allclose(groom.points, [[0, 170, 0], [10, 160, -20]])
    assert np.allclose(groom.attribute("diameter"), 0.01)


def test_arrays_are_the_grooms_memory():
    points, counts = hair()
    groom = sl.Groom.from_arrays(points, counts)
    assert groom.points is groom.points
    with pytest.raises(ValueError):
        groom.points[0] = 0
    kept = groom.points
    del groom
    assert np.array_equal(kept, points), "the array outlives the groom"
    points[:] = 0
    assert kept.any(), "what was given is not shared"


def test_generated_hair_is_the_commands(folder):
    groom = sl.Groom.generate("bob", strands=400, points_per_strand=12)
    assert groom.to_bytes() == (folder / "bob.groom").read_bytes()


@pytest.mark.parametrize(
    ("name", "words", "options"),
    [
        ("a.hair", [], {}),
        ("a.usda", [], {}),
        ("a.abc", ["--to", "unreal"], {"to": "unreal"}),
        ("b.usda", ["--to", "blender"], {"to": "blender"}),
        ("a.abc", ["--unit", "m", "--up", "z"], {"unit": "m", "up": "z"}),
        ("a.abc", ["--unit", 2.5], {"unit": 2.5}),
    ],
)
def test_files_are_the_commands(folder, tmp_path, strandlight, name, words, options):
    ours, its = tmp_path / name, tmp_path / f"its_{name}"
    groom = sl.Groom.open(folder / "bob.groom")
    groom.save(ours, **options)
    strandlight("groom", "export", folder / "bob.groom", *words, "-o", its)
    assert ours.read_bytes() == its.read_bytes()
    strandlight("groom", "import", its, "-o", tmp_path / "back.groom")
    assert sl.Groom.open(its).to_bytes() == (tmp_path / "back.groom").read_bytes()
    assert np.array_equal(sl.Groom.open(its).counts, groom.counts)


def test_files_of_the_wild_are_read_as_the_command_reads_them(tmp_path, strandlight):
    samples = os.environ.get("STRANDLIGHT_SAMPLES")
    if not samples:
        pytest.skip("STRANDLIGHT_SAMPLES names no folder")
    out = tmp_path / "a.groom"
    n_read = 0
    for name, options in [
        ("cyuksel_straight.hair", {}),
        ("cyuksel_straight.hair", {"unit": "in", "up": "y"}),
        ("abc", {}),
        ("abc", {"guides": "keep"}),
        ("usd", {}),
        ("usd", {"samples_per_segment": 2}),
        ("misc", {"root": "auto"}),
    ]:
        path = Path(samples) / "hair" / name
        files = sorted(path.rglob("*.*")) if path.is_dir() else [path]
        for file in files:
            words = [word for key, value in options.items() for word in (f"--{key.replace('_', '-')}", str(value))]
            try:
                strandlight("groom", "import", file, *words, "-o", out)
            except AssertionError:
                with pytest.raises(sl.Error):
                    sl.Groom.open(file, **options)
                continue
            assert sl.Groom.open(file, **options).to_bytes() == out.read_bytes(), (file, options)
            n_read += 1
    assert n_read > 10


def test_guesses_are_the_commands(tmp_path, strandlight):
    groom = sl.Groom.generate("wavy", strands=300, points_per_strand=8)
    groom.save(tmp_path / "a.hair", unit="m", up="z")
    out = tmp_path / "a.groom"
    strandlight("groom", "import", tmp_path / "a.hair", "--unit", "auto", "--up", "auto", "-o", out)
    guessed = sl.Groom.open(tmp_path / "a.hair", unit="auto", up="auto")
    assert guessed.to_bytes() == out.read_bytes()
    assert guessed.source["cm_per_unit"] == 100 and guessed.source["up"] == "z"


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (lambda f: sl.Groom.open("not/there.hair"), "io", ["not/there.hair"]),
        (lambda f: sl.Groom.open(f / "scene.toml"), "format", ["scene.toml"]),
        (lambda f: sl.Groom.open(f / "bob.groom", unit="m"), "value", ["bob.groom", "unit"]),
        (lambda f: sl.Groom.open(f / "bob.groom", guides="only"), "value", ["bob.groom", "no guides"]),
        (lambda f: sl.Groom.open(f / "bob.groom", guides="none"), "value", ["none"]),
        (lambda f: sl.Groom.open(f / "bob.groom").save("a.xyz"), "value", ["a.xyz"]),
        (lambda f: sl.Groom.open(f / "bob.groom").save("no/folder/a.groom"), "io", ["no/folder"]),
        (lambda f: sl.Groom.open(f / "bob.groom").save("a.abc", to="maya"), "value", ["maya", "unreal"]),
        (lambda f: sl.Groom.open(f / "bob.groom").save("a.usda", to="unreal"), "value", ["Alembic"]),
        (lambda f: sl.Groom.open(f / "bob.groom").attribute("uv"), "value", ["uv", "diameter"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((4, 2)), [4]), "value", ["(4, 2)", "float64"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((4, 3)), [3]), "value", ["3", "(4, 3)"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((4, 3)), [3, 1]), "value", ["strand 1"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((4, 3)), [4.5]), "value", ["counts"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((4, 3)), [-4]), "value", ["counts"]),
        (lambda f: sl.Groom.from_arrays(np.zeros((0, 3)), []), "value", ["number of strands"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, np.nan]] * 2, [2]), "value", ["points"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, 1e30]] * 2, [2]), "value", ["point 0"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, 1]] * 4, [4], [1, 2, 3]), "value", ["diameter", "(3,)"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, 1]] * 4, [4], 99.0), "value", ["diameter"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, 1]] * 4, [4], uv=["a"] * 4), "value", ["uv", "<U1"]),
        (lambda f: sl.Groom.from_arrays([[0, 0, 1]] * 4, [4], unit="ell"), "value", ["ell"]),
        (lambda f: sl.Groom.generate("mohawk"), "value", ["mohawk", "wavy"]),
    ],
)
def test_errors_say_what_is_wrong(folder, call, kind, words):
    with pytest.raises(sl.Error) as found:
        call(folder)
    assert found.value.kind == kind, str(found.value)
    assert all(word in str(found.value) for word in words), str(found.value)
    if kind in ("io", "format"):
        assert found.value.path is not None
