"""Arguments of flow and estimates by their one name: another word for one is refused with it."""

import pytest

import jamlab
from jamlab.errors import InputError

P = None  # in place of a packing: names are looked at before values


@pytest.mark.parametrize(
    ("word", "name", "call"),
    [
        ("n_rows", "rows", lambda **how: jamlab.shear(P, 1.0, **how)),
        ("step", "strain_step", lambda **how: jamlab.quasistatic_shear(P, 0.1, **how)),
        ("tolerance", "force_tolerance", lambda **how: jamlab.quasistatic_shear(P, 0.1, **how)),
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
