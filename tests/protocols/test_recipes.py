"""A packing is made again from its recipe, bit by bit; a packing that is not what its recipe makes has none."""

import json
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from laws_of_others import Ramp

import jamlab
from jamlab.packing.natural_units import natural_scales

SIZES = [1.0, 1.1, 1.2, 1.3, 1.4, 1.0, 1.1, 1.2]
JAM = {
    "disks": {"n": 12},
    "droplets": {"n": 6, "model": "dp"},
    "incremental": {"n": 6, "search": "incremental", "step": 1e-3},
    "shear-stabilized": {"n": 10, "ensemble": "shear-stabilized", "step": 0.02},
    "Hertz in k": {"n": 8, "law": "hertz", "units": "k", "force_tolerance": 1e-12},
    "sizes": {"n": 12, "sizes": "lognormal:0.2,random"},
    "given sizes": {"n": 8, "sizes": np.array(SIZES)},
    "two sizes": {"n": 12, "size_ratio": 1.2, "fraction_large": 0.25},
    "direct": {"n": 4, "model": "dp", "start": "direct", "law": {"gamma": 0.3}},
    "vertices": {"n": 4, "model": "dp", "law": {"vertices": [12, 13, 14, 15]}, "ensemble": "shear-stabilized"},
}
PACK = {
    "pressure": {"n": 16, "pressure": 1e-3},
    "low": {"n": 16, "pressure": 1e-6},
    "phi": {"n": 16, "phi": 0.9},
    "loose": {"n": 16, "phi": 0.7},
    "sticky": {"n": 16, "pressure": -1e-3, "law": {"stickiness": 0.04}},
    "network": {"n": 24, "phi": 0.6, "law": {"stickiness": 0.1}},
    "Hertz": {"n": 16, "pressure": 1e-3, "law": "hertz", "ensemble": "shear-stabilized"},
    "in eps": {"n": 16, "pressure": 1e-2, "units": "eps"},
    "sizes": {"n": 15, "pressure": 1e-2, "sizes": "uniform:0.2", "force_tolerance": 1e-13},
    "two sizes": {"n": 20, "pressure": 1e-2, "size_ratio": 2.0, "fraction_large": 0.25, "ranks": 1},
}
SCENE = {
    "auto": {"rho": 0.87, "error": {"z": 1.0}},
    "disks": {"rho": 0.86, "error": {"z": 2.0}, "model": "sp"},
    "step": {"rho": 0.87, "error": {"z": 2.0}, "step": 0.01},
    "Hertz": {"rho": 0.88, "error": {"z": 2.0}, "model": "sp", "law": "hertz"},
    "shear-stabilized": {"rho": 0.87, "error": {"z": 2.0}, "model": "sp", "ensemble": "shear-stabilized"},
    "in k": {"rho": 0.87, "error": {"z": 2.0}, "model": "sp", "units": "k", "force_tolerance": 1e-12},
    "sizes": {"rho": 0.87, "error": {"z": 2.0}, "model": "sp", "sizes": "lognormal:0.2"},
    "droplets": {"rho": 0.87, "error": {"z": 1e-2}, "model": "dp"},
    "dense droplets": {"rho": 0.90, "error": {"z": 1e-2}, "model": "dp"},
    "other droplets": {"rho": 0.87, "error": {"z": 1.0}, "model": "dp", "law": {"gamma": 0.3}, "size_ratio": 1.3},
}
CALLS = [
    *(pytest.param(jamlab.jam, how, id=f"jam {name}") for name, how in JAM.items()),
    *(pytest.param(jamlab.pack, how, id=f"pack {name}") for name, how in PACK.items()),
    *(pytest.param(jamlab.scene, {"n": 12} | how, id=f"scene {name}") for name, how in SCENE.items()),
]


def assert_same(one, other):
    """The same bits, of everything that a packing is."""
    assert one == other and one.positions.tobytes() == other.positions.tobytes()
    assert one.box.tobytes() == other.box.tobytes() and one.phi_J == other.phi_J and one.recipe == other.recipe
    assert {**one.known, "fixed": None} == {**other.known, "fixed": None}


def in_another_process(recipes, folder):
    """What a process that knows nothing but the recipes makes."""
    lines = [recipe.to_json() for recipe in recipes]
    (folder / "recipes.json").write_text(json.dumps(lines))
    code = "import json, jamlab\nfor k, line in enumerate(json.load(open('recipes.json'))):\n"
    code += "    jamlab.write(f'{k}.h5', jamlab.make(jamlab.Recipe.from_json(line)))"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=folder)
    return [jamlab.read(folder / f"{k}.h5") for k in range(len(lines))]


