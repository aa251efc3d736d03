"""What each number of the solvers costs: halved and doubled, work beside the default's and states that converge.

pytest -m benchmark -s tests/protocols/benchmark_solver_settings.py; about 20 minutes. JAMLAB_RESULTS names a folder for
the table. Work is counted, not timed: force evaluations by LAMMPS, and factorisations of a Hessian. Ratios within 1.1
ways and no state lost: the number lies on a plateau.
"""

import json
import os
from dataclasses import fields, replace
from pathlib import Path

import pytest

import jamlab
from jamlab.engine.session import Session
from jamlab.protocols import border_newton, newton

KINDS = {  # settings -> the packings they matter for
    "newton": ("droplets", "stabilized", "large"),
    "lbfgs": ("droplets",),
    "relaxation": ("disks", "droplets", "large"),
    "box_shear": ("sheared droplets",),
    "border": ("stabilized", "pressed"),
    "box_relaxation": ("stabilized", "pressed"),
    "onset": ("disks", "droplets"),
    "sweep": ("disks", "followed"),
    "pressure": ("large", "pressed"),
}
FACTORS = (0.5, 2.0)


def _states(kind, settings):
    how = {"settings": settings}
    if kind == "disks":
        return [p for seed in (1, 2, 3) for p in _sweep(jamlab.jam(n=64, seed=seed, **how), to=0.92, step=0.01, **how)]
    if kind == "droplets":
        onsets = [jamlab.jam("dp", n=12, seed=seed, **how) for seed in (1, 2)]
        return [p for onset in onsets for p in _sweep(onset, to=0.95, step=0.02, **how)]
    if kind in ("stabilized", "followed"):
        onset = jamlab.jam(n=32, seed=1, ensemble="shear-stabilized", **how)
        basin = {"to": 0.9, "error": 1e-3} if kind == "followed" else {"to": 0.92}
        return _sweep(onset, step=0.02, **basin, **how)
    if kind == "sheared droplets":
        onset = jamlab.jam("dp", n=12, seed=1, ensemble="shear-stabilized", **how)
        return _sweep(onset, to=0.9, step=0.02, **how)
    if kind == "pressed":
        return [jamlab.pack(n=128, pressure=p, seed=s, **how) for p in (1e-2, 1e-4) for s in (1, 2)]
    return [jamlab.pack(n=1200, pressure=1e-3, seed=1, **how)]


def _sweep(onset, **how):
    return [onset, *jamlab.compress(onset, **how)]


class Work:
    """Counts of what costs time: force evaluations, and factorisations of a Hessian."""

    def __init__(self, monkeypatch):
        self.forces = self.factors = 0
        self._count(monkeypatch, border_newton, "_step", lambda *_: (0, 1))
        self._count(monkeypatch, newton, "factorise", lambda *_: (0, 1))
        self._count(monkeypatch, Session, "forces_at", lambda *_: (1, 0))
        self._count(monkeypatch, Session, "minimize", lambda session, before, _: (session.steps() - before, 0))
        self._count(monkeypatch, Session, "descend", lambda _, __, found: (found.forces, found.factors))

    def _count(self, monkeypatch, place, name, cost):
        function = getattr(place, name)

        def call(first, *args, **how):
            before = first.steps() if isinstance(first, Session) else 0
            found = function(first, *args, **how)
            forces, factors = cost(first, before, found)
            self.forces, self.factors = self.forces + forces, self.factors + factors
            return found

        monkeypatch.setattr(place, name, call)


def _measure(kinds, settings):
    """Force evaluations, factorisations, states at a minimum and where they should be, and runs that made none."""
    good = lost = 0
    with pytest.MonkeyPatch.context() as patch:
        work = Work(patch)
        for kind in kinds:
            try:
                good += sum(p.converged and p.on_target for p in _states(kind, settings))
            except jamlab.ConvergenceError:
                lost += 1
        return work.forces, work.factors, good, lost


def _variants(name):
    """Every number of one solver halved and doubled: its name, the factor, and the settings of all solvers."""
    usual = jamlab.SolverSettings()
    numbers = getattr(usual, name)
    for field in fields(numbers):
        value = getattr(numbers, field.name)
        for factor in FACTORS:
            if isinstance(value, tuple):
                changed = tuple((factor * a, b) for a, b in value)
            else:
                changed = factor * value if isinstance(value, float) else max(1, round(factor * value))
            yield field.name, factor, replace(usual, **{name: replace(numbers, **{field.name: changed})})


@pytest.mark.benchmark
@pytest.mark.parametrize("name", KINDS)
def test_settings_halved_and_doubled(name):
    kinds, usual = KINDS[name], jamlab.SolverSettings()
    forces, factors, states, lost = _measure(kinds, usual)
    rows = []
    for field, factor, settings in _variants(name):
        found = _measure(kinds, settings)
        rows.append([field, factor, found[0] / forces, found[1] / max(factors, 1), found[2] - states, found[3]])
        print(
            "{}.{:22s} x {:<4g} forces {:5.2f}  factorisations {:5.2f}  states {:+d}  lost {}".format(name, *rows[-1])
        )
        if "JAMLAB_RESULTS" in os.environ:
            text = json.dumps({"default": [forces, factors, states], "rows": rows})
            (Path(os.environ["JAMLAB_RESULTS"]) / f"settings-{name}.json").write_text(text)
    assert lost == 0 and states == sum(len(_states(kind, usual)) for kind in kinds)
