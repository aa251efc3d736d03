"""Arguments of flow and estimates by their one name: another word for one is refused with it."""

import inspect
import json
from dataclasses import fields

import numpy as np
import pytest

import jamlab
from jamlab.arguments.table import argument
from jamlab.errors import InputError
from jamlab.rheology.drag_law import make_law

P = None  # in place of a packing: names are looked at before values


@pytest.mark.parametrize(
    ("word", "name", "call"),
    [
        ("n_rows", "rows", lambda **how: jamlab.shear(P, 1.0, **how)),
        ("step", "strain_step", lambda **how: jamlab.quasistatic_shear(P, 0.1, **how)),
        ("tolerance", "force_tolerance", lambda **how: jamlab.quasistatic_shear(P, 0.1, **how)),
        ("alpha", "damping", lambda **how: jamlab.nonlinear_modulus(P, [1.0], **how)),
        ("strain", "amplitude", lambda **how: jamlab.nonlinear_modulus(P, [1.0], **how)),
        ("points", "points_per_cycle", lambda **how: jamlab.oscillate(P, 1.0, 1e-3, **how)),
        ("processes", "workers", lambda **how: jamlab.measure([P], **how)),
        ("processes", "workers", lambda **how: jamlab.flow_curve(P, [1.0], **how)),
        ("processes", "workers", lambda **how: jamlab.estimate("z", 0.9, 0.1, **how)),
        ("tolerance", "error", lambda **how: jamlab.choose(0.9, **how)),
        ("tolerance", "error", lambda **how: jamlab.scene(0.9, **how)),
        ("tolerance", "error", lambda **how: jamlab.choose_flow(P, **how)),
        ("tolerance", "error", lambda **how: jamlab.estimate_cost("z", 0.9, **how)),
        ("every", "snapshot_every", lambda **how: jamlab.quasistatic_shear(P, 0.1, **how)),
    ],
)
def test_another_word_is_refused_with_the_name(word, name, call):
    with pytest.raises(InputError, match=rf"has no argument '{word}': use `{name}`"):
        call(**{word: None})


@pytest.mark.parametrize("run", [[], ()])
def test_the_path_of_a_movie_stands_first(run):
    with pytest.raises(InputError, match=r"give the path first: write_movie\(path, run\)"):
        jamlab.write_movie(run, "a.gif")


@pytest.mark.parametrize(("word", "name"), [("rho-J", "rho_J"), ("a", "d_shape_factor")])
def test_another_word_for_a_quantity_of_an_estimate_is_refused_with_the_names(word, name):
    with pytest.raises(InputError, match=rf"'{word}'.*\b{name}\b"):
        jamlab.estimate_cost(word, None, 0.1)


RUNS = {
    "shear": lambda p: jamlab.shear(p, 1.0, 0.01, rows=2),
    "quasistatic_shear": lambda p: jamlab.quasistatic_shear(p, 2e-3),
    "oscillate": lambda p: jamlab.oscillate(p, 1.0, 1e-3, cycles=2, points_per_cycle=16),
    "creep": lambda p: jamlab.creep(p, 1e-4, 1.0),
    "relax_stress": lambda p: jamlab.relax_stress(p, 1e-4, 1.0),
    "flow_curve": lambda p: jamlab.flow_curve(p, [1.0], strain=1.0, discard=0.1),
}


@pytest.mark.parametrize("name", RUNS)
def test_columns_and_json_have_the_names_of_attributes(disks, name):
    run = RUNS[name](disks)
    table, content = run.to_dataframe(), json.loads(json.dumps(run.to_dict()))
    assert {*table} <= content.keys() and {each.name for each in fields(run)} - {"frames"} <= content.keys()
    for each, value in content.items():
        there = getattr(run, each)
        if each == "damping":
            assert value is there is None or make_law(value.pop("name"), value) == there
        elif np.iscomplexobj(there):
            assert np.array_equal(np.array(value) @ [1, 1j], there)
        else:
            assert repr(value) == repr(there.tolist() if isinstance(there, np.ndarray) else there), each  # nan is nan
    assert all(np.array_equal(table[column], content[column]) for column in table)


@pytest.mark.parametrize(
    ("kind", "word", "name"),
    [
        ("creep", "applied", "applied_stress"),
        ("creep", "residual", "residual_stress"),
        ("shear", "background", "background_drag"),
        ("oscillate", "points", "points_per_cycle"),
    ],
)
def test_another_word_for_an_attribute_is_refused_with_the_name(disks, kind, word, name):
    with pytest.raises(AttributeError, match=rf"'{word}'.*`{name}`"):
        getattr(RUNS[kind](disks), word)


FLOWS = ("shear", "flow_curve", "flow_cost", "oscillate", "creep", "relax_stress", "stop_flow", "quasistatic_shear")


@pytest.mark.parametrize("name", FLOWS)
def test_arguments_of_flows_stand_in_one_order_with_the_defaults_of_the_table(name):
    """The object, what drives it, the drag law; then how, the accuracy, and at the end path and progress."""
    parameters = inspect.signature(getattr(jamlab, name)).parameters
    places = {each: place for place, each in enumerate(parameters)}
    order = ["damping", "tolerance", "background_drag", "workers", "trajectory_error", "path", "progress"]
    shared = [each for each in order if each in places]
    assert [places[each] for each in shared] == sorted(places[each] for each in shared)
    assert ({"path", "progress"} <= {*shared} and [*parameters][-2:] == ["path", "progress"]) or name == "flow_cost"
    for each in ("tolerance", "background_drag", "workers", "trajectory_error", "progress"):
        if each in parameters:
            assert parameters[each].default == argument(each).default_at(name), each
