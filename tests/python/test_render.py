"""Pictures: the command's pixels, whichever way a scene is given."""

import pickle

import numpy as np
import OpenEXR
import pytest

import strandlight as sl


def pixels_of(path):
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    return np.stack([channels[name].pixels for name in "RGBA"], axis=-1)


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ([], {}),
        (["--set", "hair.preset=blond"], {"set": {"hair.preset": "blond"}}),
        (["--set", "camera.fov_deg=12"], {"set": {"camera.fov_deg": 12}}),
        (["--size", "50x40", "--set", "render.background=none"], {"width": 50, "height": 40, "set": {"render.background": "none"}}),
        (["--samples", "4"], {"samples": 4}),
    ],
)
def test_pictures_are_the_commands(folder, tmp_path, strandlight, words, options):
    out = tmp_path / "a.exr"
    strandlight("render", folder / "scene.toml", "--backend", "cpu", "-o", out, *words)
    wanted = pixels_of(out)
    picture = sl.render(folder / "scene.toml", **options)
    assert picture.shape == wanted.shape and picture.dtype == np.float32
    assert np.array_equal(picture, wanted)
    assert picture[..., :3].max() > 0.05


def test_a_dict_and_objects_are_the_file(folder, tmp_path, monkeypatch):
    wanted = sl.render(folder / "scene.toml")
    groom, lights = sl.Groom.open(folder / "bob.groom"), sl.LightSet.open(folder / "sky.lights")
    scene = {
        "groom": {"file": folder / "bob.groom"},
        "lights": {"file": str(folder / "sky.lights")},
        "hair": {"preset": "auburn"},
        "render": {"size": np.array([96, 64])},
    }
    without = {key: scene[key] for key in ("hair", "render")}
    monkeypatch.chdir(folder)
    for picture in [
        sl.render(scene),
        sl.render("scene.toml"),
        sl.render(without, groom=groom, lights=lights),
        sl.render(scene, groom=groom),
        sl.render(scene | {"groom": {"file": "not there"}}, groom=groom),
        sl.render("scene.toml", lights=lights),
        sl.render(groom=groom, lights=lights, set={"hair.preset": "auburn"}, width=96, height=64),
    ]:
        assert np.array_equal(picture, wanted)


def test_frames_that_are_not_needed_are_not_read(folder, tmp_path):
    groom, lights = sl.Groom.open(folder / "bob.groom"), sl.LightSet.open(folder / "sky.lights")
    for ix in (1, 2):
        groom.save(tmp_path / f"pose.{ix:04}.groom")
    lights.save(tmp_path / "sky.lights")
    frames = 'frames = { files = "pose.%04d.groom", first = 1, last = 50 }'
    text = (folder / "scene.toml").read_text().replace("bob.groom", "pose.0001.groom")
    (tmp_path / "seq.toml").write_text(f"{text}\n[motion]\n{frames}\n")
    wanted = sl.render(tmp_path / "seq.toml", time=0.01)
    assert np.array_equal(sl.render(tmp_path / "seq.toml", time=0.01, lights=lights), wanted)
    keys = {"camera.fov_deg": 30}
    assert sl.render(tmp_path / "seq.toml", time=0.01, groom=groom, set=keys).shape == wanted.shape


def test_what_is_computed_may_be_written_to(folder):
    picture = sl.render(folder / "scene.toml", width=16, height=8)
    before = picture.copy()
    picture *= 2
    assert np.array_equal(picture, 2 * before)
    lights = sl.LightSet.open(folder / "sky.lights")
    values = sl.probe("table_C", k=[0, 1], lambda_=0.2, phi=1.0)
    for array in (picture, picture.srgb8(), lights.map(4), lights.evaluate([[0, 1, 0]]), values):
        assert array.flags.writeable


def test_proxies_of_a_dict(folder):
    scene = {"proxy": [{"kind": "ellipsoid", "centre": [0, 0, 0], "radii": [7, 11, 9]}], "render": {"size": [64, 48]}}
    groom, lights = sl.Groom.open(folder / "bob.groom"), sl.LightSet.open(folder / "sky.lights")
    with_head = sl.render(scene, groom=groom, lights=lights)
    assert not np.array_equal(with_head, sl.render({"render": {"size": [64, 48]}}, groom=groom, lights=lights))


def test_pictures_are_arrays_that_know_how_they_are_shown(folder, tmp_path, strandlight):
    picture = sl.render(folder / "scene.toml", set={"render.exposure": 1.5, "render.tone_map": "none"})
    assert (picture.exposure, picture.tone_map) == (1.5, "none")
    again = pickle.loads(pickle.dumps(picture))
    assert np.array_equal(again, picture) and again.exposure == 1.5
    crop = picture[10:20, 5:30]
    assert crop.exposure == 1.5 and crop._repr_png_().startswith(b"\x89PNG")
    assert type(np.asarray(picture)) is np.ndarray and picture[..., 0]._repr_png_() is None
    eight = picture.srgb8()
    assert eight.shape == picture.shape and eight.dtype == np.uint8
    assert np.array_equal(eight, sl.to_srgb8(np.asarray(picture), exposure=1.5, tone_map="none"))
    picture.save(tmp_path / "a.exr")
    assert np.array_equal(pixels_of(tmp_path / "a.exr"), picture)
    picture.save(tmp_path / "a.png")
    from PIL import Image

    shown = np.asarray(Image.open(tmp_path / "a.png").convert("RGBA"))
    assert np.array_equal(shown, eight)
    out = tmp_path / "its.png"
    strandlight("render", folder / "scene.toml", "--backend", "cpu", "-o", out, "--set", "render.exposure=1.5", "--set", "render.tone_map=none")
    assert np.array_equal(np.asarray(Image.open(out).convert("RGBA")), eight)


