"""Calls that users of other programs type from habit: how many work or are led on, and none astray.

    pytest -m benchmark -s tests/benchmark_habits.py

`habit_calls.py` says what each call means. A call that is refused leads on if the answer names that, or lists it among
the names that there are; it leads astray if the answer names something else to use.
"""

import collections
import pickle
import re

import numpy as np
import pandas as pd
import pytest
from campaigns import written
from habit_calls import CALLS, NAMES, SHELL
from typer.testing import CliRunner

import jamlab

pytestmark = pytest.mark.benchmark
KINDS = ("works", "led on", "listed", "no way on", "astray", "silent")
_HINT = re.compile(r"(: use |; use |did you mean |: give |; give )(.*)", re.DOTALL)
_LIST = re.compile(r"(it has|it takes|use one of|must be one of)(.*)", re.DOTALL)


def judged(text, meant):
    """What an answer to a call is worth. `meant`: pattern of what it should name; "-": nothing there is."""
    hint = _HINT.search(text)
    if hint and "use one of" not in text:
        if meant == "-":
            return "led on" if "limits" in text or "not in jamlab" in text else "astray"
        return "led on" if re.search(meant, hint[2]) else "astray"
    if meant == "-":
        return "led on" if "limits" in text or "not in jamlab" in text or "help(" in text else "no way on"
    if meant.startswith("has no") or "unit" in meant:
        return "led on" if re.search(meant, text) else "no way on"
    found = _LIST.search(text)
    if found and re.search(meant, found[2]):
        return "listed"
    return "led on" if re.search(meant, text) else "no way on"


@pytest.fixture(scope="module")
def space(tmp_path_factory):
    """Names that the calls use."""
    folder = tmp_path_factory.mktemp("habits")
    p = jamlab.pack(32, 1e-2, seed=1)
    jamlab.write(folder / "p.h5", p)
    labels = np.kron(np.arange(1, 17).reshape(4, 4), np.pad(np.ones((36, 36), int), 2)).astype(int)
    m = jamlab.micrograph(labels=labels)
    s = jamlab.complex_modulus(p, [1e-3, 1.0])
    run = jamlab.shear(p, rate=1e-2, strain=0.02, rows=5)
    fc = jamlab.flow_curve(p, [3e-2, 6e-2, 0.12, 0.24], strain=1.0)
    pressures = [1e-2, 3e-3, 1e-3]
    spectra = [
        [jamlab.complex_modulus(jamlab.pack(16, q, seed=1), np.logspace(-4, 0, 9), prestress=False)] for q in pressures
    ]
    campaign = jamlab.open_campaign(written(folder / "c.toml", n=8, seeds=1, compress=None, pressures=[1e-2]))
    campaign.run(1)
    found = {
        **{"jamlab": jamlab, "np": np, "pd": pd, "pickle": pickle, "p": p, "m": m, "s": s, "run": run, "fc": fc},
        **{"hb": fc.herschel_bulkley(), "c": jamlab.scaling_collapse(pressures, spectra, resamples=0)},
        **{"modes": jamlab.lowest_modes(p), "t": jamlab.elastic_tensor(p), "net": jamlab.contacts(p)},
        **{"campaign": campaign, "campaign_file": folder / "c.toml", "spectra_table": campaign.table("spectra")},
        **{"mask": labels, "mask_file": folder / "mask.npy", "strongest": strongest},
    }
    np.save(folder / "mask.npy", labels)
    with jamlab.Session(p) as session:
        yield found | {"session": session, "folder": folder}


def strongest(packing):
    return float(jamlab.contacts(packing).forces.size.max())


def answers(space, monkeypatch):
    """(who, call, what is meant, answer; None: it worked)."""
    monkeypatch.chdir(space["folder"])
    calls = [
        (who, f"{what}.{name.partition(':')[0]}", name.partition(":")[2])
        for (who, what), names in NAMES.items()
        for name in names.split()
    ]
    for who, call, meant in [*calls, *CALLS]:
        try:
            eval(call, dict(space))
            yield who, call, meant, None
        except Exception as error:
            yield who, call, meant, f"{type(error).__name__}: {error}"
    from jamlab.cli.main import app

    for words, meant in SHELL.items():
        found = CliRunner().invoke(app, words.split())
        yield "shell", words, meant, None if found.exit_code == 0 else " ".join(found.output.split())


def test_habits(space, monkeypatch):
    """At least four of five work or are led on, none is led astray."""
    counts = collections.defaultdict(collections.Counter)
    for who, call, meant, text in answers(space, monkeypatch):
        kind = "works" if text is None else judged(text, meant)
        counts[who][kind] += 1
        if kind in ("no way on", "astray"):
            print(f"{kind:10} {call:45} -> {meant:30} {text[:240]}")
    table = pd.DataFrame(counts, index=KINDS).fillna(0).astype(int)
    table["all"] = table.sum(axis=1)
    print(table)
    led = table.loc[["works", "led on", "listed"], "all"].sum() / table["all"].sum()
    print(f"works or led on: {led:.1%}")
    assert led >= 0.8 and not table.loc["astray", "all"] and not table.loc["silent", "all"]
