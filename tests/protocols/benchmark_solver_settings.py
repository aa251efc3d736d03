"""What each number of the solvers costs: halved and doubled, time beside the default's and states that converge.

pytest -m benchmark -s tests/protocols/benchmark_solver_settings.py; about 20 minutes. JAMLAB_RESULTS names a folder for
the table. A ratio of time within 1.1 both ways and no state lost: the number lies on a plateau.
"""

import json
import os
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.protocols import box_shear, compression, newton, onset_search, preconditioned_lbfgs, relaxation
from jamlab.protocols import target_pressure as pressure

MODULES = {  # settings, the modules that read them, and the packings they matter for
    "NEWTON": ((newton, relaxation), ("droplets", "stabilized", "large")),
    "LBFGS": ((preconditioned_lbfgs, relaxation), ("droplets", "large")),
    "SETTINGS": ((relaxation,), ("disks", "droplets", "large")),
    "BOX_SHEAR": ((box_shear,), ("stabilized",)),
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
    if kind == "followed":
        return _sweep(jamlab.jam(n=32, seed=1, ensemble="shear-stabilized"), to=0.9, step=0.02, error=1e-3)
    if kind == "pressed":
        return [jamlab.pack(n=128, pressure=p, seed=s) for p in (1e-2, 1e-4) for s in (1, 2)]
    return [jamlab.pack(n=1200, pressure=1e-3, seed=1)]


def _sweep(onset, **how):
    return [onset, *jamlab.compress(onset, **how)]


def _measure(kinds):
    """CPU seconds, states that are at a minimum and where they should be, and states wanted but not made."""
    began, good, lost = time.process_time(), 0, 0
    for kind in kinds:
        try:
            good += sum(p.converged and p.on_target for p in _states(kind))
        except jamlab.ConvergenceError:
            lost += 1
    return time.process_time() - began, good, lost


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
    reference = _measure(kinds)
    times = [_measure(kinds)[0], reference[0]]
    rows = []
    for field, factor, settings in _variants(getattr(modules[0], name)):
        for module in modules:
            monkeypatch.setattr(module, name, settings)
        seconds, good, lost = _measure(kinds)
        rows.append([field, factor, seconds / float(np.mean(times)), good - reference[1], lost])
        print(f"{name}.{field:22s} x {factor:<4g} time {rows[-1][2]:5.2f}  states {rows[-1][3]:+d}  runs lost {lost}")
        if "JAMLAB_RESULTS" in os.environ:
            text = json.dumps({"default": {"seconds": times, "states": reference[1]}, "rows": rows})
            (Path(os.environ["JAMLAB_RESULTS"]) / f"settings-{name.lower()}.json").write_text(text)
        monkeypatch.undo()
    assert reference[1] == sum(len(_states(kind)) for kind in kinds)
