"""Light sets: against the command, the formula, and OpenEXR's own library."""

import pickle

import numpy as np
import OpenEXR
import pytest
from conftest import sky

import strandlight as sl


def test_a_fit_is_the_commands_file(folder, tmp_path):
    fitted = sl.fit_lights(folder / "sky.exr", count=12)
    assert fitted.to_bytes() == (folder / "sky.lights").read_bytes()
    fitted.save(tmp_path / "a.lights")
    assert (tmp_path / "a.lights").read_bytes() == fitted.to_bytes()
    assert sl.LightSet.open(tmp_path / "a.lights") == fitted
    assert pickle.loads(pickle.dumps(fitted)) == fitted


def test_options_are_the_commands(folder, tmp_path, strandlight):
    out = tmp_path / "b.lights"
    strandlight("lights", folder / "sky.exr", "-o", out, "--count", 5, "--seed", 3, "--no-report")
    fitted = sl.fit_lights(str(folder / "sky.exr"), count=5, seed=3, report=False)
    assert fitted.to_bytes() == out.read_bytes()
    assert fitted.report is None and len(fitted) == 5


def test_an_array_of_any_type_is_fitted_as_its_file(folder):
    of_file = sl.LightSet.open(folder / "sky.lights")
    pixels = sky()
    turned = np.asfortranarray(pixels.astype(np.float64))
    for array in [pixels, turned, pixels[::-1][::-1], pixels.tolist()]:
        fitted = sl.fit_lights(array, count=12)
        assert np.array_equal(fitted.axes, of_file.axes)
        assert np.array_equal(fitted.rgb, of_file.rgb)
        assert fitted.report == of_file.report


def test_radiance_is_the_formula_and_the_commands_map(folder, tmp_path, strandlight):
    lights = sl.LightSet.open(folder / "sky.lights")
    assert lights.axes.shape == (12, 3) and lights.rgb.shape == (12, 3)
    assert np.allclose(lights.sharpness, 2 / lights.lambdas.astype(float) ** 2, rtol=1e-12)
    directions = np.random.default_rng(1).normal(size=(5, 7, 3))
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    cosines = unit @ lights.axes.T.astype(float)
    wanted = np.exp(lights.sharpness * (cosines - 1)) @ lights.rgb.astype(float)
    found = lights.evaluate(directions)
    assert found.shape == (5, 7, 3)
    assert np.allclose(found, wanted, rtol=1e-6)
    assert lights.evaluate([0, 1, 0]).shape == (3,)
    strandlight("export", folder / "sky.lights", "-o", tmp_path / "map.exr")
    channels = OpenEXR.File(str(tmp_path / "map.exr"), separate_channels=True).channels()
    exported = np.stack([channels[name].pixels for name in "RGB"], axis=-1)
    made = lights.map(exported.shape[0])
    assert made.shape == exported.shape and made.dtype == np.float32
    assert np.array_equal(made, exported)


def test_arrays_are_views_that_nobody_writes_to(folder):
    lights = sl.LightSet.open(folder / "sky.lights")
    for array in [lights.axes, lights.sharpness, lights.lambdas, lights.rgb]:
        with pytest.raises(ValueError):
            array[0] = 1
    assert np.shares_memory(lights.axes, lights.axes)


def test_lights_from_arrays_come_back():
    axes = np.array([[0, 2, 0], [1, 1, 0]])
    made = sl.LightSet.from_arrays(axes, [4, 8.5], np.ones((2, 3), np.float16))
    assert np.allclose(made.axes, [[0, 1, 0], [0.5**0.5, 0.5**0.5, 0]])
    assert np.allclose(made.sharpness, [4, 8.5], rtol=1e-6)
    assert np.allclose(made.evaluate([0, 1, 0])[0], 1 + np.exp(8.5 * (0.5**0.5 - 1)))
    # By falling energy, whatever their order was.
    turned = sl.LightSet.from_arrays(axes[::-1], [8.5, 4], np.ones((2, 3)))
    assert np.array_equal(turned.axes, made.axes) and np.array_equal(turned.sharpness, made.sharpness)


def test_pictures_of_it_are_png(folder, tmp_path, strandlight):
    lights = sl.LightSet.open(folder / "sky.lights")
    assert lights._repr_png_().startswith(b"\x89PNG")
    out = tmp_path / "p.png"
    strandlight("lights", folder / "sky.exr", "-o", tmp_path / "p.lights", "--count", 12, "--preview", out)
    assert lights.preview(folder / "sky.exr") == out.read_bytes()


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (lambda f: sl.fit_lights("not/there.exr"), "io", ["not/there.exr", "No such file"]),
        (lambda f: sl.fit_lights(f / "scene.toml"), "map", ["scene.toml"]),
        (lambda f: sl.LightSet.open(f / "bob.groom"), "format", ["bob.groom", "groom"]),
        (lambda f: sl.LightSet.from_bytes(b"SL"), "format", []),
        (lambda f: sl.fit_lights(np.ones((4, 8))), "value", ["(4, 8)", "float64", "(n, n, 3)"]),
        (lambda f: sl.fit_lights(np.ones((8, 16, 3), complex)), "value", ["complex128"]),
        (lambda f: sl.fit_lights(np.ones((8, 8, 3))), "map", ["8 x 8"]),
        (lambda f: sl.fit_lights(np.zeros((8, 16, 3))), "map", ["no light"]),
        (lambda f: sl.fit_lights(np.full((8, 16, 3), np.nan)), "map", ["NaN"]),
        (lambda f: sl.fit_lights(sky(8), count=0), "value", ["0", "1024"]),
        (lambda f: sl.fit_lights(sky(8), count=1.5), "value", ["count", "1.5"]),
        (lambda f: sl.LightSet.from_arrays([[0, 0, 0]], [1], [[1, 1, 1]]), "value", ["light 0"]),
        (lambda f: sl.LightSet.from_arrays([[0, 1, 0]], [-1], [[1, 1, 1]]), "value", ["-1"]),
        (lambda f: sl.LightSet.from_arrays([[0, 1, 0]], [1, 2], [[1, 1, 1]]), "value", ["sharpness", "(2,)"]),
        # By its number in the arrays, not by its energy's rank.
        (lambda f: sl.LightSet.from_arrays([[0, 1, 0], [1, 0, 0]], [1, 1], [[9, 9, 9], [1, -1, 1]]), "value", ["lights[1]", "-1"]),
        (lambda f: sl.LightSet.open(f / "sky.lights").evaluate([1, 2]), "value", ["(2,)"]),
        (lambda f: sl.LightSet.open(f / "sky.lights").evaluate([[0, 0, 0]]), "value", ["direction 0"]),
        (lambda f: sl.LightSet.open(f / "sky.lights").map(10**6), "value", ["1000000"]),
    ],
)
def test_errors_say_what_is_wrong(folder, call, kind, words):
    with pytest.raises(sl.Error) as found:
        call(folder)
    error = found.value
    assert error.kind == kind, str(error)
    assert all(word in str(error) for word in words), str(error)
    assert "\n" not in str(error)
    if words and "." in words[0] and kind in ("io", "format", "map") and "/" in str(error):
        assert error.path is not None and words[0] in error.path
    other = pickle.loads(pickle.dumps(error))
    assert (str(other), other.path, other.kind) == (str(error), error.path, error.kind)
