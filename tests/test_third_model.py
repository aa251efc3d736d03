"""A model that jamlab does not know, registered from outside: what it gives without a line in jamlab."""

import pickle

import numpy as np
import pytest
import twins
from campaigns import run_here, written
from commands import call

import jamlab
from jamlab.campaign.observable import DECLARED
from jamlab.engine.deck_defaults import numbers
from jamlab.mechanics.stiffness import energy_terms, forces, stress


@pytest.fixture(scope="module", autouse=True)
def register():
    with twins.registered():
        yield


@pytest.fixture(scope="module")
def onset():
    return jamlab.jam(16, "twin", 1)


@pytest.fixture(scope="module")
def dense(onset):
    return list(jamlab.compress(onset, to=0.93, step=0.04))[-1]


def shaken(packing, size):
    push = size * np.random.default_rng(1).normal(size=packing.positions.shape)
    return packing.with_state(positions=packing.positions + push)


def test_lammps_and_the_terms_in_numpy_are_one_law(dense):
    packing = shaken(dense, 0.02)
    found = jamlab.evaluate(packing)
    energies = {term.name: term.energy.sum() for term in energy_terms(packing)}
    assert min(energies.values()) > 0 and found.energy == pytest.approx(sum(energies.values()), rel=1e-12)
    assert found.contact_energy == pytest.approx(energies["contact"], rel=1e-12)
    assert np.abs(found.forces - forces(packing)).max() < 1e-12
    assert np.abs(found.stress - stress(packing)).max() < 1e-12


def test_forces_are_the_slope_of_the_energy(dense):
    packing, way = shaken(dense, 0.02), np.random.default_rng(2).normal(size=dense.positions.shape)
    energy = [
        sum(term.energy.sum() for term in energy_terms(packing.with_state(positions=packing.positions + step * way)))
        for step in (-1e-5, 1e-5)
    ]
    assert -(energy[1] - energy[0]) / 2e-5 == pytest.approx(np.vdot(forces(packing), way), rel=1e-7)


def test_jam_makes_what_is_asked_for(onset):
    """Both disks of a twin are where their spring holds them, and nothing is loose; by its word, too."""
    assert onset.model == "twin" and onset.n == 16 and len(onset.positions) == 32
    assert onset.converged and onset.phi_J == onset.phi and 0.8 < onset.phi < 0.92
    assert 0 < jamlab.evaluate(onset).contact_energy < 32 * numbers("onset")["u_jammed"]
    lengths = np.hypot(*np.diff(onset.positions.reshape(-1, 2, 2), axis=1)[:, 0].T)
    assert np.allclose(lengths, 0.5 * onset.diameters, rtol=1e-5)
    count = jamlab.maxwell_count(onset)
    assert count.self_stress_states == 1 and count.floppy_modes == 0
    assert onset.provenance["protocol_version"] == 1
    with pytest.raises(jamlab.InputError, match="use 'twin'"):
        jamlab.jam(16, "Twins", 1)
    with pytest.raises(jamlab.InputError, match=r"= 0\.4: gamma is a parameter of model dp"):
        jamlab.jam(16, "twin", law={"gamma": 0.4})
    with pytest.raises(jamlab.InputError, match="ranks = 2: twins"):
        jamlab.compress(onset, to=0.95, ranks=2)


def test_it_comes_down_to_a_pressure(dense):
    pressure = 0.5 * jamlab.evaluate(dense).pressure
    found = jamlab.decompress(dense, pressure)
    state = jamlab.evaluate(found)
    assert state.pressure == pytest.approx(pressure, rel=1e-6) and state.max_force <= 1e-12 and found.converged
    assert found.area > dense.area and np.array_equal(found.diameters, dense.diameters)


def test_a_compressed_packing_has_the_moduli_that_it_shows(dense):
    assert dense.converged and jamlab.packing_fraction(dense) == pytest.approx(0.93, abs=1e-6)
    linear, strained = (jamlab.shear_modulus(dense, method) for method in ("linear-response", "finite-strain"))
    assert linear == pytest.approx(strained, rel=1e-6) and linear < jamlab.shear_modulus(dense, "affine")
    bulk = [jamlab.bulk_modulus(dense, method) for method in ("linear-response", "finite-strain")]
    assert bulk[0] == pytest.approx(bulk[1], rel=1e-6)
    slow = jamlab.complex_modulus(dense, [1e-6], jamlab.StokesDrag())
    assert slow.storage[0] == pytest.approx(jamlab.shear_modulus(dense, direction="simple"), rel=1e-6)


def test_the_true_packing_fraction_counts_what_overlaps_once(dense):
    """Against points: the share of a fine grid that lies in a disk."""
    grid = np.stack(np.meshgrid(*2 * [np.linspace(0, dense.box[0, 0], 400, endpoint=False)]), axis=-1).reshape(-1, 1, 2)
    inside = np.zeros(len(grid), dtype=bool)
    for site, radius in zip(dense.positions, 0.5 * np.repeat(dense.diameters, 2), strict=True):
        r = grid[:, 0] - site
        inside |= np.hypot(*(r - np.round(r / dense.box[0, 0]) * dense.box[0, 0]).T) < radius
    assert inside.mean() == pytest.approx(jamlab.packing_fraction(dense), abs=2e-3)
    assert jamlab.packing_fraction(dense) < dense.phi


