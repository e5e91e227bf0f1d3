"""The scattering model over arrays: each value is the command's, to the last bit."""

import json

import numpy as np
import pytest

import strandlight as sl

HAIR = {
    "eta": 1.55,
    "sigma_a": [0.2, 0.3, 0.5],
    "shift": {"r": -0.1, "tt": 0.05, "trt": 0.15},
    "width": {"r": 0.18, "tt": 0.09, "trt": 0.36},
    "caustic_width": 0.1,
}
LIGHT = {"theta": 0.1, "phi": 2.0, "lambda": 0.3}
VIEW = {"theta": 0.0, "phi": 0.4}
ANGLES = np.linspace(-1.2, 1.2, 5)
QUERIES = [
    ("table_C", {"k": np.arange(7), "lambda_": 0.2, "phi": ANGLES[:, None]}),
    ("table_H", {"mode": "TT", "k": 2, "eta": np.linspace(1.2, 1.8, 4), "theta_d": 0.3}),
    ("azimuthal", {"mode": "TRT", "lambda_": 0.2, "dphi": ANGLES, "theta_d": 0.1, "hair": HAIR}),
    ("azimuthal", {"mode": "R", "lambda_": 0.2, "dphi": ANGLES, "theta_d": 0.1, "hair": HAIR}),
    ("single", {"mode": "all", "light": LIGHT | {"theta": ANGLES}, "view": VIEW, "hair": HAIR}),
    ("single", {"mode": "TT", "light": LIGHT, "view": VIEW, "hair": HAIR | {"eta": np.array([1.4, 1.6])}}),
    ("single", {"mode": "TRT", "light": LIGHT, "view": VIEW, "hair": HAIR | {"sigma_a": np.random.default_rng(4).random((3, 3))}}),
    ("single", {"mode": "R", "light": LIGHT, "view": {"theta": ANGLES, "phi": ANGLES}, "hair": HAIR}),
    ("global", {"mode": "all", "light": LIGHT, "view": VIEW, "hair": HAIR, "sigma_f": np.array([0.1, 1.0])}),
    ("local", {"light": LIGHT, "view": VIEW | {"theta": ANGLES}, "hair": HAIR, "sigma_f": 0.3}),
    ("average", {"name": "a_f", "theta_d": ANGLES, "hair": HAIR}),
]


def scalars(value, shape, ix):
    """The query of one element."""
    if isinstance(value, dict):
        return {key.rstrip("_"): scalars(below, shape, ix) if key != "sigma_a" else colour(below, shape, ix) for key, below in value.items()}
    if isinstance(value, np.ndarray):
        return np.broadcast_to(value, shape)[ix].item()
    return value


def colour(value, shape, ix):
    return np.broadcast_to(value, (*shape, 3))[ix].tolist()


def shape_of(value):
    if isinstance(value, dict):
        return np.broadcast_shapes(*(shape_of(below)[:-1] if key == "sigma_a" and np.ndim(below) > 1 else () if key == "sigma_a" else shape_of(below) for key, below in value.items()))
    return np.shape(value) if isinstance(value, np.ndarray) else ()


@pytest.mark.parametrize("method", ["runtime", "reference", "paper"])
@pytest.mark.parametrize(("quantity", "keys"), QUERIES)
def test_values_are_the_commands(strandlight, quantity, keys, method):
    shape = shape_of(keys)
    queries = [{"q": quantity} | scalars(keys, shape, ix) for ix in np.ndindex(shape)]
    lines = "\n".join(map(json.dumps, queries)) + "\n"
    answers = strandlight("probe", "--method", method, stdin=lines).splitlines()
    wanted = np.array([json.loads(line)["value"] for line in answers])
    found = sl.probe(quantity, method=method, **keys)
    assert found.shape == shape + wanted.shape[1:]
    assert np.array_equal(found.reshape(wanted.shape), wanted)
    assert np.isfinite(found).all() and found.any()


@pytest.mark.parametrize(("quantity", "keys"), QUERIES)
def test_no_queries_have_answers_of_the_same_kind(quantity, keys):
    some = sl.probe(quantity, **keys)

    def emptied(value):
        if isinstance(value, dict):
            return {key: emptied(below) for key, below in value.items()}
        if isinstance(value, np.ndarray):
            return value[:0]
        return value

    none = sl.probe(quantity, **emptied(keys))
    n_queries = np.ndim(some) - (some.shape[-1:] == (3,))
    assert none.shape[n_queries:] == some.shape[n_queries:] and none.size == 0


def test_scalars_are_answered_by_scalars():
    assert sl.probe("table_C", k=2, lambda_=0.2, phi=1.0).shape == ()
    assert sl.probe("table_C", k=2, phi=1.0, **{"lambda": 0.2}) == sl.probe("table_C", k=2, lambda_=0.2, phi=1.0)
    assert sl.probe("single", mode="TT", light=LIGHT, view=VIEW, hair=HAIR).shape == (3,)
    assert sl.probe("table_C", k=2, lambda_=0.2, phi=np.empty((0, 4))).shape == (0, 4)
    assert sl.probe("table_C", k=2, lambda_=np.float32(0.25), phi=1) == sl.probe("table_C", k=2, lambda_=0.25, phi=1.0)