def test_pictures_are_shown_through_the_lut_of_their_scene(folder, tmp_path, strandlight, monkeypatch):
    from PIL import Image

    lut = tmp_path / "swapped.cube"
    rows = [f"{b} {g} {r}" for b in (0, 1) for g in (0, 1) for r in (0, 1)]
    lut.write_text("LUT_3D_SIZE 2\n" + "\n".join(rows) + "\n")
    keys = {"render.lut": lut, "render.lut_input": "srgb", "render.exposure": 1.0}
    picture = sl.render(folder / "scene.toml", set=keys)
    assert (picture.lut, picture.lut_input) == (str(lut), "srgb")
    again = pickle.loads(pickle.dumps(picture))
    assert again.lut == str(lut) and np.array_equal(again.srgb8(), picture.srgb8())
    plain = sl.to_srgb8(picture, exposure=1.0, tone_map="none")
    eight = picture.srgb8()
    assert np.abs(eight[..., [2, 1, 0]].astype(int) - plain[..., :3]).max() <= 1
    assert np.array_equal(eight, sl.to_srgb8(picture, exposure=1.0, lut=lut, lut_input="srgb"))
    out = tmp_path / "its.png"
    given = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
    strandlight("render", folder / "scene.toml", "--backend", "cpu", "-o", out, *given)
    assert np.array_equal(np.asarray(Image.open(out).convert("RGBA")), eight)
    # Of a groom in memory too, by a path that starts from the working folder.
    monkeypatch.chdir(tmp_path)
    groom, lights = sl.Groom.open(folder / "bob.groom"), sl.LightSet.open(folder / "sky.lights")
    small = {"render": {"size": [16, 12], "lut": "swapped.cube"}}
    assert sl.render(small, groom=groom, lights=lights).lut == str(lut)


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (lambda f: sl.render("not/there.toml"), "io", ["not/there.toml"]),
        (lambda f: sl.render(f / "sky.lights"), "format", ["sky.lights"]),
        (lambda f: sl.render(), "value", ["groom", "lights"]),
        (lambda f: sl.render({"groom": {"file": "x.groom"}, "lights": {"file": "x"}}), "io", ["groom.file", "x.groom"]),
        (lambda f: sl.render(f / "scene.toml", set={"hair.eta": 9}), "value", ["hair.eta is 9"]),
        (lambda f: sl.render(f / "scene.toml", set={"hair.etta": 1}), "value", ["hair.etta", "did you mean eta"]),
        (lambda f: sl.render({"hair": {"eta": "x"}}, lights=sl.LightSet.open(f / "sky.lights")), "syntax", []),
        (lambda f: sl.render(f / "scene.toml", width=0), "value", ["0x64"]),
        (lambda f: sl.render(f / "scene.toml", width=10**6), "value", ["1000000x64"]),
        (lambda f: sl.render(f / "scene.toml", width=2.5), "value", ["width", "2.5"]),
        (lambda f: sl.render(f / "scene.toml", samples=0), "value", ["samples"]),
        (lambda f: sl.render(f / "scene.toml", time=-1), "value", ["time"]),
        (lambda f: sl.render(3), "value", ["scene", "int"]),
        (lambda f: sl.render(f / "scene.toml", set={"hair.eta": object()}), "value", ["object"]),
        (lambda f: sl.render(f / "scene.toml", groom=sl.Groom.open(f / "bob.groom"), set={"groom.file": "x"}), "value", ["groom"]),
        (lambda f: sl.render(f / "scene.toml").save("a.jpg"), "value", ["a.jpg"]),
        (lambda f: sl.render(f / "scene.toml").save("no/folder/a.png"), "io", ["no/folder/a.png"]),
        (lambda f: sl.to_srgb8(np.ones((2, 2, 3))), "value", ["(2, 2, 3)"]),
        (lambda f: sl.to_srgb8(np.ones((2, 2, 4)), tone_map="x"), "value", ["filmic"]),
        (lambda f: sl.to_srgb8(np.ones((2, 2, 4)), lut="not/there.cube"), "io", ["not/there.cube"]),
        (lambda f: sl.to_srgb8(np.ones((2, 2, 4)), lut=f / "sky.lights"), "format", [".cube"]),
        (lambda f: sl.to_srgb8(np.ones((2, 2, 4)), lut="x.cube", lut_input="log"), "value", ["log2"]),
        (lambda f: sl.render(f / "scene.toml", set={"render.lut": "none.cube"}), "io", ["render.lut", "none.cube"]),
    ],
)
def test_errors_say_what_is_wrong(folder, call, kind, words):
    with pytest.raises(sl.Error) as found:
        call(folder)
    assert found.value.kind == kind, str(found.value)
    assert all(word in str(found.value) for word in words), str(found.value)
    if kind in ("io", "format"):
        assert found.value.path is not None
