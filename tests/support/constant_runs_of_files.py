"""Files, commands, campaigns, statistics, estimates, hints, and arguments beyond their limits."""

import tempfile
import warnings
from pathlib import Path

import numpy as np
from constant_battery import draw, droplets, jamlab, read, scenario


@scenario
def files(folder):
    found = []
    with tempfile.TemporaryDirectory() as kept:
        for p in (read(folder, "sp16"), droplets(), read(folder, "sticky"), read(folder, "flat")):
            for ending in ("h5", "data", "dump", "xyz"):
                path = Path(kept) / f"a.{ending}"
                try:
                    jamlab.write(path, p)
                    found.append(jamlab.read(path))
                except jamlab.JamlabError as error:
                    found.append(type(error).__name__)
        rng, p = np.random.default_rng(5), read(folder, "sp16")
        rows = "\n".join(f"{x:.6g},{y:.6g},{d / 2:.5g}" for (x, y), d in zip(p.positions, p.diameters, strict=True))
        (Path(kept) / "t.csv").write_text("x,y,radius\n" + rows + "\n")
        found.append(jamlab.read(Path(kept) / "t.csv", box=p.box, units="k"))
        rows = "\n".join(f"{x:.3g},{y:.3g}" for x, y in rng.uniform(0, 5, (120, 2)))
        (Path(kept) / "u.csv").write_text("x,y\n" + rows + "\n")
        try:
            found.append(jamlab.read(Path(kept) / "u.csv", box=[5, 5], units="k", radii=0.2))
        except jamlab.JamlabError as error:
            found.append(str(error))
        jamlab.write_contacts(Path(kept) / "c", p)
    return found


@scenario
def universes(folder):

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [jamlab.from_universe(jamlab.universe(p))[0] for p in (read(folder, "sp16"), droplets())]
        with tempfile.TemporaryDirectory() as kept:
            jamlab.write(Path(kept) / "a.dump", [read(folder, "sp16")] * 3)
            found += jamlab.from_universe(jamlab.universe(Path(kept) / "a.dump"))
    return found


@scenario
def page(folder):
    with tempfile.TemporaryDirectory() as kept:
        onset = read(folder, "onset")
        jamlab.write_page(Path(kept) / "a.html", [*jamlab.compress(onset, to=onset.phi + 0.01, step=0.005)])
        jamlab.write_page(Path(kept) / "b.html", droplets())
        return [(Path(kept) / name).stat().st_size for name in ("a.html", "b.html")]


@scenario
def figures(folder):
    p, q = read(folder, "sp64"), droplets()
    things = [p, q, jamlab.voids(p), jamlab.voids(q), jamlab.tessellation(p), jamlab.complex_modulus(p, [0.01, 1.0])]
    things += [jamlab.contacts(p), jamlab.slab(read(folder, "flat")), jamlab.hexatic_order(p)]
    things += [jamlab.rigid_clusters(p), read(folder, "walled")]
    with tempfile.TemporaryDirectory() as kept:
        draw(kept, *(each.plot for each in things if hasattr(each, "plot")))
    return [repr(each)[:300] for each in things]


@scenario
def commands(folder):
    from commands import call

    found = []
    with tempfile.TemporaryDirectory() as kept:
        state = str(folder / "sp16.h5")
        for words in (
            ("pack", "--n", "16", "--pressure", "0.02", "--json"),
            ("jam", "-n", "8", "-o", "j.h5"),
            ("compress", "j.h5", "--to", "0.9", "--step", "0.02", "--out", "s.h5"),
            ("analyze", state),
            ("analyze", "s.h5", "--csv", "s.csv"),
            ("gstar", state, "--points", "3"),
            ("shear", state, "--rate", "0.1", "--strain", "0.02"),
            ("convert", state, "p.data"),
            ("deck", "in.sp.shear", "--data", "p.data", "--out", "x"),
            ("--help",),
            ("jma",),
        ):
            done = call(kept, *words)
            found.append([done.exit_code, len(done.stdout.splitlines())])
    return found


@scenario
def campaign(folder):
    from campaigns import run_here, written

    with tempfile.TemporaryDirectory() as kept:
        path = written(
            Path(kept) / "c.toml",
            n=8,
            seeds=3,
            compress=None,
            pressures=[1e-2],
            observables=["spectra", "voids", "correlation"],
            omega=[0.1, 1.0],
            correlation_omega=[0.1],
        )
        c = jamlab.open_campaign(path)
        plan = str(c.plan()) if hasattr(c, "plan") else ""
        run_here(c)
        return [c.table(name) for name in ("states", "spectra", "voids")] + [len(plan)]


@scenario
def campaign_of_workers(folder):
    from campaigns import written

    with tempfile.TemporaryDirectory() as kept:
        c = jamlab.open_campaign(written(Path(kept) / "c.toml", n=8, seeds=2, compress={"to": 0.86, "step": 0.01}))
        c.run(workers=1)
        return [c.table("states"), c.mean("states") if hasattr(c, "mean") else 0]