def test_files_and_pictures_hold_it(onset, dense, tmp_path):
    jamlab.write(tmp_path / "d.h5", dense)
    assert jamlab.read(tmp_path / "d.h5") == dense == pickle.loads(pickle.dumps(dense))
    axes = dense.plot()
    assert len(axes.collections[0].get_paths()) >= dense.n
    assert jamlab.measure(dense, "rho")["rho"] == pytest.approx(0.93, abs=1e-6)
    measured = jamlab.measure(dense)
    unsaid = {"shape_factor", "shape_factor_rim", "area", "voids", "void_sides", "void_area", "void_shape_factor"}
    of_edges = {"shortest_edge", "longest_edge", "contact_length"}
    assert {name for name, value in measured.items() if np.isnan(value)} == (unsaid | of_edges) & measured.keys()
    jamlab.write_page(tmp_path / "d.html", [onset, dense])
    page = (tmp_path / "d.html").read_text()
    assert "16 twins" in page and "does not say where twins end" in page


@pytest.mark.parametrize("name", ["d.data", "d.dump", "d.xyz"])
def test_text_files_give_it_back(dense, name, tmp_path):
    """To the last digit; a dump has no word for the model, which its columns tell."""
    fixed = dense.with_state(fixed=np.arange(16) == 3)
    jamlab.write(tmp_path / name, fixed)
    assert jamlab.read(tmp_path / name) == fixed


def test_half_a_particle_is_refused(dense, tmp_path):
    jamlab.write(tmp_path / "d.xyz", dense)
    lines = (tmp_path / "d.xyz").read_text().splitlines()
    (tmp_path / "d.xyz").write_text("\n".join(["31", *lines[1:-1]]) + "\n")
    with pytest.raises(jamlab.JamlabError, match="31 atoms are no twins, of 2 atoms each"):
        jamlab.read(tmp_path / "d.xyz")


def test_a_universe_gives_it_back_also_where_the_box_has_cut_it(dense):
    """A twin on the edge of the box, wrapped atom by atom, is whole again."""
    universe = jamlab.universe(dense)
    assert len(universe.bonds) == 16
    (back,) = jamlab.from_universe(universe)
    assert back.model == "twin" and np.allclose(back.positions, dense.positions, atol=1e-5)
    universe.load_new(universe.atoms.wrap(inplace=False)[None], dimensions=universe.dimensions[None], order="fac")
    (cut,) = jamlab.from_universe(universe)
    moved = cut.positions - dense.positions
    assert np.abs(universe.atoms.positions[:, :2] - dense.positions).max() > 1
    assert np.allclose(moved[::2], moved[1::2], atol=1e-5)


def test_what_it_leaves_out_is_refused_by_name(dense):
    asked = {
        "Shape.boundary": lambda: jamlab.voids(dense),
        "Shape.outline": lambda: jamlab.measure(dense, ["z", "shape_factor"]),
        "Shape.relative_areas": lambda: jamlab.measure([dense, dense], "area"),
        "Flow.jacobian": lambda: jamlab.complex_modulus(dense, [1.0]),
        "Flow.carrier": lambda: jamlab.shear(dense, rate=1e-2, strain=0.01),
    }
    for method, ask in asked.items():
        with pytest.raises(jamlab.InputError, match=rf"model twin does not say `{method}`.*class Twins"):
            ask()


def test_flat_walls_are_refused_and_rough_ones_hold_it(dense):
    with pytest.raises(jamlab.InputError, match="flat: model twin"):
        jamlab.with_walls(dense, flat=True)
    walled = jamlab.relax(jamlab.with_walls(dense, thickness=1.2))
    assert (
        walled.converged
        and walled.walls
        and np.abs(jamlab.evaluate(walled).forces[walled.frame.fixed_sites]).max() == 0
    )


def test_quasistatic_shear_needs_no_drag(dense):
    run = jamlab.quasistatic_shear(dense, 4e-3, 2e-3)
    assert np.isfinite(run.stress).all() and run.stress[-1] != run.stress[0]


def test_the_command_makes_it(tmp_path):
    done = call(tmp_path, "jam", "--model", "twin", "--n", "8", "--law", "aspect=0.7", "--out", "d.h5")
    assert done.exit_code == 0, done.stderr
    found = jamlab.read(tmp_path / "d.h5")
    assert found.model == "twin" and found.params["aspect"] == 0.7 and found.converged


def strongest(packing):
    return jamlab.contacts(packing).forces.size.max()


def test_a_campaign_runs_it_with_an_observable_of_another_package(tmp_path, monkeypatch):
    """In this process, which alone knows both: other processes find what is an entry point."""
    monkeypatch.setitem(DECLARED._entries, "strongest", strongest)
    sweep = {"model": "twin", "n": 8, "seeds": 1, "compress": {"to": 0.93, "step": 0.03}}
    file = written(tmp_path / "c.toml", **sweep, observables=["states", "strongest"])
    campaign = jamlab.open_campaign(file, tmp_path / "c")
    run_here(campaign)
    states = campaign.table("states")
    assert set(states["model"]) == {"twin"} and states["converged"].all()
    assert (np.diff(states["rho"]) > 0).all() and states["strongest"].iloc[-1] > states["strongest"].iloc[0] > 0
    assert states["shape_factor"].isna().all() and not states["g"].isna().all()
    with pytest.raises(jamlab.InputError, match="for model sp only: give twins a separate sweep with compress"):
        jamlab.open_campaign(written(file, model="twin", n=8, compress=None, pressures=[1e-2]))


def test_its_deck_part_lies_in_its_own_folder():
    assert twins.TWINS.part.parent.name == "support" and twins.TWINS.part.is_file()


def test_units_that_a_model_does_not_name_are_refused(dense, monkeypatch):
    monkeypatch.setattr(type(dense.kind), "unit_names", {"eps": dense.unit_names})
    with pytest.raises(jamlab.InputError, match="unknown units 'k': use one of eps"):
        jamlab.Packing("twin", dense.box, dense.positions, {"k": 1.0}, "k", diameters=dense.diameters)
