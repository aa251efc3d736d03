"""Mean square displacement and overlap: plain numpy, affine motion, wrapped particles, lags and origins."""

import numpy as np
import pandas as pd
import pytest

import jamlab

N, STATES = 20, 8


def series(model="sp", strain=0.05, walk=0.1, wrap=True, states=STATES, **provenance):
    """Particles that walk at random in a box that is sheared, wrapped and flipped; and their own motion."""
    side = 6.0
    box, x = side * np.eye(2), np.random.default_rng(1).random((N, 2)) * side
    steps = np.random.default_rng(2).normal(0, walk, (states - 1, N, 2))
    steps -= steps.mean(axis=1, keepdims=True)
    turn = 2 * np.pi * np.arange(5) / 5
    ring = 0.05 * np.column_stack([np.cos(turn), np.sin(turn)])
    found, own = [], [np.zeros((N, 2))]
    for k in range(states):
        seen, lattice = x.copy(), box.copy()
        if wrap:
            lattice[1] += (k % 3) * lattice[0]
            seen += np.random.default_rng(k).integers(-2, 3, (N, 2)) @ box
        known = {"flow_strain": k * strain, "flow_time": 0.0}
        if model == "sp":
            p = jamlab.Packing("sp", lattice, seen, {"k": 1.0}, "k", np.full(N, 0.1), provenance=known)
        else:
            law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 1e-3, "eta": 0.0, "contact": "outline"}
            rings = (seen[:, None] + ring).reshape(-1, 2)
            law |= {"a0": np.full(N, 0.006)}
            p = jamlab.Packing("dp", lattice, rings, law, offsets=5 * np.arange(N + 1), provenance=known)
        found.append(p)
        if k < states - 1:
            gradient = np.array([[1.0, strain], [0.0, 1.0]])
            x, box = x @ gradient.T + steps[k], box @ gradient.T
            own.append(own[-1] + steps[k])
    return found, np.array(own)


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_plain_numpy(model):
    states, own = series(model)
    found, share = jamlab.mean_square_displacement(states), jamlab.self_overlap(states, 0.2)
    assert found.lag.tolist() == [1, 2, 3, 4, 5, 6, 7] and found.origins.tolist() == [7, 6, 5, 4, 3, 2, 1]
    for k, lag in enumerate(found.lag):
        moved = np.array([own[a + lag] - own[a] for a in range(STATES - lag)])
        squares = (moved**2).sum(axis=2)
        assert found.total[k] == pytest.approx(squares.mean(), rel=1e-10)
        assert found.across[k] == pytest.approx((moved[..., 1] ** 2).mean(), rel=1e-10)
        assert found.non_gaussian[k] == pytest.approx((squares**2).mean() / (2 * squares.mean() ** 2) - 1, abs=1e-9)
        each = (np.sqrt(squares) <= 0.2).mean(axis=1)
        assert share.overlap[k] == pytest.approx(each.mean(), abs=1e-12)
        assert share.susceptibility[k] == pytest.approx(N * each.var(), abs=1e-12) or len(each) == 1
    assert found.strain == pytest.approx(0.05 * found.lag) and (found.time == 0).all()
    assert share.length == 0.2 and np.isnan(share.susceptibility[-1])
    slope = np.log(found.total[2] / found.total[0]) / np.log(3.0)
    assert found.exponent[[0, 1]] == pytest.approx([np.log2(found.total[1] / found.total[0]), slope], rel=0.3)


def test_affine_flow_does_not_move_particles():
    states, _ = series(walk=0.0, strain=0.4)
    assert jamlab.mean_square_displacement(states).total.max() < 1e-24
    assert jamlab.self_overlap(states).overlap.tolist() == [1.0] * 7
    assert np.isnan(jamlab.mean_square_displacement([states[0]] * 3).exponent).all()


