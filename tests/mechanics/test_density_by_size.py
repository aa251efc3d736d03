"""D(omega) of several N: waves of lattices against closed forms, parts against single densities, bad input."""

import numpy as np
import pytest

import jamlab
from jamlab.mechanics import density_by_size as module

SPACING = 0.95


def lattice(cells):
    """Unit disks in a triangular lattice, cells by cells."""
    i, j = np.divmod(np.arange(cells * cells), cells)
    places = SPACING * np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j])
    box = SPACING * np.diag([cells, cells * np.sqrt(0.75)])
    return jamlab.Packing("sp", box, places, {"k": 1.0}, "k", np.ones(cells * cells))


@pytest.fixture(scope="module")
def packings():
    return [jamlab.pack(n, 1e-2, seed) for n in (32, 16) for seed in (1, 2, 3)]


def test_the_lowest_wave_of_a_lattice_falls_as_its_length():
    """Waves of springs of stiffness 1 along three directions; beta = 1 in two dimensions."""
    found = jamlab.density_by_size([lattice(cells) for cells in (6, 10)], 5, omega_exponent=1.0, prestress=False)
    along = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])
    for cells, lowest in zip((6, 10), found.lowest, strict=True):
        k = 2 * np.pi / (cells * SPACING) * np.array([[1, 0], [0, 1 / np.sqrt(0.75)]])
        phases = 2 * (1 - np.cos(SPACING * k @ along.T))
        exact = np.linalg.eigvalsh(np.einsum("kc,ci,cj->kij", phases, along, along)).min()
        assert lowest == pytest.approx(np.sqrt(exact), rel=1e-9)
    assert found.lowest_exponent == pytest.approx(1.0, abs=0.05) and np.isnan(found.lowest_stderr).all()


def test_each_size_has_its_own_density(packings):
    edges, how = np.geomspace(0.1, 2.0, 6), {"rattlers": False, "masses": {"density": 2.0}}
    found = jamlab.density_by_size(packings, edges, **how)
    assert found.n_particles.tolist() == [16, 32]
    for n, density in zip(found.n_particles, found.densities, strict=True):
        own = jamlab.density_of_states([p for p in packings if p.n == n], edges, **how)
        assert np.array_equal(density.density, own.density) and density.packings == 3
    lowest = [
        modes.frequencies[~modes.zero].min()
        for p in packings[3:]
        for modes in [jamlab.lowest_modes(jamlab.remove_rattlers(p), None)]
    ]
    plain = jamlab.density_by_size(packings, edges, rattlers=False)
    assert plain.lowest[0] == pytest.approx(np.mean(lowest), rel=1e-12)
    assert plain.lowest_stderr[0] == pytest.approx(np.std(lowest, ddof=1) / np.sqrt(3), rel=1e-12)


def test_the_collapse_is_what_the_law_says(packings):
    """omega N^(1/5) and D N^(4/5); few modes give the same as all, up to where they end."""
    edges = np.geomspace(0.1, 0.4, 4)
    table = jamlab.density_by_size(packings, edges).to_dataframe()
    assert table["scaled_omega"].to_numpy() == pytest.approx(table["omega"] * table["n"] ** 0.2)
    assert table["scaled_density"].to_numpy() == pytest.approx(table["density"] * table["n"] ** 0.8)
    few = jamlab.density_by_size(packings, edges, count=20).to_dataframe()
    assert few["density"].to_numpy() == pytest.approx(table["density"].to_numpy(), rel=1e-9)


def test_the_picture(packings):
    axes = jamlab.density_by_size(packings, np.geomspace(0.1, 2.0, 6)).plot(linewidth=3)
    assert [line.get_label() for line in axes.lines] == ["$N$ = 16, 3 packings", "$N$ = 32, 3 packings"]
    assert axes.get_xscale() == axes.get_yscale() == "log" and axes.lines[0].get_linewidth() == 3
    assert "N^{0.2}" in axes.get_xlabel() and "m}" in axes.get_xlabel()


def other(n, **how):
    return jamlab.pack(n, how.pop("pressure", 1e-2), 9, **how)


BAD = {
    "none": (lambda p: [], {}, "packings: give one or more"),
    "one": (lambda p: p[0], {}, "packings"),
    "pressure": (lambda p: [p[0], other(16, pressure=1e-3)], {}, "differ in pressure"),
    "law": (lambda p: [p[0], other(16, law={"exponent": 2.5})], {}, "differ in exponent"),
    "twice": (lambda p: [p[0], p[0]], {}, "are of the same packing"),
    "sizes": (lambda p: [p[0], other(16, sizes=np.linspace(0.9, 1.1, 16))], {}, "differ in sizes"),
    "bins": (lambda p: p, {"bins": [1.0, 0.5]}, "ascending"),
    "beyond": (lambda p: p, {"bins": [0.0, 9.0], "count": 8}, "only the modes up to"),
    "beta": (lambda p: p, {"omega_exponent": 0.0}, "omega_exponent = 0"),
    "few": (lambda p: p, {"count": 1, "bins": [0.0, 1e-9]}, r"packings\[3\] has no mode with a frequency above zero"),
    "masses": (lambda p: p, {"masses": np.ones(16)}, "16 numbers for 32 particles"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_has_no_common_collapse_is_refused(name, packings):
    given, how, words = BAD[name]
    with pytest.raises(jamlab.InputError, match=words):
        module.density_by_size(given(packings), **{"bins": 4} | how)
