"""Files for LAMMPS' own testers of styles, unittest/force-styles: python plugin/recipes/lammps/force_styles.py FOLDER

A YAML file says what a tester sets up, and which numbers it finds. As after `-g` of the testers, these are numbers of
the styles themselves, on one rank. `commands` are what the testers do: the start, four steps, and the start again from
a restart file and from a data file; of a fix eight steps, with a restart file halfway.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[3]
sys.path += [str(ROOT), str(ROOT / "tests" / "support")]

import outlines  # noqa: E402  droplets, a wall and disks
from folded_outlines import NEAR, folded  # noqa: E402
from outlines import DISK, RING, WALL  # noqa: E402

import jamlab  # noqa: E402
from jamlab.engine.installation import start_lammps  # noqa: E402
from jamlab.protocols.random_start import random_disks  # noqa: E402

KA, A0, GAMMA, ETA, STEP, SPEED = 20.0, 1.1, 0.13, 0.05, 0.01, 0.02
KAPPA, THETA0, KP, KL, P0 = 0.02, 0.6, 0.3, 0.2, 3.7
ADHESION = {RING: (0.1, 0.3), WALL: (0.05, 0.2), DISK: (0.0, 0.0)}  # pull and range of each type
STRENGTH, DIAMETERS = {"1 1": 0.7, "1 2": 1.1, "2 2": 0.9}, (5 / 6, 7 / 6)
INPUT = """\
variable newton_pair index on
variable newton_bond index on
variable input_dir index .
variable data_file index ${{input_dir}}/data.{name}
variable pair_style index 'zero 1.5'
variable bond_style index zero
units lj
dimension 2
newton ${{newton_pair}} ${{newton_bond}}
atom_style {style}
atom_modify map array
neighbor 0.2 bin
neigh_modify delay 0 every 1 check yes
timestep {step}
pair_style ${{pair_style}}
{read}
"""
OUTLINES = """\
bond_style ${bond_style}
special_bonds lj/coul 1.0 1.0 1.0
read_data ${data_file} extra/special/per/atom 8"""
DISKS = """\
read_data ${data_file} nocoeff
change_box all triclinic"""
FLOW = "rate 0.05 tolerance 0.1 solver 1e-13 longest 1e-5 stop 5e-5"  # ends there, within eight steps
FLOWN = "f_flow[2] f_flow[4] f_flow[7] f_flow[8]"  # strain, shear stress, pressure, normal stress difference
NO_RESPA = ("overdamped", "polygon/bending", "polygon/perimeter")
ENERGY = {"pair": "evdwl", "bond": "ebond", "fix": "f_test"}
Case = Mapping[str, object]


def write_inputs(folder: Path, name: str) -> None:
    """What YAML files name: input, data, and coefficients for the tester of fixes, which has none folded."""
    if name != "disks":
        scene = folded() if name == "folded" else outlines.scene(3)
        text, style, read = outlines.data(scene).partition("\nd_a0\n")[0], "molecular", OUTLINES
        lines = ["pair_coeff * *", "bond_coeff *", f"group rings type {outlines.RING}"]
    else:
        jamlab.write(folder / "disks.data", random_disks(24, 11, phi=0.9, units="k"))
        text, style, read = (folder / "disks.data").read_text(), "atomic", DISKS
        (folder / "disks.data").unlink()
        lines = ["pair_style disk/drag 1.0 0.4", *(f"pair_coeff {line}" for line in disk_coefficients())]
    count = int(next(line for line in text.splitlines() if line.endswith(" atoms")).split()[0])
    moving = np.random.default_rng(5).normal(0.0, SPEED, (count, 2))
    rows = (f"{k} {x:.17g} {y:.17g} 0\n" for k, (x, y) in enumerate(moving, 1))
    (folder / f"data.{name}").write_text(f"{text.rstrip()}\n\nVelocities\n\n{''.join(rows)}")
    (folder / f"in.{name}").write_text(INPUT.format(name=name, style=style, step=STEP, read=read))
    if name != "folded":
        (folder / f"coeffs.{name}").write_text("\n".join([*lines, ""]))


def disk_coefficients() -> list[str]:
    """Strength of each pair of types, and the distance at which they touch."""
    touch = {types: sum(DIAMETERS[int(k) - 1] for k in types.split()) / 2 for types in STRENGTH}
    return [f"{types} {strength} {touch[types]!r}" for types, strength in STRENGTH.items()]


def cases() -> dict[str, dict[str, object]]:
    """By name of the file: what a tester sets up."""
    found: dict[str, dict[str, object]] = {}

    def add(name: str, kind: str, style: str, of: str, post: list[str], **more: object) -> None:
        atoms = "atom atomic" if of == "disks" else "atom molecular"
        found[name] = {
            "tags": "no_respa" if style in NO_RESPA else "",
            "epsilon": 1e-10 if style == "overdamped" else 2e-11,
            "skip_tests": more.pop("skip", ""),
            "prerequisites": f"{atoms}\n{kind} {style}\n",
            "pre_commands": "\n",
            "post_commands": "\n".join([*post, "\n"]),
            "input_file": f"in.{of}",
            **({"input_coeffs": f"coeffs.{of}", "timestep": STEP} if kind == "fix" else {}),
            **more,
        }

    own = [f"{k} {k} {outlines.EPS[k]} {outlines.WIDTH[k]}" for k in outlines.EPS]
    mixed = [*own, "1 2 1.3 0.28 segment/smooth", "1 3 2.1 0.7 outline"]
    adhesive = [
        f"{line} outline adhesion {pull} {reach}" for line, (pull, reach) in zip(own, ADHESION.values(), strict=True)
    ]
    for name, form, lines in (
        *((form.replace("/", "_"), form, own) for form in outlines.FORMS),
        ("mixed", "outline", mixed),
        ("adhesion", "outline", adhesive),
    ):
        style = f"circuloline {outlines.WIDTH[outlines.RING]} 1.2 contact {form} walls 2 disks 3"
        more = {
            "pair_style": style,
            "pair_coeff": "\n".join([*lines, ""]),
            "extract": "delta 2\neps 2\nadhesion 2\nrange 2\n",
        }
        add(f"mol-pair-circuloline-{name}", "pair", "circuloline", "outlines", ["bond_coeff *"], **more)
    style = f"circuloline {outlines.WIDTH[outlines.RING]} 1.2 contact segment/smooth self {NEAR}"
    more |= {"pair_style": style, "pair_coeff": f"* * {outlines.EPS[outlines.RING]}\n"}
    add("mol-pair-circuloline-self", "pair", "circuloline", "folded", ["bond_coeff *"], **more)
    lines, extract = "\n".join([*disk_coefficients(), ""]), "k 2\ncut 2\n"
    more = {"pair_style": "disk/drag 1.0 0.4", "pair_coeff": lines, "extract": extract, "skip": "single"}  # is in 3d
    add("atomic-pair-disk_drag", "pair", "disk/drag", "disks", [], **more)
    more = {"bond_style": "line/tension", "bond_coeff": f"1 {GAMMA} {ETA}\n", "equilibrium": "1 0", "skip": "single"}
    add("bond-line_tension", "bond", "line/tension", "outlines", ["pair_coeff * *"],
        extract="gamma 1\neta 1\n", **more)  # fmt: skip
    for style, values in (
        ("area", f"{KA} {A0}"),
        ("bending", f"{KAPPA} {THETA0}"),
        ("perimeter", f"{KP} {KL} {P0} {A0}"),
    ):
        post = ["fix move all nve", f"fix test rings polygon/{style} {values}", "fix_modify test virial yes"]
        add(f"fix-timestep-polygon_{style}", "fix", f"polygon/{style}", "outlines", post)
    post = [f"fix flow all overdamped {FLOW}", f"fix test all ave/time 1 1 1 {FLOWN}"]
    add("fix-timestep-overdamped", "fix", "overdamped", "disks", post)
    return found


def rows_of(case: Case, field: str, command: str = "") -> list[str]:
    return [f"{command} {line}".strip() for line in str(case.get(field) or "").splitlines() if line.strip()]


def kind_of(case: Case) -> str:
    return next((kind for kind in ("pair", "bond") if f"{kind}_style" in case), "fix")


def commands(case: Case, folder: Path, stem: str, newton: str) -> list[str]:
    """Commands of a tester, which leave the numbers of each stage in files STEM-STAGE and STEM-STAGE.dump."""
    kind = kind_of(case)
    flows = kind == "fix" and "ave/time" in str(case["post_commands"])
    stress = [f"c_stress[{k}]*lx*ly" for k in range(1, 7)]
    values = [f"f_test[{k}]" for k in range(1, 5)] if flows else [ENERGY[kind], *stress]

    def start(data: str = "") -> list[str]:
        given = {"newton_pair": newton, "newton_bond": newton, "input_dir": folder, "data_file": data}
        style = f"{kind}_style"
        given |= {style: case[style]} if data else {}
        lines = ["clear"]
        for name in ("newton_pair", "newton_bond", "input_dir", "data_file", "pair_style", "bond_style"):
            lines += [f"variable {name} delete"]
            lines += [f"variable {name} index '{given[name]}'"] if given.get(name) else []
        lines += [f"include {folder / str(case[name])}" for name in ("input_file", "input_coeffs") if name in case]
        lines += [f"{style} {case[style]}"] if style in case and not data else []
        return [*lines, *rows_of(case, f"{kind}_coeff", f"{kind}_coeff"), *finish()]

    def finish() -> list[str]:
        shown = f"thermo_style custom step evdwl ebond {'' if flows else 'c_stress[1]'}"
        return [*rows_of(case, "post_commands"), f"compute stress all pressure NULL {kind}", shown,
                "thermo_modify norm no"]  # fmt: skip

    def write(stage: str) -> list[str]:
        texts = " ".join(f"$({value}:%.17g)" for value in values)
        dump = f"write_dump all custom {stem}-{stage}.dump id x y vx vy fx fy modify sort id format float %.17g"
        return [dump, f'print "{texts}" file {stem}-{stage}']

    restart, data, still = f"{stem}.restart", f"{stem}.data", "run 0 post no"
    again = ["clear", f"read_restart {restart}", *finish()]
    if kind == "fix":
        half = "run 4 post no start 0 stop 8"
        return [*start(), still, half, f"write_restart {restart}", half, *write("run"), *again, half, *write("restart")]
    pair = " pair ij" if kind == "pair" else ""
    return [
        *[*start(), still, f"write_restart {restart}", f"write_data {data}{pair}", *write("init")],
        *["fix 1 all nve", "run 4 post no", *write("run"), *again, still, *write("restart")],
        *[*start(data), still, *write("data")],
    ]


def numbers(path: Path, case: Case) -> dict[str, np.ndarray]:
    """What a stage has left: fields of the YAML file by name, without init or run."""
    values, rows = np.loadtxt(path), np.loadtxt(f"{path}.dump", skiprows=9)
    kind, zeros = kind_of(case), np.zeros(len(rows))
    columns = {"pos": (1, 2), "vel": (3, 4)} if kind == "fix" else {"forces": (5, 6)}
    found = {name: np.column_stack([rows[:, 0], *rows[:, at].T, zeros]) for name, at in columns.items()}
    if len(values) == 4:
        return found | {"global_vector": values}
    energy = {"pair": "vdwl", "bond": "energy", "fix": "global_scalar"}[kind]
    return found | {energy: values[0], "stress": np.where(np.abs(values[1:]) < 1e-13, 0.0, values[1:])}


def field(name: str, value: object) -> str:
    """Of a YAML file: text of several lines, a number, a row of numbers, or vectors with the ID of their atom."""
    if isinstance(value, str) and value.endswith("\n"):
        lines = "".join(f"  {line}\n" for line in value.splitlines() if line)
        return f"{name}: ! |\n{lines}" if lines else f'{name}: ! ""\n'
    if np.ndim(value) == 1:
        count = f"{np.size(value)} " if name == "global_vector" else ""
        return f"{name}: ! |2-\n  {count}" + " ".join(f"{number:23.16e}" for number in np.asarray(value)) + "\n"
    if np.ndim(value) == 2:
        rows = (f"  {k:3.0f} " + " ".join(f"{x:23.16e}" for x in row) + "\n" for k, *row in np.asarray(value))
        return f"{name}: ! |2\n" + "".join(rows)
    return f"{name}: {value}".rstrip() + "\n"


def results(lmp: Any, name: str, case: Case) -> str:
    """Fields of what a tester finds."""
    lmp.commands_list(commands(case, Path.cwd(), name, "on"))
    stages = ("run",) if kind_of(case) == "fix" else ("init", "run")
    found = {stage: numbers(Path(f"{name}-{stage}"), case) for stage in stages}
    text = field("natoms", int(lmp.get_natoms()))
    for stage, values in found.items():
        for key, value in values.items():
            text += field(key if key.startswith("global") else f"{stage}_{key}", value)
            text += field(f"{stage}_coul", 0) if key == "vdwl" else ""
    return text


def write_all(folder: Path, styles: Iterable[str] | None = None) -> list[Path]:
    """The YAML files of styles, default all, beside what they read."""
    chosen = {n: c for n, c in cases().items() if styles is None or str(c["prerequisites"]).split()[-1] in styles}
    for name in {str(case["input_file"]).removeprefix("in.") for case in chosen.values()}:
        write_inputs(folder, name)
    lmp, before = start_lammps(), Path.cwd()
    released = datetime.strptime(str(lmp.version()), "%Y%m%d")
    head = f"---\nlammps_version: {released.day} {released:%b %Y}\ndate_generated: {datetime.now():%c}\n"
    with tempfile.TemporaryDirectory() as place:
        for path in folder.iterdir():
            shutil.copy(path, place)
        os.chdir(place)
        try:
            for name, case in chosen.items():
                text = head + "".join(field(*item) for item in case.items()) + results(lmp, name, case)
                (folder / f"{name}.yaml").write_text(f"{text}...\n")
        finally:
            os.chdir(before)
            lmp.close()
    return [folder / f"{name}.yaml" for name in chosen]


if __name__ == "__main__":
    for path in write_all(Path(sys.argv[1]).resolve()):
        print(path)
