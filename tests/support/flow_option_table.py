"""Combinations of options of LAMMPS with flows, and with disks under pair_style disk/drag: one row each;
`engine/test_option_matrix_of_flows.py` runs them. To add one, add a row to the list whose heading says what must hold.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class FlowRow:
    """`fix`: words of fix overdamped; `before`: lines before it, which matter; `options`: lines that must not matter.
    Each replaces the line of the deck with the same first word. `run`: how it runs; {again}: all that a restart
    file does not hold."""

    name: str
    model: str
    fix: str = ""
    before: str = ""
    options: str = ""
    ranks: int = 1
    newton: str = "on"
    run: str = "run 8"


DRIVES = {
    "rate": ("rate 0.1", ""),
    "oscillate": ("oscillate 0.05 1", ""),
    "stress": ("stress 0.01 background 0.1", ""),
    "fixed": ("rate 0.1 fixed held", ""),
    "walls": ("rate 0.1 walls held", ""),
    "stress on walls": ("stress 0.01 background 0.1 walls held", ""),
    "gravity": ("rate 0 background 0.1 fixed held", "fix weight all gravity 1e-3 vector 0 -1 0"),
    "addforce": ("rate 0.1 background 0.1", "fix a held addforce 1e-3 0 0\nfix b free addforce -1e-3 1e-3 0"),
    "fluid": ("rate 0.1 fluid 0.5", ""),
    "power law": ("rate 0.1 background 5", "alpha"),
}
NO_MATTER = {
    "thermo 1": "thermo 1",
    "tallies": "compute s all stress/atom NULL\ncompute e all pe/atom\ndump d all custom 1 d id c_s[1] c_e\nthermo 1",
    "map hash": "atom_modify map hash",
    "sort 0": "atom_modify map array sort 0 0",
    "nsq": "neighbor 0.1 nsq",
    "multi": "neighbor 0.1 multi",
    "lists of other times": "neigh_modify every 50 delay 50 check no",
    "skin 0.3": "neighbor 0.3 bin",
    "opt, omp": "package omp 1\nsuffix omp",
    **{f"units {one}": f"units {one}" for one in ("real", "metal", "si", "cgs", "electron", "micro", "nano")},
}
RESTART = "run 4\nwrite_restart kept\nclear\nread_restart kept\n{again}\nrun 4"
TILES = "processors * * 1\ncomm_style tiled\nbalance 1.0 rcb"


def of(model):
    """Rows of disks, or of droplets."""
    drag = " drag 1 1 1" if model == "dp" else ""
    rows = []
    for name, (fix, before) in DRIVES.items():
        drags = drag if "wall" not in name else ""
        if before == "alpha":
            drags, before = drags.replace("1 1 1", "1 0.5 0.8"), "" if drag else "pair_style disk/drag 1 0.5 alpha 0.8"
        words = fix + drags
        if "background" not in words:
            words += " background 1" if model == "dp" else " background 1e-2"
        for ranks, newton in ((2, "on"), (2, "off"), (1, "off")):
            rows.append(
                FlowRow(f"{model}, {name}, {ranks} ranks, newton {newton}", model, words, before, "", ranks, newton)
            )
    plain = f"rate 0.1{drag} background 1"
    for name, lines in NO_MATTER.items():
        rows.append(FlowRow(f"{model}, {name}", model, plain, "", lines))
    for ranks, newton in ((2, "on"), (2 if drag else 3, "off")):
        rows.append(FlowRow(f"{model}, tiled, {ranks} ranks, newton {newton}", model, plain, "", TILES, ranks, newton))
    rows += [
        FlowRow(f"{model}, units metal, stress", model, f"stress 0.01{drag} background 0.1", "", "units metal"),
        FlowRow(f"{model}, in three runs", model, plain, run="run 3\nrun 3\nrun 2 post no"),
        FlowRow(f"{model}, restart", model, plain, run=RESTART),
        FlowRow(f"{model}, restart, newton off, two ranks", model, plain, "", "", 2, "off", RESTART),
    ]
    return rows


# The numbers of the fix and the places are those of one rank with newton on and without the options.
FLOWS = [
    *of("sp"),
    *of("dp"),
    *(
        FlowRow(
            f"dp, self, {n} ranks, newton {newton}",
            "dp",
            "rate 0.1 drag 1 1 1 background 1",
            "pair_style circuloline 0.25 1.5 self 0.2\npair_coeff * * 1.0",
            "",
            n,
            newton,
        )
        for n, newton in ((2, "on"), (2, "off"))
    ),
]


@dataclass(frozen=True)
class DiskRow:
    """`lines` follow the deck; `head`: instead of lines with the same first word."""

    name: str
    lines: str
    ranks: int = 1
    head: str = ""
    words: str = ""


MOVE = "velocity all create 0.01 5 loop all\nfix move all nve\ntimestep 0.02\n"
GROUPS = "group a id 1 16\ngroup b subtract all a\n"
PAIRS = (
    f"{GROUPS}compute gg a group/group b\ncompute pl all pair/local dist eng force\n"
    "compute sum all reduce sum c_pl[1] c_pl[2] c_pl[3] inputs local\n"
    "thermo_style custom step pe press c_gg c_gg[1] c_sum[1] c_sum[2] c_sum[3]\n"
)
# pair_style disk/drag gives the energies, virials, forces and places of harmonic/cut.
DISKS = [
    *(
        DiskRow(f"nve, {n} ranks, newton {newton}", MOVE + "run 60", n, f"newton {newton}")
        for n in (1, 2, 3)
        for newton in ("on", "off")
    ),
    DiskRow("tiled", f"{MOVE}{TILES.partition(chr(10))[2]}\nrun 60", 3, "newton off\nprocessors * * 1"),
    DiskRow("pairs", f"{MOVE}{PAIRS}run 20"),
    DiskRow("pairs, ranks, newton off", f"{MOVE}{PAIRS}run 20", 2, "newton off"),
    DiskRow("exclude", f"{MOVE}{GROUPS}neigh_modify exclude group a b\nrun 40"),
    DiskRow("special_bonds", f"{MOVE}special_bonds lj/coul 0 0 0\nrun 20"),
    DiskRow("deform", f"{MOVE}fix d all deform 5 xy erate 1 remap x flip yes\nrun 63", 2),
    DiskRow("box/relax", "fix r all box/relax iso 0.05\nminimize 0 1e-8 100 1000", 2),
    DiskRow("nph", MOVE.replace("nve", "nph iso 0.05 0.05 1") + "run 40", 2),
    DiskRow("hftn", "min_style hftn\nminimize 0 1e-8 50 500"),
    DiskRow("fire", "min_style fire\nminimize 0 1e-8 100 1000", 2),
    DiskRow("numdiff", MOVE + "fix d all numdiff 5 1e-6\nthermo 5\nrun 20"),
    DiskRow(
        "tallies",
        MOVE + "compute s all stress/atom NULL\ncompute t all reduce sum c_s[1] c_s[4]\n"
        "thermo_style custom step pe press c_t[1] c_t[2]\nrun 20",
        2,
        "newton off",
    ),
    DiskRow("respa", MOVE + "run_style respa 2 2 pair 1\nrun 20"),
    DiskRow("suffix omp", MOVE + "run 40", words="-sf omp -pk omp 2"),
    DiskRow("units metal", "run 0", head="units metal"),
    DiskRow("data file", MOVE + "run 10\nwrite_data kept pair ij\nrun 10"),
    DiskRow("adapt", MOVE + "variable k equal 0.5+0.001*step\nfix ad all adapt 1 pair {style} k 1 1 v_k\nrun 20"),
]
