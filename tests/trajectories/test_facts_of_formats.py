"""Every fact of a packing through every format: kept, or named as lost; from the table that writers are made from."""

import pickle
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from commands import call
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kinds_of_packings import KINDS, lattice, law
from random_packings import packings
from wandering_packings import disks, polygons

import jamlab
from jamlab.packing.facts import FACTS, FORMATS, LOST, OF_DIGITS, REFUSED, STATE, facts_table, lost_names
from jamlab.packing.hdf5 import read_observables
from jamlab.trajectories.convert import convert

ENDINGS = {"packings": "h5", "data": "data", "dump": "dump", "xyz": "xyz"}


def through(kind, packing, folder):
    """The packing as a format gives it back, and what was said to be lost."""
    if kind == "universe":
        return jamlab.from_universe(jamlab.universe(packing))[0], ()
    path = Path(folder) / f"p.{ENDINGS[kind]}"
    said = jamlab.write(path, packing) or ()
    return jamlab.read(path), said


def same(kind, name, got, wanted):
    """Whether a format has kept a fact. Float32 of MDAnalysis rounds places, and what is at no minimum says so."""
    a, b = getattr(got, name), getattr(wanted, name)
    rounded = kind == "universe"
    if name in ("positions", "box"):
        # data files hold positions inside the box, dumps the bounds of the parallelogram
        near = got.rounding if rounded else 1e-15 * max(np.abs(wanted.positions).max(), np.abs(wanted.box).sum())
        return np.abs(a - b).max() <= near
    if name == "rounding" and rounded:
        return a >= max(b, 1e-7)
    if name in OF_DIGITS and rounded:
        return not a
    if name == "params":
        return a.keys() == b.keys() and all(np.array_equal(a[key], b[key]) for key in b)
    if name == "provenance":
        return {key: a.get(key) for key in b if key != "source" or not rounded} == {
            key: value for key, value in b.items() if key != "source" or not rounded
        }
    return np.array_equal(a, b) if isinstance(b, np.ndarray) else a == b and type(a) is type(b)


def check(kind, packing, folder):
    got, said = through(kind, packing, folder)
    cells = {fact.name: fact.places[list(FORMATS).index(kind)] for fact in FACTS if hasattr(packing, fact.name)}
    for name, place in cells.items():
        if place == LOST:
            assert (name in said) == bool(getattr(packing, name)) and name in got.provenance["lost"]
        else:
            assert place != REFUSED and name not in said and same(kind, name, got, packing), name
    return len(cells)


def test_every_field_is_in_the_table():
    named = [fact.name for fact in FACTS]
    assert set(named) > {each.name for each in fields(jamlab.Packing) if each.init}
    assert len(named) == len(set(named)) and all(len(fact.places) == len(FORMATS) for fact in FACTS)
    assert set(STATE) <= set(named) and lost_names("dump") == ("provenance",)


def test_the_table_of_the_page_has_every_fact_and_format():
    heading, rule, *rows = (line[2:-2].split(" | ") for line in facts_table().splitlines())
    assert heading[2:] == list(FORMATS.values()) and set(rule) == {"---"}
    assert [name.strip("`") for row in rows for name in row[0].split(", ")] == [fact.name for fact in FACTS]
    places = {name.strip("`"): tuple(row[2:]) for row in rows for name in row[0].split(", ")}
    assert all(places[fact.name] == fact.places for fact in FACTS)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("name", KINDS)