@pytest.mark.slow
@pytest.mark.parametrize(("function", "how"), CALLS)
def test_thirty_packings_are_made_again(function, how, tmp_path):
    made, second = function(seed=3, **how), function(seed=4, **how)
    assert_same(jamlab.make(made.recipe), made)
    assert_same(jamlab.make(replace(made.recipe, seed=4)), second)
    jamlab.write(tmp_path / "p.h5", made)
    assert_same(jamlab.make(jamlab.read(tmp_path / "p.h5").recipe), made)
    assert_same(in_another_process([made.recipe], tmp_path)[0], made)


@pytest.fixture(scope="module")
def onset():
    return jamlab.jam(12, seed=2)


@pytest.fixture(scope="module")
def packed():
    return jamlab.pack(32, 1e-2, seed=1)


def changes(onset, packed):
    """Packings that functions made of others."""
    states = list(jamlab.compress(onset, to=onset.phi + 0.02, step=0.01, force_tolerance=1e-13))
    droplets = jamlab.droplets_from_disks(states[-1], law={"gamma": 0.3}, seed=2)
    walled = jamlab.with_walls(packed, flat=True)
    return [
        *(states[0], states[-1], droplets),
        *(jamlab.relax(walled), jamlab.with_walls(packed, 1.5), jamlab.remove_rattlers(packed)),
        *(jamlab.decompress(packed, 1e-3), next(iter(jamlab.compress(packed, 0.86, 0.01, first_step=1e-3)))),
    ]


def test_what_was_done_afterwards_is_done_again(onset, packed, tmp_path):
    found = changes(onset, packed)
    for packing in found:
        assert_same(jamlab.make(packing.recipe), packing)
    jamlab.write(tmp_path / "states.h5", found[:2])
    for packing, read in zip(found[:2], jamlab.read_all(tmp_path / "states.h5"), strict=True):
        assert_same(read, packing)
    some = [packed, found[2]]
    for packing, made in zip(some, in_another_process([each.recipe for each in some], tmp_path), strict=True):
        assert_same(made, packing)
    assert_same(pickle.loads(pickle.dumps(found[2])), found[2])


def test_the_last_state_of_a_sweep_is_the_last_of_another_seed(onset):
    *_, dense = jamlab.compress(onset, to=0.86, step=0.02)
    *_, other = jamlab.compress(jamlab.jam(12, seed=5), to=0.86, step=0.02)
    assert dense.recipe.changes[-1][1]["state"] == -1
    assert_same(jamlab.make(replace(dense.recipe, seed=5)), other)


def test_a_sweep_that_was_interrupted_has_the_recipes_of_one_that_was_not(onset):
    from jamlab.protocols.compression import go_on

    whole = list(go_on(onset, onset, 0, 0.86, 0.01))
    rest = list(go_on(whole[0], onset, 1, 0.86, 0.01))
    for one, other in zip(whole[1:], rest, strict=True):
        assert_same(one, other)
    assert_same(jamlab.make(whole[1].recipe), whole[1])


def test_names_of_laws_and_of_files_are_kept_as_their_numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sizes.txt").write_text(" ".join(map(str, SIZES)))
    p = jamlab.pack(8, phi=0.8, sizes="from-file:sizes.txt", law="hertz")
    (tmp_path / "sizes.txt").unlink()
    assert p.recipe.sizes == tuple(SIZES) and p.recipe.law == {"exponent": 2.5}
    assert_same(jamlab.make(p.recipe), p)
    assert jamlab.make(replace(p.recipe, law={"exponent": 3.0})).params["exponent"] == 3.0


def test_a_file_of_sizes_may_change_while_a_packing_is_made(tmp_path):
    file = tmp_path / "sizes.txt"
    file.write_text(" ".join(map(str, SIZES)))

    def change(share, text):
        file.write_text(" ".join(["1.0"] * 8))

    for p in (
        jamlab.pack(8, 1e-2, sizes=f"from-file:{file}", progress=change),
        jamlab.jam(8, sizes=f"from-file:{file}", progress=change),
    ):
        assert jamlab.make(p.recipe) == p
        file.write_text(" ".join(map(str, SIZES)))


