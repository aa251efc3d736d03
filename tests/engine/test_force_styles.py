"""Files of force-style tests, run step by step as LAMMPS' own testers do: fresh, after a run, from restart and data."""

import numpy as np
import pytest
import yaml
from force_styles import STEPS, write_all

NAMES = (
    *(f"mol-pair-circuloline-{form}" for form in ("outline", "segment", "segment_smooth", "mixed")),
    "atomic-pair-disk_drag",
    "bond-line_tension",
    "fix-timestep-polygon_area",
    "fix-timestep-overdamped",
    "fix-timestep-overdamped-stress",
    "fix-timestep-overdamped-droplets_stokes",
    "fix-timestep-overdamped-droplets_drag",
)
VARIABLES = ("newton_pair", "newton_bond", "input_dir", "data_file", "pair_style", "bond_style")


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    """What the files say, by name, with the folder that they lie in."""
    folder = tmp_path_factory.mktemp("force_styles")
    paths = write_all(folder)
    assert {path.stem for path in paths} == set(NAMES)
    return {path.stem: yaml.safe_load(path.read_text()) | {"folder": folder} for path in paths}


def lines(case, field, command=""):
    return [f"{command} {line}".strip() for line in (case.get(field) or "").splitlines() if line.strip()]


def start(lmp, case, newton, data=None):
    """The state of the file, or of a data file that LAMMPS wrote, which then has the coefficients."""
    given = {"newton_pair": newton, "newton_bond": newton, "input_dir": case["folder"]}
    styles = {name: case[name] for name in ("pair_style", "bond_style") if name in case}
    given |= {"data_file": data, **styles} if data else {}
    lmp.command("clear")
    for name in VARIABLES:
        lmp.command(f"variable {name} delete")
        if name in given:
            lmp.command(f"variable {name} index '{given[name]}'")
    for name in ("input_file", "input_coeffs"):
        if name in case:
            lmp.command(f"include {case['folder'] / case[name]}")
    if not data:
        for name, style in styles.items():
            lmp.command(f"{name} {style}")
            lmp.commands_list(lines(case, name.replace("style", "coeff"), name.replace("style", "coeff")))
    finish(lmp, case)


def finish(lmp, case):
    part = next((kind for kind in ("pair", "bond") if f"{kind}_style" in case), "fix")
    lmp.commands_list(lines(case, "post_commands"))
    lmp.commands_list([f"compute stress all pressure NULL {part}", "thermo_style custom step pe c_stress[1]"])
    lmp.command("thermo_modify norm no")


def by_tag(lmp, name):
    return np.array(lmp.gather_atoms(name, 1, 3)).reshape(-1, 3)


def differences(lmp, case, when):
    """What is off by more than the file allows, relative to each value as LAMMPS' testers take it."""
    found = {"forces": by_tag(lmp, "f"), "pos": by_tag(lmp, "x"), "vel": by_tag(lmp, "v")}
    energies = {"vdwl": "evdwl", "energy": "ebond"}
    found |= {name: lmp.get_thermo(key) for name, key in energies.items() if f"{when}_{name}" in case}
    if f"{when}_stress" in case:
        (left, low, _), (right, high, _), *_ = lmp.extract_box()
        found["stress"] = np.array(lmp.extract_compute("stress", 0, 1)[:6]) * (right - left) * (high - low)
    wrong = {}
    for name, value in found.items():
        text = case.get(f"{when}_{name}")
        if text is None:
            continue
        wanted = np.array(str(text).split(), dtype=float).reshape(*np.shape(value)[:1], -1)
        if name in ("forces", "pos", "vel"):
            wanted = wanted[:, 1:]
        off = np.abs(np.reshape(value, wanted.shape) - wanted)
        relative = (off / np.where(np.abs(wanted) > 1e-15, np.abs(wanted), 1.0)).max()
        if relative > float(case["epsilon"]):
            wrong[name] = relative
    for kind, name in ((0, "global_scalar"), (1, "global_vector")):
        if when == "run" and name in case:
            wanted = np.array(str(case[name]).split()[kind:], dtype=float)  # of a vector, its length comes first
            off = max(abs(lmp.extract_fix("test", 0, kind, k) / value - 1) for k, value in enumerate(wanted))
            wrong |= {name: off} if off > float(case["epsilon"]) else {}
    return wrong


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize("name", NAMES)
def test_styles_have_the_values_of_the_plain_loops(lmp, cases, name, newton):
    case = cases[name]
    whole = "pair_style" in case or "bond_style" in case
    start(lmp, case, newton)
    if whole:
        lmp.command("run 0 post no")
        assert not differences(lmp, case, "init"), "at the start"
        lmp.command("fix 1 all nve")
    else:
        lmp.commands_list(["run 0 post no", f"run {STEPS} post no", "write_restart half.restart"])
    lmp.command(f"run {STEPS} post no")
    assert not differences(lmp, case, "run"), "after a run"

    if whole:
        start(lmp, case, newton)
        lmp.commands_list(["run 0 post no", "write_restart half.restart"])
    lmp.commands_list(["clear", "read_restart half.restart"])
    finish(lmp, case)
    lmp.command(f"run {0 if whole else STEPS} post no")
    assert not differences(lmp, case, "init" if whole else "run"), "from a restart file"

    if whole:
        start(lmp, case, newton)
        lmp.commands_list(["run 0 post no", f"write_data half.data{' pair ij' if 'pair_style' in case else ''}"])
        start(lmp, case, newton, data="half.data")
        lmp.command("run 0 post no")
        assert not differences(lmp, case, "init"), "from a data file"
