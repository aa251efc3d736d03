"""Decks of soft particles run in plain lmp and give what the Python engine gives."""

import re

import numpy as np
import pytest
from deck_runs import disks, frame, number, rows, run

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.geometry.contact_network import LEAST_CONTACTS
from jamlab.kernels.installed_files import installed
from jamlab.packing.deformation import at_phi
from jamlab.packing.lammps_files import described
from jamlab.protocols.random_start import random_disks
from tests.support.reference import evaluate as plain_sums


def shear_stress(packing: jamlab.Packing) -> float:
    stress = jamlab.evaluate(packing).stress
    return float(np.hypot(0.5 * (stress[0, 0] - stress[1, 1]), stress[0, 1]))


def bond_order(packing: jamlab.Packing) -> np.ndarray:
    """psi_6 of every disk: mean of exp(6 i angle) over the bonds to its six nearest neighbors."""
    shifts = np.array([[a, b] for a in range(-2, 3) for b in range(-2, 3)]) @ packing.box
    psi = []
    for x in packing.positions:
        r = (packing.positions[:, None] - x + shifts).reshape(-1, 2)
        nearest = r[np.argsort(np.hypot(*r.T))[1:7]]
        psi.append(np.mean(np.exp(6j * np.arctan2(nearest[:, 1], nearest[:, 0]))))
    return np.array(psi)


def test_sp_jams_and_shears(tmp_path):
    """in.sp.jam finds an onset in the paper's window; in.sp.shear takes its file to phi and gives a modulus."""
    text = run("in.sp.jam", tmp_path, n=32, seed=4, to=0.86)
    assert 0.78 < number("phi_J", text) < 0.87
    protocol = defaults("onset")
    assert float(protocol["u_contact"]) <= number("with u", text) <= float(protocol["u_jammed"])
    assert rows(text, 4)[:, 3].max() <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") >= 2
    sheared = run("in.sp.shear", tmp_path, phi_target=0.95)
    assert np.isfinite(number("modulus G_xy", sheared))