def test_a_packing_that_its_recipe_does_not_make_has_none(packed, tmp_path):
    with jamlab.Session(packed) as session:
        session.set_positions(packed.positions + 1e-9)
        moved = session.packing()
    single = tmp_path / "single.xyz"
    jamlab.write(single, packed)
    words = single.read_text().split()
    single.write_text(single.read_text().replace(words[-1], f"{float(words[-1]):.8g}"))
    run = jamlab.shear(packed, rate=1e-2, strain=0.01)
    others = {
        "positions": packed.with_state(positions=packed.positions + 1e-12),
        "box": packed.with_state(box=packed.box * (1 + 1e-15)),
        "sizes": packed.with_state(diameters=packed.diameters * (1 + 1e-15)),
        "law": packed.with_state(params={"k": 1.0, "exponent": 2.5}),
        "fixed": packed.with_state(fixed=np.arange(packed.n) < 3),
        "ensemble": packed.with_state(ensemble="shear-stabilized"),
        "converged": packed.with_state(converged=False),
        "select": packed.select(np.arange(packed.n) > 0),
        "session": moved,
        "flow": run.packing,
        "quasi-static": jamlab.quasistatic_shear(packed, 0.01, strain_step=0.01).packing,
        "a file of fewer digits": jamlab.read(single),
        "other units": natural_scales(packed.with_state(params={"k": 3.0})).to_natural(packed),
        "by hand": jamlab.Packing("sp", packed.box, packed.positions, packed.params, "k", packed.diameters),
        "relaxed": jamlab.relax(packed.with_state(positions=packed.positions + 1e-6)),
        "compressed": next(iter(jamlab.compress(packed.with_state(ensemble="shear-stabilized"), 0.87, 0.01))),
    }
    for name, packing in others.items():
        with pytest.raises(jamlab.InputError, match="has no recipe"):
            print(name, packing.recipe)
        assert "recipe" not in packing.provenance or name in ("ensemble", "converged", "a file of fewer digits"), name
    assert packed.with_state(provenance={"note": 1}).recipe == packed.recipe
    assert packed.with_state(positions=packed.positions.copy(), **packed.known).provenance["seed"] == 1


def test_a_recipe_is_a_value():
    one = jamlab.Recipe(protocol="onset", n=np.int64(8), seed=2, law={"exponent": np.float32(2.5)})
    assert one == jamlab.Recipe(protocol="onset", n=8, seed=2, law="hertz") and hash(one) == hash(replace(one))
    assert repr(one) == "Recipe(protocol='onset', n=8, seed=2, law={'exponent': 2.5})"
    assert one.search == "bisection" and one.start == "from-disks" and {one, replace(one, seed=3)} != {one}
    assert jamlab.Recipe.from_json(one.to_json()) == one
    with pytest.raises(jamlab.InputError, match="read-only"):
        one.law["exponent"] = 3.0
    whole, real = (jamlab.Recipe(protocol="onset", n=8, sizes=sizes) for sizes in ([1] * 8, [1.0] * 8))
    assert whole == real and hash(whole) == hash(real)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is no recipe"),
        ("[" * 100_000, "is no recipe"),
        ("[]", "give a JSON object"),
        ("{}", "it lacks protocol and n"),
        ('{"protocol": "onset", "n": 8, "self": 1}', "no argument 'self'; it takes protocol, n, model"),
        ('{"protocol": "onset", "n": 8, "tolerance": 1}', "use `force_tolerance`"),
    ],
)
def test_text_that_is_no_recipe_is_refused(text, said):
    with pytest.raises(jamlab.InputError) as refused:
        jamlab.Recipe.from_json(text)
    assert said in str(refused.value)