def test_lags_are_even_in_their_logarithm_and_a_short_last_interval_is_left_out():
    states, _ = series(states=130, strain=1e-3, wrap=False)
    lags = jamlab.mean_square_displacement(states).lag
    assert lags[0] == 1 and lags[-1] == 129 and len(lags) < 25 and (np.diff(lags) > 0).all()
    early = states[7].with_state(provenance={"flow_strain": 6.4e-3})
    found = jamlab.mean_square_displacement([*states[:7], early])
    assert found.lag.tolist() == [1, 2, 3, 4, 5, 6] and found.origins.tolist() == [6, 5, 4, 3, 2, 1]
    uneven = [states[k] for k in (0, 1, 3, 7, 15)]
    found = jamlab.mean_square_displacement(uneven)
    assert found.origins.tolist() == [1] * 4 and found.strain == pytest.approx([0.001, 0.003, 0.007, 0.015])


def test_particles_and_walls():
    states, own = series()
    few = np.arange(N) < 3
    assert jamlab.mean_square_displacement(states, particles=few).total[-1] == pytest.approx(
        (own[-1, :3] ** 2).sum(axis=1).mean()
    )
    held = [p.with_state(fixed=few) for p in states]  # the motion of the whole is no longer taken off, nor is it there
    free = jamlab.mean_square_displacement(held)
    assert free.total[-1] == pytest.approx((own[-1, 3:] ** 2).sum(axis=1).mean())
    again = jamlab.mean_square_displacement(held, particles=[3, 4])
    assert again.total[-1] == pytest.approx((own[-1, 3:5] ** 2).sum(axis=1).mean())


def test_runs_in_time_and_quasi_static_ones():
    p = jamlab.pack(16, 1e-2, seed=1)
    run = jamlab.shear(p, rate=0.1, strain=0.04, rows=4, snapshot_every=0.01)
    found = jamlab.mean_square_displacement(run)
    assert found.time == pytest.approx(found.strain / 0.1, rel=1e-6) and len(found.lag) == 4
    assert found.plot().get_xlabel() == r"strain $\Delta\gamma$" and found.unit == "d"
    assert jamlab.self_overlap(run).plot().get_ylabel() == "self-overlap $Q$"


S, _ = series(states=3)
BAD = {
    "one state": (lambda: jamlab.mean_square_displacement(S[:1]), r"run has 1 packing\(s\): give 2 or more"),
    "other particles": (lambda: jamlab.mean_square_displacement([S[0], jamlab.jam(8)]), "state 1 of run has"),
    "other walls": (
        lambda: jamlab.self_overlap([S[0], S[1].with_state(fixed=np.arange(N) < 2, walls=True)]), "walls = True"
    ),
    "no such particle": (lambda: jamlab.mean_square_displacement(S, particles=[N]), "must be from 0 to 19"),
    "negative particle": (lambda: jamlab.self_overlap(S, particles=[-1]), "must be from 0 to 19"),
    "no particle": (lambda: jamlab.self_overlap(S, particles=np.zeros(N, dtype=bool)), "give 20 truth values"),
    "other mask": (lambda: jamlab.self_overlap(S, particles=np.ones(3, dtype=bool)), "give 20 truth values"),
    "twice": (lambda: jamlab.self_overlap(S, particles=[1, 2, 1]), "names one twice"),
    "length 0": (lambda: jamlab.self_overlap(S, 0.0), "length = 0"),
    "length nan": (lambda: jamlab.self_overlap(S, float("nan")), "length = nan"),
    "one packing": (lambda: jamlab.self_overlap(S[0]), "run = "),
    "number": (lambda: jamlab.mean_square_displacement(1.0), "run = 1.0"),
    "misspelt": (lambda: jamlab.self_overlap(S, lenght=1.0), "length"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named_with_a_remedy(case):
    call, words = BAD[case]
    with pytest.raises(jamlab.JamlabError, match=words) as refused:
        call()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("run", "words"),
    [(pd.DataFrame({"x": [1.0], "frame": [0]}), "use trackpy"), (iter([np.zeros(2)] * 2), "give a run")],
)
def test_what_is_no_packing_is_refused(run, words):
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.mean_square_displacement(run)