def test_the_closed_form_is_near_the_exact_model():
    light = LIGHT | {"phi": np.linspace(0, 2 * np.pi, 40)}
    closed, exact = (
        sl.probe("single", method=method, mode="TT", light=light, view=VIEW, hair=HAIR)
        for method in ("runtime", "reference")
    )
    assert np.abs(closed - exact).max() < 0.01 * exact.max()


def test_other_tables(tmp_path, strandlight):
    strandlight("tables", "-o", tmp_path / "s.tables", "--fresnel", "schlick")
    tables = sl.Tables.open(tmp_path / "s.tables")
    query = {"q": "single", "mode": "TT", "light": LIGHT, "view": VIEW, "hair": HAIR}
    answer = strandlight("probe", "--tables", tmp_path / "s.tables", stdin=json.dumps(query) + "\n")
    found = sl.probe("single", tables=tables, mode="TT", light=LIGHT, view=VIEW, hair=HAIR)
    assert found.tolist() == json.loads(answer)["value"]
    assert not np.array_equal(found, sl.probe("single", mode="TT", light=LIGHT, view=VIEW, hair=HAIR))
    assert sl.Tables.bake(fresnel="schlick") == tables
    lean = sl.Tables.bake(lean=True)
    assert "H_TT" not in lean.names and np.array_equal(lean["C"], sl.Tables()["C"])
    of_c = {"k": 1, "lambda_": 0.2, "phi": 0}
    assert sl.probe("table_C", tables=lean, **of_c) == sl.probe("table_C", **of_c)
    with pytest.raises(sl.Error) as found:
        sl.probe("table_H", tables=lean, mode="TT", k=2, eta=1.5, theta_d=0.1)
    assert "hold no H" in str(found.value)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sl.probe("table_D"), ["table_D", "table_C"]),
        (lambda: sl.probe("table_C", k=1, lambda_=[0.2, 20.0], phi=0), ["query 1", "lambda is 20.0"]),
        (lambda: sl.probe("table_C", k=1, lambda_=0.2, phi=np.nan), ["phi"]),
        (lambda: sl.probe("table_C", k=1, lambda_=0.2, phi=[0.0, np.nan]), ["query 1", "phi"]),
        (lambda: sl.probe("table_C", k=[0.5], lambda_=0.2, phi=0), ["k", "whole"]),
        (lambda: sl.probe("table_C", k=1, lambda_=0.2), ["phi"]),
        (lambda: sl.probe("table_C", k=1, lambda_=0.2, phi=0, psi=1), ["psi"]),
        (lambda: sl.probe("table_C", k=1, lambda_=0.2, phi=["a", "b"]), ["phi", "<U1"]),
        (lambda: sl.probe("table_C", k=1, lambda_=[0.2, 0.3], phi=[0, 1, 2]), ["broadcast", "(2,)", "(3,)"]),
        (lambda: sl.probe("single", mode="T", light=LIGHT, view=VIEW, hair=HAIR), ["mode", "TRT"]),
        (lambda: sl.probe("single", mode="TT", light=LIGHT, view=VIEW, hair=HAIR | {"sigma_a": np.ones((2, 2))}), ["hair.sigma_a", "(2, 2)"]),
        (lambda: sl.probe("single", mode="TT", light=LIGHT, view=[1.0], hair=HAIR), ["view"]),
        (lambda: sl.probe("table_C", method="exact", k=1, lambda_=0.2, phi=0), ["exact"]),
        (lambda: sl.probe("table_C", method="paper", segments=1, k=1, lambda_=0.2, phi=0), ["segments"]),
        (lambda: sl.Tables()["D"], ["D", "H_TT"]),
    ],
)
def test_errors_say_what_is_wrong(call, words):
    with pytest.raises(sl.Error) as found:
        call()
    assert found.value.kind == "value"
    assert all(word in str(found.value) for word in words), str(found.value)


def test_tables_are_arrays(folder, strandlight, tmp_path):
    tables = sl.Tables()
    strandlight("tables", "-o", tmp_path / "a.tables")
    (tmp_path / "t").mkdir()
    strandlight("export", tmp_path / "a.tables", "-o", tmp_path / "t")
    opened = sl.Tables.open(tmp_path / "a.tables")
    assert opened == tables, "the bundled ones"
    n_equal = 0
    for name in tables.names:
        channels = np.moveaxis(tables[name], -1, 0)
        exported = np.load(tmp_path / "t" / f"{name}.npy")
        # The export evaluates the coefficients of C; the others are as they are.
        if name != "C":
            assert np.array_equal(exported, channels), name
            n_equal += 1
        axes = tables.axes(name)
        assert channels.shape[1:] == exported.shape[1:] == tuple(len(axis["values"]) for axis in axes)
        assert len(tables.channels(name)) == len(channels)
        for axis in axes:
            centres = np.load(tmp_path / "t" / f"{name}_{axis['name']}.npy")
            assert np.array_equal(centres, axis["values"])
    assert n_equal == 6
