"""Names that other packages add: registered in this process, or declared as entry points."""

import importlib.metadata
import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest

import jamlab
import jamlab.registry as registry
from jamlab.laws.parameter import STRENGTHS
from jamlab.packing.kinds import MODELS
from jamlab.packing.model import Model
from jamlab.protocols.makings import making_of
from jamlab.protocols.minimising import MAKINGS, Minimising
from jamlab.registry import Registry


class Thing:
    def __init__(self, name="spring"):
        self.name = name


def declared(monkeypatch, *points):
    """A registry that finds these entry points, (name, value)."""
    found = importlib.metadata.EntryPoints(
        importlib.metadata.EntryPoint(name, value, "jamlab.things") for name, value in points
    )
    monkeypatch.setattr(registry, "_installed", lambda: found)
    return Registry("jamlab.things", "thing")


def test_what_is_registered_is_found_again_and_no_other_takes_its_name():
    things, spring = Registry("jamlab.things", "thing"), Thing()
    assert things.register("spring", spring) is spring is things.get("spring")
    assert things.register("spring", spring) is spring and things.names() == ["spring"]
    with pytest.raises(jamlab.InputError, match="thing 'spring': the name is taken"):
        things.register("spring", Thing())
    with pytest.raises(jamlab.InputError, match="'coil' calls itself 'spring'"):
        things.register("coil", Thing())
    assert things.names() == ["spring"]


def test_entry_points_are_imported_when_asked_for_and_hold_their_names(monkeypatch):
    sys.modules.pop("colorsys", None)
    things = declared(monkeypatch, ("colour", "colorsys:rgb_to_hsv"))
    assert things.names() == ["colour"] and "colorsys" not in sys.modules
    assert things.get("colour").__name__ == "rgb_to_hsv"
    with pytest.raises(jamlab.InputError, match="taken"):
        things.register("colour", Thing("colour"))


def test_a_broken_package_is_named_and_does_not_hide_the_others(monkeypatch):
    things = declared(monkeypatch, ("broken", "no_such_module:THING"), ("colour", "colorsys:rgb_to_hsv"))
    with pytest.raises(jamlab.InputError, match=r"thing 'broken': no_such_module:THING .* No module named"):
        things.get("broken")
    assert things.get("colour")
    with pytest.raises(jamlab.InputError, match=r"unknown thing 'x': known are broken, colour.*jamlab\.things"):
        things.get("x")


def test_what_asks_all_leaves_a_broken_package_out_and_says_so_once(monkeypatch):
    things = declared(monkeypatch, ("broken", "no_such_module:THING"), ("colour", "colorsys:rgb_to_hsv"))
    with pytest.warns(jamlab.JamlabWarning, match="thing 'broken'.*No module named"):
        assert list(things.each()) == ["colour"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert list(things.each()) == ["colour"]
    with pytest.raises(jamlab.InputError, match="'broken'"):
        things.get("broken")


def test_a_broken_package_is_in_nobodys_way(tmp_path, monkeypatch):
    """Files without the word of a model, and hints, ask all models."""
    groups = ("jamlab.models", "jamlab.makings", "jamlab.laws", "jamlab.drags", "jamlab.observables")
    installed = [point for group in groups for point in registry._installed().select(group=group)]
    broken = importlib.metadata.EntryPoint("broken", "no_such_module:MODEL", "jamlab.models")
    monkeypatch.setattr(registry, "_installed", lambda: importlib.metadata.EntryPoints([*installed, broken]))
    monkeypatch.setattr(MODELS, "_broken", set())
    monkeypatch.delitem(vars(MODELS), "_points", raising=False)
    p = jamlab.pack(8, 1e-2)
    with pytest.warns(jamlab.JamlabWarning, match="model 'broken'"):
        jamlab.write(tmp_path / "p.dump", p)
    assert jamlab.read(tmp_path / "p.dump") == p and jamlab.jam(8, "sp").model == "sp"
    del vars(MODELS)["_points"]


def test_two_packages_with_one_name_are_refused(monkeypatch):
    things = declared(monkeypatch, ("colour", "colorsys:rgb_to_hsv"), ("colour", "colorsys:rgb_to_hls"))
    with pytest.raises(jamlab.InputError, match="'colour': both"):
        things.names()


def test_jamlabs_own_models_are_entry_points_like_any_other():
    assert MODELS.names()[:2] == ["sp", "dp"]
    assert all(isinstance(MODELS.get(name), Model) for name in ("sp", "dp"))
    with pytest.raises(jamlab.InputError, match="register one object"):
        MODELS.register("own", Model)


def test_disks_and_droplets_have_descents_of_their_own():
    """Not the one that a model without a making has: their packings would be others."""
    found = [making_of(name) for name in ("sp", "dp")]
    assert [type(each.descent).__name__ for each in found] == ["DescentOfDisks", "DescentOfDroplets"]
    assert [(each.version, each.stiffening_version, each.compression_version) for each in found] == [
        (2, 3, 4),
        (8, 2, 5),
    ]


def test_what_is_no_making_is_refused_by_name(monkeypatch):
    monkeypatch.setitem(MAKINGS._entries, "dp", Minimising())  # what alone minimises starts nothing
    with pytest.raises(jamlab.InputError, match=r"making of the model 'dp' .* derived from Making"):
        making_of("dp")


class Points(Model):
    """Sites that do nothing."""

    name = "points"
    particles = "points"

    def parameters(self, units, params):
        return {"eps": STRENGTHS["eps"]}

    def free_area(self, packing):
        return 0.1


@pytest.fixture
def points(monkeypatch):
    monkeypatch.setitem(MODELS._entries, "points", Points())
    return jamlab.Packing("points", 3 * np.eye(2), [[0.5, 0.5], [1.5, 1.0]], {"eps": 1.0}, diameters=[1.0, 1.0])


def test_what_a_model_leaves_out_is_refused_by_name(points):
    asked = {
        "State.law": lambda: points.law,
        "Contacts.terms": lambda: jamlab.hessian(points),
        "Contacts.pairs": lambda: jamlab.contacts(points),
        "Shape.power_points": lambda: jamlab.tessellation(points),
        "Shape.rings": points.plot,
        "Flow.jacobian": lambda: points.kind.jacobian(points, "contact", np.eye(2)),
        "Lammps.part": lambda: points.kind.part,
    }
    for method, ask in asked.items():
        with pytest.raises(jamlab.InputError, match=rf"model points does not say `{method}`.*class Points"):
            ask()


def test_a_packing_whose_model_is_not_installed_names_it(points, tmp_path, monkeypatch):
    file, pickled = tmp_path / "points.h5", pickle.dumps(points)
    jamlab.write(file, points)
    assert jamlab.read(file) == points == pickle.loads(pickled)
    monkeypatch.delitem(MODELS._entries, "points")
    for read in (lambda: jamlab.read(file), lambda: pickle.loads(pickled)):
        with pytest.raises(jamlab.JamlabError, match=r"unknown model 'points'.* install its package"):
            read()


def test_entry_points_cost_an_import_nothing():
    code = "import sys, jamlab; assert 'jamlab.registry' not in sys.modules and 'importlib.metadata' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(("typed", "name"), [("disks", "sp"), ("Droplets", "dp"), ("polygons", "dp"), ("SP", "sp")])
def test_a_word_for_a_model_is_answered_by_its_name(typed, name):
    for call in (lambda: jamlab.jam(8, typed), lambda: jamlab.scene(0.87, 16, error={"z": 1.0}, model=typed)):
        with pytest.raises(jamlab.InputError, match=f"unknown model {typed!r}: use {name!r}"):
            call()