def test_sp_shear_deck_gives_the_modulus_of_linear_response(tmp_path):
    """One packing through jamlab.write_data and plain lmp: the same G as by the analytic Hessian."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(packing), rel=1e-3)
    assert number("error", text) < 1e-3 * number("modulus G_xy", text)
    text = run("in.sp.shear", tmp_path, code=2, data="packing.data", phi_target=0, strain=1e-14)
    assert "\nNO MODULUS" in text and "relaxed shear modulus" not in text


def test_sp_shear_deck_takes_several_steps(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7, steps_shear=3)
    assert rows(text, 4)[:, 0] == pytest.approx([0, 1e-7, 2e-7, 3e-7], rel=1e-5)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(dense), rel=1e-3)


@pytest.mark.parametrize(("to", "nearest"), [(0.9, 1e-4), (0.96, None)])
def test_sp_compress_deck_goes_through_the_states_of_python(tmp_path, dense, to, nearest):
    """Down by log-spaced steps, up by equal ones."""
    states = list(jamlab.compress(dense, to, 0.01, by="phi", nearest=nearest))
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.compress", tmp_path, data="packing.data", to=to, nearest=nearest or 0, above=0.01)
    found = rows(text, 4)
    evaluated = [jamlab.evaluate(state) for state in states]
    assert found[:, 0] == pytest.approx([state.phi for state in states], abs=1e-9)
    assert found[:, 1] == pytest.approx([e.energy / dense.n for e in evaluated], rel=1e-8)
    assert found[:, 2] == pytest.approx([e.pressure for e in evaluated], rel=1e-8)
    assert found[:, 3].max() <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") == 1 + len(states)
    last = disks(tmp_path / "sp.compressed.data", dense)
    assert jamlab.evaluate(last).pressure == pytest.approx(found[-1, 2], rel=1e-9)


def test_sp_compress_deck_ends_below_onset_where_nothing_touches(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.compress", tmp_path, code=2, data="packing.data", to=0.5, nearest=0, above=0.05)
    assert "\nUNJAMMED" in text and list(rows(text, 4)[:, 1] > 1e-16)[-2:] == [True, False]
    assert (tmp_path / "sp.unjammed.data").exists() and not (tmp_path / "sp.compressed.data").exists()


@pytest.mark.parametrize("deck", ["compress", "shear", "bulk", "stabilize", "minimize"])
def test_without_a_minimum_a_deck_fails_and_gives_no_number(tmp_path, dense, deck):
    jamlab.write_data(tmp_path / "packing.data", at_phi(dense, dense.phi + 0.01))
    text = run(f"in.sp.{deck}", tmp_path, code=2, data="packing.data", steps=3)
    assert "\nNOT CONVERGED: after 3 iterations fmax = " in text and "modulus" not in text and "aspect" not in text
    assert {path.name for path in tmp_path.glob("*.data")} == {"packing.data", "sp.unconverged.data"}
    entries = described((tmp_path / "sp.unconverged.data").read_text().splitlines())
    assert entries["converged"] is False and entries["max_force"] > 1e-12
    if deck == "minimize":
        assert "\nNOT A MINIMUM" in run("in.sp.contacts", tmp_path, data="sp.unconverged.data")


@pytest.mark.parametrize("pressure", [3e-2, 1e-4])
def test_sp_pressure_deck_meets_the_pressure(tmp_path, pressure):
    text = run("in.sp.pressure", tmp_path, n=32, seed=3, pressure=pressure)
    assert "\nNOT" not in text
    state = jamlab.evaluate(disks(tmp_path / "sp.pressure.data", units="k"))
    assert state.pressure == pytest.approx(pressure, rel=1e-6)
    assert state.max_force < 2e-12
    (tmp_path / "sp.pressure.data").unlink()
    text = run("in.sp.pressure", tmp_path, code=2, n=32, seed=3, pressure=pressure, tries=2)
    assert "\nNOT MET" in text and "\npressure =" not in text
    assert [path.name for path in tmp_path.glob("*.data")] == ["sp.not-met.data"]


def test_sp_stabilize_and_bulk_decks(tmp_path, dense):
    """Without residual shear stress at the same area; B of a square and of a tilted box as by linear response."""
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=1e-6)

    assert shear_stress(dense) > 0.03 * jamlab.evaluate(dense).pressure
    run("in.sp.stabilize", tmp_path, data="packing.data")
    stable = disks(tmp_path / "sp.stable.data", dense)
    assert shear_stress(stable) < 1.1e-6 * jamlab.evaluate(stable).pressure
    assert jamlab.evaluate(stable).max_force < 2e-13
    assert jamlab.evaluate(stable).energy < jamlab.evaluate(dense).energy
    assert stable.area == pytest.approx(dense.area, rel=1e-13)
    assert abs(stable.box[1, 0]) > 0.01
    assert jamlab.shear_modulus(stable, angle=np.linspace(0, np.pi, 20)).min() > 0
    text = run("in.sp.bulk", tmp_path, data="sp.stable.data")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(stable), rel=1e-6)


def test_sp_bulk_deck_goes_to_a_packing_fraction_first(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data", phi_target=0.9)
    (state,) = jamlab.compress(dense, 0.9, 1.0, by="phi")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(state), rel=1e-6)


def test_sp_stabilize_deck_says_when_the_shear_unjams(tmp_path):
    """A packing barely above onset that no box shear can keep jammed."""
    packing = jamlab.pack(32, 1e-3, 1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    assert "\nUNJAMMED" in run("in.sp.stabilize", tmp_path, code=2, data="packing.data")
    assert (tmp_path / "sp.unjammed.data").exists() and not (tmp_path / "sp.stable.data").exists()


def test_sp_bulk_deck_halves_the_strain_until_no_contact_changes(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data", strain=0.02)
    assert number("strain", text) < 0.02
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=0.01)
    text = run("in.sp.bulk", tmp_path, code=2, data="packing.data", strain=0.02, halvings=1)
    assert "\nCONTACTS CHANGE" in text and "modulus" not in text


def test_sp_contacts_deck(tmp_path, random_disks):
    """Three sizes in a tilted box, with disks that only rattle once others are taken out."""
    packing = random_disks(tilt=0.3, n=40, phi=0.75)
    network = jamlab.contacts(packing)
    few = np.bincount(network.pairs.ravel(), minlength=packing.n) < 3
    assert 0 < few.sum() < network.rattlers.sum() < packing.n
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.contacts", tmp_path, data="packing.data", nearby=3)
    assert number("N_c", text) == network.count
    assert number("backbone", text) == network.backbone
    assert number("rattlers", text) == network.rattlers.sum()
    assert number("isostatic", text) == network.isostatic
    assert number("z", text) == pytest.approx(network.z, abs=1e-14)

    psi = bond_order(packing)
    assert number("psi6 of a disk", text) == pytest.approx(np.abs(psi).mean(), abs=1e-12)
    assert number("of all", text) == pytest.approx(abs(psi.mean()), abs=1e-12)
    columns = np.loadtxt(tmp_path / "sp.contacts.dump", skiprows=9)[:, 5:8]
    degree = np.bincount(network.pairs[network.bearing].ravel(), minlength=packing.n)
    assert np.array_equal(columns[~network.rattlers, 0], degree[~network.rattlers])
    assert np.array_equal(columns[:, 1].astype(bool), network.rattlers)
    assert columns[:, 2] == pytest.approx(np.abs(psi), abs=1e-12)


def test_deck_and_analysis_call_the_same_disks_rattlers():
    """The rule is written twice, since analysis reads no deck: the two must not drift apart."""
    text = (installed("lammps_inputs") / "in.sp.contacts").read_text()
    least = re.search(r"^variable +least +index +(\d+)", text, re.MULTILINE)
    assert least is not None and int(least[1]) == LEAST_CONTACTS


@pytest.mark.parametrize("units", ["eps", "k"])
def test_sp_hessian_deck(tmp_path, random_disks, units):
    """Finite differences of LAMMPS forces against the analytic Hessian, prestress included."""
    packing = random_disks(units=units)
    jamlab.write_data(tmp_path / "packing.data", packing)
    n = packing.n
    assert f"Hessian: {9 * n * n} numbers in sp.hessian.txt" in run("in.sp.hessian", tmp_path, data="packing.data")
    found = np.loadtxt(tmp_path / "sp.hessian.txt").reshape(n, 3, n, 3)[:, :2, :, :2].reshape(2 * n, 2 * n)
    expected = jamlab.hessian(packing).toarray()
    assert found == pytest.approx(expected, abs=1e-6)
    assert np.linalg.eigvalsh(found) == pytest.approx(np.linalg.eigvalsh(expected), abs=1e-6)


def test_sp_data_keeps_every_digit_of_its_law(tmp_path, random_disks):
    packing = random_disks(units="k")
    jamlab.write_data(tmp_path / "packing.data", packing)
    run("in.sp.minimize", tmp_path, data="packing.data")
    given, kept = (
        described((tmp_path / name).read_text().splitlines()) for name in ("packing.data", "sp.minimum.data")
    )
    assert {name: kept[name] for name in given if name in kept or name.startswith("d")} | kept == kept
    assert all(kept[name] == given[name] for name in given if re.fullmatch(r"model|units|k|d\d+", name))


def test_sp_dump_has_radii(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    run("in.sp.compress", tmp_path, data="packing.data", to=0.94, nearest=0)
    assert 2 * np.array(frame(tmp_path / "sp.dump")["radius"]) == pytest.approx(dense.diameters, rel=1e-14)


@pytest.mark.parametrize("n", [40, 90], ids=["a type for each size", "diameters by disk"])
def test_decks_open_any_number_of_sizes(tmp_path, n):
    p = jamlab.pack(n=n, pressure=1e-2, seed=3, sizes="lognormal:0.4")
    jamlab.write_data(tmp_path / "p.data", p)
    energy = number("energy", run("in.sp.minimize", tmp_path, data="p.data", force=1e-12))
    written = jamlab.read(tmp_path / "sp.minimum.data")
    assert energy == pytest.approx(plain_sums(written).energy, rel=1e-12)
    assert np.array_equal(written.diameters, p.diameters) and (written.units, written.phi) == (p.units, p.phi)
    network = jamlab.contacts(p)
    text = run("in.sp.contacts", tmp_path, data="p.data")
    assert number("N_c", text) == network.count and number("rattlers", text) == network.rattlers.sum() > 0
    assert frame(tmp_path / "sp.contacts.dump")["radius"] == pytest.approx(p.diameters / 2, rel=1e-15)
    degree = np.bincount(network.pairs[network.bearing].ravel(), minlength=p.n)[~network.rattlers]
    assert np.array_equal(np.array(frame(tmp_path / "sp.contacts.dump")["v_degree"])[~network.rattlers], degree)


def test_decks_say_what_a_file_of_many_sizes_rules_out(tmp_path):
    jamlab.write_data(tmp_path / "p.data", random_disks(65, 1, phi=0.5, sizes="lognormal:0.3"))
    text = run("in.sp.minimize", tmp_path, code=1, data="p.data", ratio=1.4)
    assert "REFUSED: ratio = 1.4: each disk of p.data has its own diameter" in text


@pytest.mark.slow
@pytest.mark.parametrize("units", ["eps", "k"])
def test_decks_of_moduli_and_flow_and_ranks_know_disks_of_90_sizes(tmp_path, units):
    p = jamlab.pack(n=90, pressure=1e-2, seed=3, sizes="lognormal:0.4")
    if units == "eps":
        *_, p = jamlab.compress(jamlab.jam("sp", 90, 3, sizes="lognormal:0.4"), p.phi, 0.05, by="phi")
    jamlab.write_data(tmp_path / "p.data", p)
    text = run("in.sp.shear", tmp_path, data="p.data", phi_target=0, strain=1e-7)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(p), rel=0.01)
    text = run("in.sp.bulk", tmp_path, data="p.data", strain=1e-6)
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(p), rel=0.01)
    text = run("in.sp.startup", tmp_path, data="p.data", rate=1e-3, strain=0.01, accuracy=1e-3)
    last = text.partition("\nwork =")[0].splitlines()[-1].split()
    assert float(last[3]) == pytest.approx(jamlab.shear(p, 1e-3, 0.01, tolerance=1e-3).stress[-1], rel=1e-5)
    assert number("N_c", run("in.sp.contacts", tmp_path, ranks=3, data="p.data")) == jamlab.contacts(p).count
    energy = number("energy", run("in.sp.minimize", tmp_path, ranks=2, data="sp.startup.data", force=1e-3))
    assert energy == pytest.approx(plain_sums(jamlab.read(tmp_path / "sp.minimum.data")).energy, rel=1e-12)
