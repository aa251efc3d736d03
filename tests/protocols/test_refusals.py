"""What no search or modulus can start from: an error that names argument and value, in one line."""

import numpy as np
import pytest

import jamlab
from jamlab.packing.deformation import at_phi
from jamlab.protocols.decompression import decompress
from jamlab.protocols.size_distributions import SizeDistribution

NAN = float("nan")
CALLS = {  # function -> what is called with one argument replaced
    "jam": lambda p, **how: jamlab.jam(**{"n": 8} | how),
    "droplets": lambda p, **how: jamlab.jam(**{"n": 4, "model": "dp"} | how),
    "law of droplets": lambda p, **law: jamlab.jam(4, "dp", law=law),
    "law of disks": lambda p, **law: jamlab.jam(8, law=law),
    "law of droplets in their place": lambda p, **law: jamlab.droplets_from_disks(p, law=law),
    "pack": lambda p, **how: jamlab.pack(**{"n": 8, "pressure": 1e-3} | how),
    "compress": lambda p, **how: jamlab.compress(p, **{"to": 0.9, "step": 0.01} | how),
    "decompress": lambda p, **how: decompress(p, **{"pressure": 1e-4} | how),
    "droplets_from_disks": lambda p, **how: jamlab.droplets_from_disks(p, **how),
    "at_phi": lambda p, **how: at_phi(p, **how),
    "shear_modulus": lambda p, **how: jamlab.shear_modulus(p, **{"method": "finite-strain"} | how),
    "bulk_modulus": lambda p, **how: jamlab.bulk_modulus(p, **{"method": "finite-strain"} | how),
    "complex_modulus": lambda p, **how: jamlab.complex_modulus(p, **{"omega": [1.0]} | how),
    "contact drag": lambda p, **how: jamlab.ContactDamping(**how),
    "Stokes drag": lambda p, **how: jamlab.StokesDrag(**{"eta_f": 1.0} | how),
    "with_state": lambda p, **how: p.with_state(**how),
}
TOLERANCES = [0, -1e-9, NAN, 1e-16, 1e-2, "1e-9", True]
SIZES = ["log-normal:0.3", "lognormal", "lognormal:wide", "lognormal:nan", "lognormal:0.3,0.4", "lognormal:-0.3"]
SIZES += ["gaussian:0.9", "uniform:0.6", "bidisperse:1.4,1", "bidisperse:1.4,0.01", "bidisperse:0.5,0.5"]
SIZES += ["power-law:-3,2,1", "power-law:-3,1,1000", "from-file:nowhere.txt"]
REFUSED = [
    ("jam", "n", [0, 1, -4, 63, "x", 8.0, True]),
    ("jam", "seed", [-1, 1.5]),
    ("jam", "step", [0, -1e-3, NAN]),
    ("jam", "model", ["foam"]),
    ("jam", "start", ["direct"]),
    ("jam", "ensemble", ["npt"]),
    ("jam", "law", ["hertzian", 2.5, ["hertz"], {2.5: "exponent"}, {"law": 2.5}, {"law": "hertz", "exponent": 3.0}]),
    *(("jam", name, [1]) for name in ("gamma", "viscosity", "mdl_", "ensembel", "tolernc", "exponent", "params")),
    *(("law of disks", name, [1]) for name in ("gamma", "viscosity", "eps", "stickines")),
    ("law of droplets", "contact", ["sphere"]),
    ("law of droplets", "gamma", [-0.1]),
    ("law of droplets", "delta", [0.0]),
    ("law of droplets", "ka", [NAN]),
    ("law of droplets", "eps", ["strong"]),
    ("droplets", "law", ["hertz", "power", {"exponent": 2.5}]),
    ("droplets", "start", ["cold"]),
    ("droplets", "size_ratio", [2.0]),
    ("pack", "pressure", [-1e-3, 0.0, 5.0, NAN]),
    ("pack", "n", [7]),
    ("pack", "seed", [-2]),
    ("pack", "ensemble", ["npt"]),
    ("compress", "first_step", [0.0, -1e-5, 0.02, NAN, "x"]),
    ("compress", "pressure_tolerance", [0.0, -0.1, 1.5, NAN, True]),
    ("compress", "step", [2.0, 0.0, -0.01]),
    ("compress", "to", ["dense", 0.0, 1.01, NAN]),
    ("compress", "by", ["pressure"]),
    ("decompress", "pressure", [1e-2, 1e-9, -1.0, NAN]),
    ("decompress", "ranks", [0]),
    ("droplets_from_disks", "weight", [1.0]),
    ("law of droplets in their place", "weight", [1.0]),
    ("law of droplets in their place", "delta", [3.0]),
    ("at_phi", "phi", [2.1]),
    *((name, "strain_step", [0.0, -1e-6, 0.2, NAN, "x"]) for name in ("shear_modulus", "bulk_modulus")),
    *((name, "method", ["guess"]) for name in ("shear_modulus", "bulk_modulus", "complex_modulus")),
    ("shear_modulus", "direction", ["x", NAN, [[0.0]], ["simple"], [0.0, NAN], [], True]),
    ("complex_modulus", "omega", [0.0, -1.0, NAN, np.inf]),
    ("contact drag", "beta", [-1]),
    ("Stokes drag", "eta_f", [-1]),
    *((name, "tau", [0]) for name in ("contact drag", "Stokes drag")),
    *((name, "force_tolerance", TOLERANCES) for name in ("jam", "pack", "compress", "droplets_from_disks")),
    *((name, "sizes", SIZES) for name in ("jam", "pack")),
    ("with_state", "converged", [1]),
    ("with_state", "max_force", [-1.0, "small"]),
    ("with_state", "ensemble", ["npt"]),
]