def test_every_fact_comes_back_or_is_said_to_be_lost(tmp_path, name, kind):
    check(kind, KINDS[name](), tmp_path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(packing=packings(), data=st.data())
def test_any_packing_with_anything_known(tmp_path, packing, data):
    state = {
        "phi_J": data.draw(st.none() | st.floats(0.1, 2.0)),
        "max_force": data.draw(st.none() | st.floats(0, 1)),
        "force_tolerance": data.draw(st.none() | st.floats(1e-15, 1)),
        "ensemble": data.draw(st.sampled_from(["fixed-box", "shear-stabilized"])),
        "provenance": {"seed": data.draw(st.integers(0, 9))},
    }
    state |= {name: data.draw(st.booleans()) for name in ("converged", "on_rattlers", "on_target")}
    mask = np.array(data.draw(st.lists(st.booleans(), min_size=packing.n, max_size=packing.n)))
    if not mask.all():
        state["fixed"] = mask
    number = data.draw(st.sampled_from([float, int, np.float32, np.int64]))
    strength = "k" if packing.units == "k" else "eps"
    state["params"] = {**packing.params, strength: number(2.5)}
    for kind in FORMATS:
        check(kind, packing.with_state(**state), tmp_path)


@pytest.mark.parametrize("kind", ["packings", "dump", "xyz", "universe"])
@pytest.mark.parametrize("make", [disks, polygons])
def test_every_frame_keeps_its_own_facts(tmp_path, kind, make):
    first = make(1, 1 / 3)
    states = [
        {"ensemble": "fixed-box", "phi_J": None, "on_target": False, "rounding": 0.0},
        {"ensemble": "shear-stabilized", "phi_J": 0.81, "on_target": True, "rounding": 1e-2},
        {"ensemble": "fixed-box", "phi_J": 0.82, "on_target": True, "rounding": 1e-3},
    ]
    frames = [first.with_state(**state) for state in states]
    if kind == "universe":
        u = jamlab.universe(frames)
        read = jamlab.from_universe(u)
        u.load_new(u.trajectory.coordinate_array[::2], order="fac", dimensions=u.trajectory.dimensions_array[::2])
        part = jamlab.from_universe(u)  # facts that differ are then unknown, which is said
        assert [p.rounding for p in part] == [1e-2, 1e-2]
        assert part[0].provenance["lost"] == ["ensemble", "on_target", "phi_J", "rounding"]
    else:
        jamlab.write(tmp_path / f"p.{ENDINGS[kind]}", frames)
        read = jamlab.read_all(tmp_path / f"p.{ENDINGS[kind]}")
    for got, state in zip(read, states, strict=True):
        assert got.rounding >= state.pop("rounding") and got.rounding < 2e-2
        assert {name: getattr(got, name) for name in state} == state


@pytest.mark.parametrize("kind", ["data", "dump", "xyz"])
def test_text_of_an_earlier_layout_is_refused(tmp_path, kind):
    path = tmp_path / f"p.{ENDINGS[kind]}"
    jamlab.write(path, disks(1, 0.0).with_state(phi_J=0.8, force_tolerance=1e-9))
    text = path.read_text()
    assert text.count("phi_J") == text.count("force_tolerance") == 1
    for word, earlier in (("phi_J", "onset"), ("force_tolerance", "tolerance")):
        path.write_text(text.replace(word, earlier))
        with pytest.raises(jamlab.errors.InputError, match=f"an earlier jamlab wrote it, with {earlier}"):
            jamlab.read(path)


def test_rounding_is_the_larger_of_source_and_format(tmp_path):
    coarse = disks(1, 0.0).with_state(rounding=1e-2)
    assert jamlab.from_universe(jamlab.universe(coarse))[0].rounding == 1e-2
    (fine,) = jamlab.from_universe(jamlab.universe(disks(1, 0.0)))
    for ending in ENDINGS.values():
        jamlab.write(tmp_path / f"p.{ending}", fine)
        assert jamlab.read(tmp_path / f"p.{ending}").rounding == fine.rounding > 0


def test_a_law_survives_all_formats_to_the_pressure(tmp_path):
    p = jamlab.pack(n=16, pressure=1e-2, seed=2, law={"exponent": 3})
    for ending in ENDINGS.values():
        jamlab.write(tmp_path / f"p.{ending}", p)
        q = jamlab.read(tmp_path / f"p.{ending}")
        assert jamlab.measure(q)["pressure"] == pytest.approx(0.01, rel=1e-8) and "assumed" not in q.provenance


def test_files_that_others_made_of_ours_with_fewer_digits_do_not_pass_as_exact(tmp_path):
    jamlab.write(tmp_path / "p.dump", lattice())
    assert jamlab.read(tmp_path / "p.dump") == lattice() and jamlab.contacts(jamlab.read(tmp_path / "p.dump")).z == 4
    text = (tmp_path / "p.dump").read_text().replace(" 2.5 ", " 2.50001 ")
    (tmp_path / "p.dump").write_text(text)
    assert jamlab.read(tmp_path / "p.dump").rounding > 1e-6
    (tmp_path / "p.csv").write_text("x,y,r\n0.123456789012,0.234567890123,0.5\n1.123456789012,0.234567890123,0.5\n")
    assert 1e-14 < jamlab.read(tmp_path / "p.csv", box=[2, 2]).rounding < 1e-11


def test_a_part_of_a_universe_has_the_facts_of_its_own_particles():
    packing = law(disks(3, 0.0), stickiness=0.1).with_state(phi_J=0.8, fixed=np.arange(12) < 3)
    u = jamlab.universe(packing)
    for order in (np.arange(8, 12), np.arange(12)[::-1], np.array([1, 5, 7]), np.array([5, 0, 11])):
        (got,) = jamlab.from_universe(u.atoms[order])
        kept = np.zeros(12, dtype=bool)
        kept[order] = True
        part = packing.select(kept)
        assert got.frame.fixed.tolist() == packing.frame.fixed[order].tolist()
        assert got.phi_J == part.phi_J and np.array_equal(got.diameters, packing.diameters[order])
        assert got.params["stickiness"] == pytest.approx(part.params["stickiness"], rel=1e-15)
    droplets = polygons(5, 0.0)
    droplets = droplets.with_state(fixed=np.arange(5) > 2)
    u = pickle.loads(pickle.dumps(jamlab.universe(droplets)))
    (got,) = jamlab.from_universe(sum(u.residues[k].atoms for k in (3, 0, 2)))
    assert got.fixed.tolist() == [True, False, False]
    assert np.array_equal(got.params["a0"], droplets.params["a0"][[3, 0, 2]])


def squares(edge=1.0, corner=(5.5, 1.0), side=6.0):
    ring = edge * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    params = {"gamma": 0.4, "ka": 300.0, "eps": 1.0, "delta": 0.1, "eta": 0.0, "contact": "outline"}
    places = np.vstack([ring + corner, ring + np.array([2.0, 0.5 * side])])
    params["a0"] = np.full(2, edge**2)
    return jamlab.Packing("dp", side * np.eye(2), places, params, offsets=[0, 4, 8])


def test_droplets_that_mdanalysis_wrapped_become_whole_again():
    for packing in (squares(), polygons(1, 1 / 3), polygons(4, -1.1)):
        u = jamlab.universe([packing, packing])
        wrapped = np.floor(packing.positions @ np.linalg.inv(packing.box))
        assert len(np.unique(wrapped, axis=0)) > 1
        for _ in u.trajectory:
            u.atoms.wrap()
        for got in jamlab.from_universe(u):
            np.testing.assert_allclose(got.polygons.edges, packing.polygons.edges, atol=1e-5)
            np.testing.assert_allclose(got.polygons.areas, packing.polygons.areas, atol=1e-5)


def test_wrapped_droplets_with_edges_longer_than_half_the_box_are_refused_by_name():
    whole = squares(3.2, (0.2, 0.2), 6.0).select(np.array([True, False]))
    assert jamlab.from_universe(jamlab.universe(whole))[0].polygons.areas == pytest.approx(3.2**2, rel=1e-5)
    u = jamlab.universe(whole.with_state(positions=whole.positions + np.array([4.0, 0.0])))
    u.atoms.wrap()
    with pytest.raises(jamlab.InputError, match="longer than half the box"):
        jamlab.from_universe(u)


def test_what_is_no_format_of_packings_is_not_written(tmp_path):
    """Whatever the source: a table is no HDF5 by another name."""
    p = jamlab.Packing("sp", 3 * np.eye(2), [[1.0, 1.0]], {"k": 1.0}, "k", [1.0])
    for source in ("p.h5", "p.xyz"):
        jamlab.write(tmp_path / source, p)
        for name in ("q.csv", "q.png", "q.gsd"):
            with pytest.raises(jamlab.InputError, match="name a file that ends in"):
                convert(tmp_path / source, tmp_path / name)
            assert not (tmp_path / name).exists()


def test_converting_keeps_observables_and_records_or_names_them(tmp_path):
    p = jamlab.pack(n=16, pressure=1e-2, seed=1)
    run = jamlab.shear(p, rate=1.0, strain=0.02, rows=3, path=tmp_path / "run.h5")
    assert convert(tmp_path / "run.h5", tmp_path / "copy.h5").lost == ()
    assert (jamlab.read_flow(tmp_path / "copy.h5").stress == run.stress).all()
    for target, lost in (
        ("a.dump", ("provenance", "observables flow_strain, flow_time", "record of a flow")),
        ("a.xyz", ("observables flow_strain, flow_time", "record of a flow")),
    ):
        assert convert(tmp_path / "run.h5", tmp_path / target).lost == lost
    assert convert(tmp_path / "run.h5", tmp_path / "last.h5", frame=-1).lost == ("record of a flow",)
    done = call(tmp_path, "convert", "run.h5", "b.dump")
    assert "does not hold: provenance, observables flow_strain, flow_time, record of a flow" in done.stdout
    every, last = (read_observables(tmp_path / name) for name in ("run.h5", "last.h5"))
    assert {name: values[-1:].tolist() for name, values in every.items()} == {n: v.tolist() for n, v in last.items()}


def test_a_sweep_that_ends_in_an_error_keeps_what_it_had(tmp_path):
    def sweep(stop):
        for k in range(3):
            yield disks(1, 0.0).with_state(provenance={"k": k})
        raise stop

    for stop in (ValueError("no minimum"), KeyboardInterrupt()):
        for ending in ("h5", "dump", "xyz"):
            path = tmp_path / f"{type(stop).__name__}.{ending}"
            with pytest.raises(type(stop)) as caught:
                jamlab.write(path, sweep(stop))
            assert len(jamlab.read_all(path)) == 3 and path.name in caught.value.__notes__[-1]
            path.write_text("of an earlier run")
            with pytest.raises(type(stop)):
                jamlab.write(path, sweep(stop))
            assert path.read_text() == "of an earlier run"  # and what is new lies beside it
            assert len(jamlab.read_all(path.with_suffix(f".part.{ending}"))) == 3


def test_no_work_is_done_for_a_file_that_cannot_be_written(tmp_path):
    def sweep():
        raise AssertionError
        yield

    for path, more in (("absent/p.h5", {}), ("p.csv", {}), ("p.dump", {"observables": {"g": [1.0]}})):
        with pytest.raises(jamlab.JamlabError):
            jamlab.write(tmp_path / path, sweep(), **more)