RECIPE = {"protocol": "onset", "n": 8}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"protocol": "flow"}, "protocol"),
        ({"n": 8.5}, "n = 8.5"),
        ({"pressure": 1e-3}, "pressure = 0.001: the protocol 'onset' has none; give None"),
        ({"protocol": "pressure"}, "pressure: give it"),
        ({"protocol": "phi", "phi": 0.8, "search": "bisection"}, "search = 'bisection'"),
        ({"protocol": "phi", "phi": 0.8, "model": "dp"}, "model = 'dp'"),
        ({"law": "hertzian"}, "'hertzian'"),
        ({"law": {"gamma": 0.3}}, "gamma"),
        ({"model": "dp", "law": "hertz"}, "exponent is a parameter of model sp"),
        ({"model": "dp", "units": "k"}, "units = 'k'"),
        ({"model": "dp", "size_ratio": 1.2}, "size_ratio = 1.2"),
        ({"start": "direct"}, "start = 'direct'"),
        ({"ensemble": "shear-stabilized", "search": "incremental"}, "incremental search"),
        ({"changes": ["relax"]}, "no pair"),
        ({"changes": [("shear", {"rate": 1.0})]}, "'shear' cannot be repeated"),
        ({"changes": [("compress", {})]}, "'to'"),
        ({"changes": [("relax", {"to": 1.0})]}, "'to'"),
        ({"changes": [("compress", {"to": 0.86, "step": 0.02, "state": 9})]}, "state 9"),
        ({"changes": [("compress", {"to": 0.86, "state": 0})]}, "state = 0: must be a whole number above 0"),
        ({"changes": [("compress", {"to": 0.86, "state": True})]}, "state = True"),
        ({"changes": [("compress", {"to": 0.86, "repeatable": "x"})]}, "repeatable = 'x'"),
        ({"changes": [("compress", {"to": 0.86, "step": 0})]}, "step = 0"),
        ({"changes": [("compress", {"to": 0.86, "by": "z"})]}, "unknown by 'z'"),
        ({"changes": [("compress", {"to": 0.86, "pressure_tolerance": -1.0})]}, "pressure_tolerance = -1"),
        ({"changes": [("compress", {"to": 0.86, "progress": True})]}, "progress is no part of a recipe"),
        ({"changes": [("relax", {"force_tolerance": "x"})]}, "force_tolerance = 'x'"),
    ],
)
def test_a_recipe_that_makes_nothing_is_refused(changed, said):
    with pytest.raises(jamlab.JamlabError) as refused:
        jamlab.make(jamlab.Recipe(**RECIPE | changed))
    assert said in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"law": {"exponent": 2.5}}, "give model too"),
        ({"model": "dp", "units": "k"}, "units = 'k'"),
        ({"model": "dp", "ensemble": "shear-stabilized"}, "in a fixed box"),
        ({"model": "sp", "law": {"gamma": 0.3}}, "gamma is a parameter of model dp"),
        ({"model": "sp", "law": {"stickiness": 0.1}}, "no onset"),
        ({"pressure": 1e-3}, "no argument 'pressure'"),
    ],
)
def test_a_scene_refuses_what_it_has_no_use_for(how, said):
    with pytest.raises(jamlab.InputError) as refused:
        jamlab.scene(0.87, 12, error={"z": 2.0}, **how)
    assert said in str(refused.value)


def test_a_scene_says_what_its_expected_errors_do_not_hold_for():
    shares = []
    with pytest.warns(jamlab.JamlabWarning, match="law, size_ratio: the expected errors are those of"):
        p = jamlab.scene(
            *(0.87, 12),
            error={"z": 2.0},
            model="sp",
            law="hertz",
            size_ratio=1.2,
            progress=lambda s, _: shares.append(s),
        )
    assert p.params["exponent"] == 2.5 and np.ptp(p.diameters) == pytest.approx(2 / 11)
    assert_same(jamlab.make(p.recipe), p)
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_units_are_those_that_are_asked_for():
    """eps (1 - r/s)^2 and k s^2 (1 - r/s)^2 are one law where all disks have s = 1, and two where they have not."""
    onset = jamlab.jam(8, seed=2, units="k")
    assert onset.params == {"k": 1.0} and onset.converged and onset.phi == onset.phi_J
    p = jamlab.pack(16, 1e-2, seed=1, units="eps")
    assert p.params == {"eps": 1.0} and jamlab.evaluate(p).pressure == pytest.approx(1e-2, rel=1e-6)
    equal, other = (jamlab.pack(16, phi=0.9, sizes="monodisperse", units=units) for units in ("eps", "k"))
    np.testing.assert_allclose(equal.positions, other.positions, rtol=0, atol=1e-9)
    assert jamlab.evaluate(equal).pressure == pytest.approx(jamlab.evaluate(other).pressure, rel=1e-9)
    assert p != jamlab.pack(16, 1e-2, seed=1)
    with pytest.raises(jamlab.InputError, match="units = 'k': law 'ramp' has units eps only"):
        jamlab.pack(16, phi=0.9, law=Ramp.name, units="k")