@pytest.mark.parametrize(("call", "name", "values"), REFUSED, ids=[f"{call}-{name}" for call, name, _ in REFUSED])
def test_a_value_out_of_range_is_named(sp_jammed, call, name, values):
    for value in values:
        with pytest.raises(jamlab.InputError) as caught:
            CALLS[call](sp_jammed, **{name: value})
        text = str(caught.value)
        assert any(word in text for word in (name, str(value), repr(value), str(value).rpartition(",")[2])), text
        assert "\n" not in text


@pytest.mark.parametrize(
    "call",
    [
        lambda p: jamlab.pack(n=8, pressure=1e-6, force_tolerance=1e-9),  # forces that drown those of contacts
        lambda p: jamlab.jam(n=8, search="incremental", step=1e-13),  # states without end
        lambda p: jamlab.jam(n=8, search="incremental", ensemble="shear-stabilized"),
        lambda p: jamlab.pack(n=8, pressure=1e-3, size_ratio=1.4, sizes="monodisperse"),
        lambda p: jamlab.compress(p, to=2.5, step=0.1, by="phi"),
        lambda p: decompress(at_phi(p, 0.5), 1e-4),  # not jammed
        lambda p: decompress(p.with_state(positions=p.positions + np.sin(p.positions)), 1e-4),  # not at rest
        *(lambda p, sizes=s: jamlab.jam(n=2, sizes=sizes) for s in ([], [1.0], [1.0, -1.0], [1.0, NAN], [1.0, 1e6])),
        *(lambda p, v=v: jamlab.jam(3, "dp", sizes="lognormal:0.3", law={"vertices": v}) for v in ([8, 9], 2, 8.5)),
        lambda p: jamlab.jam(3, "dp", sizes=[1.0, 1.0]),
        lambda p: jamlab.jam(2, "dp", sizes=[1.0, 40.0]),  # line tension shrinks the small one to a point
        lambda p: jamlab.droplets_from_disks(p, law={"gamma": 10.0, "ka": 1.0}),
        lambda p: jamlab.pack(n=64, pressure=1e-3, sizes="gaussian:0.5"),  # one disk would have no diameter
        *(
            lambda p, text=t: SizeDistribution.of(text)
            for t in ("monodisperse:1", "monodisperse,foo", "uniform:1e-17", "gaussian:0")
        ),
    ],
)
def test_values_that_do_not_go_together_are_refused(sp_jammed, call):
    with pytest.raises(jamlab.InputError) as caught:
        call(sp_jammed)
    assert "\n" not in str(caught.value)


def test_droplets_are_refused_where_disks_are_meant(dp_onset):
    for call in (
        lambda: jamlab.droplets_from_disks(dp_onset),
        lambda: jamlab.complex_modulus(dp_onset, [1.0], prestress=False),
    ):
        with pytest.raises(jamlab.InputError):
            call()


def test_what_has_no_modulus_is_refused(random_disks, sp_jammed):
    """In balance, but buckling; not at a minimum; not jammed."""
    places = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    square = jamlab.Packing("sp", 4 * np.eye(2), places, {"k": 1.0}, "k", np.full(16, 1.1))
    assert jamlab.evaluate(square).max_force < 1e-14
    loose = sp_jammed.with_state(box=2 * sp_jammed.box, positions=2 * sp_jammed.positions)
    for packing in (square, random_disks(phi=1.1), loose):
        for modulus in (jamlab.shear_modulus, lambda p: jamlab.complex_modulus(p, [1.0])):
            with pytest.raises(jamlab.ConvergenceError):
                modulus(packing)
        if packing is not square:
            with pytest.raises(jamlab.ConvergenceError):
                jamlab.bulk_modulus(packing)


UNUSED = [  # what a way to call a function does not use
    ("strain_step", lambda p: jamlab.shear_modulus(p, strain_step=1e-6)),
    ("strain_step", lambda p: jamlab.bulk_modulus(p, "affine", strain_step=1e-6)),
    ("per_decade", lambda p: jamlab.compress(p, 0.9, per_decade=3)),
    ("channel", lambda p: jamlab.micrograph(labels=np.eye(9, dtype=int), channel="red")),
    ("stress", lambda p: jamlab.nonlinear_modulus(p, [1.0], stress=1e-4, amplitude=1e-3)),
    ("walls", lambda p: jamlab.quasistatic_shear(p, 1e-3, walls=True)),
    ("strain", lambda p: jamlab.shear(p, [(0.1, 0.01)], strain=0.2)),
]


@pytest.mark.parametrize(("name", "ask"), UNUSED)
def test_what_is_given_and_not_used_is_refused_by_name(name, ask, sp_jammed):
    with pytest.raises(jamlab.InputError, match=name):
        ask(sp_jammed)