@scenario
def statistics(folder):
    from jamlab.statistics import confidence
    from jamlab.statistics.data_collapse import fit_scaling_exponents
    from jamlab.statistics.herschel_bulkley import herschel_bulkley
    from jamlab.statistics.power_laws import fit_power_law

    rng, x = np.random.default_rng(3), np.geomspace(1e-4, 0.3, 25)
    noisy = 2.0 * x**0.5 * np.exp(0.1 * rng.normal(size=25))
    walk = np.convolve(rng.normal(size=600), np.ones(20) / 20, "valid")
    n, grid = np.array([32.0, 64.0, 128.0]), np.geomspace(1e-5, 0.1, 40)
    curves = [[(grid, grid * m**1.2 / (1 + (grid * m**1.2) ** 0.5) / m**0.3) for m in n]]
    rates = np.geomspace(1e-3, 1, 7)
    return [
        fit_power_law(x, noisy),
        fit_power_law(x, noisy, (0.5, 1.0)),
        fit_power_law(x, np.exp(-x)),
        confidence.block_average(walk),
        confidence.block_average(walk[:60]),
        confidence.block_average(np.cumsum(rng.normal(size=200))),
        confidence.block_average(rng.normal(size=40)),
        confidence.bootstrap([rng.normal(size=12)], lambda arrays: arrays[0].mean()),
        fit_scaling_exponents(n, curves, start=(1.5, 0.7)),
        herschel_bulkley(rates, 0.01 + 0.1 * rates**0.5, np.full(7, 1e-4)),
        herschel_bulkley(rates, 0.01 + 0.1 * rates**0.5 * (1 + 0.1 * rng.normal(size=7)), np.full(7, 3e-3)),
    ]


@scenario
def estimates(folder):
    p = read(folder, "sp500")
    return [
        str(jamlab.choose(0.9, {"z": 0.2, "g": 0.1})),
        str(jamlab.choose(0.86, {"d_shape_factor": 0.02})),
        *(str(jamlab.estimate_cost(name, 0.9, error)) for name, error in (("z", 0.05), ("g", 0.01), ("b", 0.02))),
        str(jamlab.estimate_cost("rho_J", None, 1e-3)),
        str(jamlab.choose_flow(p, rate=3e-2)),
        str(jamlab.choose_flow(p, omega=0.1, amplitude=1e-3)),
    ]


@scenario
def estimate(folder):
    found = jamlab.estimate("z", 0.86, 0.2)
    return [found.value, found.error, found.made if hasattr(found, "made") else 0]


@scenario
def scene(folder):
    return jamlab.scene(0.9, n=8, error={"z": 1.0})


@scenario
def hints(folder):
    said = []
    asked = [(jamlab, name) for name in ("pak", "g_prime", "psi6", "viscosity")]
    for thing, name in [*asked, (read(folder, "sp16"), "psi6")]:
        try:
            getattr(thing, name)
        except AttributeError as error:
            said.append(str(error))
    for arguments in ({"pressur": 1e-2}, {"mu": 0.1}, {"N": 16}):
        try:
            jamlab.pack(16, **arguments)
        except (jamlab.JamlabError, TypeError) as error:
            said.append(str(error))
    return said


@scenario
def refusals(folder):
    """Arguments beyond their limits."""
    p, said = read(folder, "sp16"), []
    calls = (
        lambda: jamlab.pack(10**7, 1e-2),
        lambda: jamlab.pack(16, 5.0),
        lambda: jamlab.jam(16, force_tolerance=1e-3),
        lambda: jamlab.jam(16, force_tolerance=1e-30),
        lambda: jamlab.shear(p, rate=1e9, strain=1.0),
        lambda: jamlab.shear(p, rate=1e-20, strain=1.0),
        lambda: jamlab.shear(p, rate=0.1, strain=1e9),
        lambda: jamlab.shear(p, rate=0.1, strain=1.0, tolerance=10.0),
        lambda: jamlab.oscillate(p, 1e-30, 1e-3),
        lambda: jamlab.oscillate(p, 1.0, 100.0),
        lambda: jamlab.creep(p, 1e9, 1.0),
        lambda: jamlab.quasistatic_shear(p, 1e6),
        lambda: jamlab.complex_modulus(p, [1e-300]),
        lambda: jamlab.pack(16, 1e-2, size_ratio=1e4),
        lambda: jamlab.ContactDamping(beta=1e30),
        lambda: jamlab.ContactDamping(alpha=0.1),
        lambda: jamlab.jam(16, "dp", law={"gamma": 1e40}),
    )
    for each in calls:
        try:
            each()
            said.append("done")
        except (jamlab.JamlabError, TypeError, ValueError) as error:
            said.append(str(error))
    return said
