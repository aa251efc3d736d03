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
from jamlab.protocols import (
    border_newton,
    box_relaxation,
    box_shear,
    compression,
    newton,
    onset_search,
    preconditioned_lbfgs,
    relaxation,
)
from jamlab.protocols import target_pressure as pressure

MODULES = {  # settings, the modules that read them, and the packings they matter for
    "NEWTON": ((newton, relaxation), ("droplets", "stabilized", "large")),
    "LBFGS": ((preconditioned_lbfgs, relaxation), ("droplets",)),
    "SETTINGS": ((relaxation,), ("disks", "droplets", "large")),
    "BOX_SHEAR": ((box_shear,), ("sheared droplets",)),
    "BORDER": ((border_newton,), ("stabilized", "pressed")),
    "BOX_RELAXATION": ((box_relaxation,), ("stabilized", "pressed")),
    "ONSET": ((onset_search,), ("disks", "droplets")),
    "SWEEP": ((compression,), ("disks", "followed")),
    "PRESSURE": ((pressure,), ("large", "pressed")),
}
FACTORS = (0.5, 2.0)


def _states(kind):
    if kind == "disks":
        return [p for seed in (1, 2, 3) for p in _sweep(jamlab.jam(n=64, seed=seed), to=0.92, step=0.01)]
    if kind == "droplets":
        return [p for seed in (1, 2) for p in _sweep(jamlab.jam("dp", n=12, seed=seed), to=0.95, step=0.02)]
    if kind == "stabilized":
        onset = jamlab.jam(n=32, seed=1, ensemble="shear-stabilized")
        return _sweep(onset, to=0.92, step=0.02)
    if kind == "sheared droplets":
        return _sweep(jamlab.jam("dp", n=12, seed=1, ensemble="shear-stabilized"), to=0.9, step=0.02)
    if kind == "followed":
        return _sweep(jamlab.jam(n=32, seed=1, ensemble="shear-stabilized"), to=0.9, step=0.02, error=1e-3)
    if kind == "pressed":
        return [jamlab.pack(n=128, pressure=p, seed=s) for p in (1e-2, 1e-4) for s in (1, 2)]
    return [jamlab.pack(n=1200, pressure=1e-3, seed=1)]


def _sweep(onset, **how):
    return [onset, *jamlab.compress(onset, **how)]


class Work:
    """Counts of what costs time."""

    def __init__(self, monkeypatch):
        self.forces = self.factors = 0
        forces_at, minimize, factorise = Session.forces_at, Session.minimize, newton.factorise
        border_step = border_newton._step

        def count_forces(session, positions):
            self.forces += 1
            return forces_at(session, positions)

        def count_steps(session, *args, **how):
            before = session.steps()
            state = minimize(session, *args, **how)
            self.forces += session.steps() - before
            return state

        def count_factors(matrix, shift, solver):
            self.factors += 1
            return factorise(matrix, shift, solver)

        def count_border(*arguments):
            self.factors += 1
            return border_step(*arguments)

        monkeypatch.setattr(border_newton, "_step", count_border)
        monkeypatch.setattr(Session, "forces_at", count_forces)
        monkeypatch.setattr(Session, "minimize", count_steps)
        for module in (newton, relaxation):
            monkeypatch.setattr(module, "factorise", count_factors)


def _measure(kinds):
    """Force evaluations, factorisations, states at a minimum and where they should be, and runs that made none."""
    good = lost = 0
    with pytest.MonkeyPatch.context() as patch:
        work = Work(patch)
        for kind in kinds:
            try:
                good += sum(p.converged and p.on_target for p in _states(kind))
            except jamlab.ConvergenceError:
                lost += 1
        return work.forces, work.factors, good, lost


def _variants(settings):
    for field in fields(settings):
        value = getattr(settings, field.name)
        for factor in FACTORS:
            if isinstance(value, tuple):
                yield field.name, factor, replace(settings, **{field.name: tuple((factor * a, b) for a, b in value)})
            else:
                changed = factor * value if isinstance(value, float) else max(1, round(factor * value))
                yield field.name, factor, replace(settings, **{field.name: changed})


@pytest.mark.benchmark
@pytest.mark.parametrize("name", MODULES)
def test_settings_halved_and_doubled(name, monkeypatch):
    modules, kinds = MODULES[name]
    forces, factors, states, lost = _measure(kinds)
    rows = []
    for field, factor, settings in _variants(getattr(modules[0], name)):
        for module in modules:
            monkeypatch.setattr(module, name, settings)
        found = _measure(kinds)
        rows.append([field, factor, found[0] / forces, found[1] / max(factors, 1), found[2] - states, found[3]])
        print(
            "{}.{:22s} x {:<4g} forces {:5.2f}  factorisations {:5.2f}  states {:+d}  lost {}".format(name, *rows[-1])
        )
        if "JAMLAB_RESULTS" in os.environ:
            text = json.dumps({"default": [forces, factors, states], "rows": rows})
            (Path(os.environ["JAMLAB_RESULTS"]) / f"settings-{name.lower()}.json").write_text(text)
        monkeypatch.undo()
    assert lost == 0 and states == sum(len(_states(kind)) for kind in kinds)
