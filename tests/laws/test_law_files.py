"""A law of others in files and decks: what is written is read back, and decks go on from it."""

import numpy as np
import pytest
from campaigns import read_campaign_file, run_here, written
from deck_runs import run
from laws_of_others import Ramp

import jamlab
from jamlab.campaign.tasks import batches
from jamlab.engine.command_line import law_settings
from jamlab.engine.deck_defaults import settings
from jamlab.installed_files import installed
from jamlab.packing.kinds import MODELS

LAWS = {
    "wca": {"law": "wca_here"},
    "ramp": {"law": "ramp", "form": "cube", "weight": 0.7},
    "power": {"law": "power"},
}


def packed(name, n=16, **how):
    """Disks that overlap, at rest by springs."""
    p = jamlab.pack(n, phi=0.9, seed=1, **how)
    return jamlab.Packing("sp", p.box, p.positions, {"eps": 1.0, **LAWS[name]}, "eps", p.diameters)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("ending", ["h5", "data", "dump", "xyz"])
def test_files_keep_the_law(tmp_path, name, ending):
    p = packed(name)
    jamlab.write(tmp_path / f"p.{ending}", p if ending == "data" else [p])
    q = jamlab.read(tmp_path / f"p.{ending}")
    assert q == p and q.params == p.params and type(q.law) is type(p.law)


@pytest.mark.parametrize("name", LAWS)
def test_a_universe_keeps_the_law(name):
    p = packed(name)
    (q,) = jamlab.from_universe(jamlab.universe(p))
    assert q.params == p.params


def test_a_file_of_an_unknown_law_is_refused_by_name(tmp_path):
    for ending in ("data", "dump", "xyz"):
        file = tmp_path / f"p.{ending}"
        p = packed("wca")
        jamlab.write(file, p if ending == "data" else [p])
        file.write_bytes(file.read_bytes().replace(b"law=wca_here", b"law=wcb").replace(b"law_wca_here", b"law_wcb"))
        with pytest.raises(jamlab.JamlabError, match="unknown force law 'wcb'"):
            jamlab.read(file)


def test_a_number_of_a_choice_that_is_not_there_is_refused(tmp_path):
    file = tmp_path / "p.dump"
    jamlab.write(file, [packed("ramp")])
    lines = file.read_text().splitlines()
    place = lines[8].split().index("form") - 2
    rows = [" ".join([*row.split()[:place], "5", *row.split()[place + 1 :]]) for row in lines[9:]]
    file.write_text("\n".join([*lines[:9], *rows]) + "\n")
    with pytest.raises(jamlab.InputError, match="form is 5: 0 to 1 stand for square, cube"):
        jamlab.read(file)


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("wca", None),
        pytest.param("ramp", None, marks=pytest.mark.slow),
        pytest.param("wca", 66, marks=pytest.mark.slow),
    ],
)
def test_decks_minimise_it(tmp_path, name, sizes):
    """By `lmp -in in.sp.minimize -var ...`, to the same minimum as Python."""
    p = packed(name, sizes or 16, sizes=None if sizes is None else np.linspace(0.9, 1.1, sizes))
    jamlab.write(tmp_path / "packing.data", p)
    run("in.sp.minimize", tmp_path, data="packing.data", force_tolerance=1e-10)
    q = jamlab.read(tmp_path / "sp.minimum.data")
    assert q.params == p.params and jamlab.evaluate(q).max_force < 1e-9
    assert jamlab.evaluate(q).energy == pytest.approx(jamlab.evaluate(jamlab.relax(p)).energy, rel=1e-9)


@pytest.mark.parametrize("name", [pytest.param("wca", marks=pytest.mark.slow), "ramp"])
def test_frames_of_decks_say_the_law(tmp_path, name):
    p = packed(name)
    jamlab.write(tmp_path / "packing.data", p)
    steps = {"to": p.phi + 0.01, "first_step": 0, "step": 0.005}
    run("in.sp.compress", tmp_path, data="packing.data", **steps, force_tolerance=1e-10)
    frames = jamlab.read_all(tmp_path / "sp.dump")
    assert len(frames) == 3 and all(frame.params == p.params for frame in frames)
    assert jamlab.read(tmp_path / "sp.compressed.data").params == p.params
    own = [jamlab.evaluate(frame).max_force for frame in frames[1:]]
    assert max(own) < 1e-9


def test_a_deck_that_needs_a_power_law_refuses_others(tmp_path):
    given = law_settings(packed("wca")) | {"n": 16}
    given = {name: value for name, value in given.items() if not name.startswith(("d1", "d2", "column"))}
    run("in.sp.pressure", tmp_path, code=1, **given)
    assert "REFUSED: law law=wca_here" in (tmp_path / "sp.txt").read_text()


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_limits_of_decks_are_those_that_the_law_declares(model):
    """A deck says them nowhere itself."""
    from jamlab.cli.decks import _rules
    from jamlab.engine.deck_defaults import LIMITS

    path = installed("lammps_inputs") / f"in.{model}.jam"
    rules, written = _rules(path), settings(path.parent, path.name, what=LIMITS)
    for name, each in MODELS.get(model).parameters(None, {}).items():
        if each.choices or each.each:
            continue
        assert name not in written and rules[name][0] == "a number in [{:g}, {:g}]".format(*each.limits)
        assert rules[name][1](str(each.limits[1])) and not rules[name][1](str(1.01 * each.limits[1]))


def test_a_law_says_what_carries_it():
    assert Ramp("eps", 1.0).carriers == {"deck"}


def test_tables_of_campaigns_have_the_law_and_its_parameters(tmp_path):
    law = {"law": "ramp", "form": "square", "weight": 0.7}
    file = written(tmp_path / "c.toml", n=16, seeds=1, compress=None, phi=[0.9], law=law)
    run_here(campaign := jamlab.open_campaign(file))
    row = campaign.table("states").iloc[0]
    assert (row["law"], row["form"], row["weight"], row["units"]) == ("ramp", "square", 0.7, "eps")
    assert row["converged"] and np.isnan(row["exponent"]) and np.isnan(row["stickiness"])
    assert campaign.packings(campaign.finished()[0])[0].params == {
        "eps": 1.0,
        "law": "ramp",
        "weight": 0.7,
    }  # the rest is the default
    plain = written(tmp_path / "p.toml", n=16, seeds=1, compress=None, phi=[0.9], law={})
    assert {"force_law", "units", "law"}.isdisjoint(_parameters_of(plain))
    with pytest.raises(jamlab.InputError, match="unknown force law 'lj'"):
        jamlab.open_campaign(written(tmp_path / "d.toml", n=16, seeds=1, compress=None, phi=[0.9], law={"law": "lj"}))


def _parameters_of(file):
    """Names among the force law that enters the names of tasks."""
    (batch, *_) = batches(read_campaign_file(file))
    return batch.parameters.law
