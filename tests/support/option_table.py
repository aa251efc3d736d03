"""Combinations of options of LAMMPS with the styles of droplets: a row each; `engine/test_option_matrix.py` runs them.

To add one, add a row to the list whose heading says what must hold. A row has a name and the lines that follow HEAD and
AGAIN; `head`: lines that take the place of those of HEAD and AGAIN with the same first word (of `fix`, the first two),
or come first; `after`: lines after AGAIN; `ranks`; `law`: what plain numpy must know; `words` of the command line;
`scene`: where it starts; `said`: words of a refusal. In lines, {head} is the head again, after `clear`, {head:kept}
that of the data file "kept", {again} what restart files do not hold, {thermo} the lines of output.
"""

import math
from dataclasses import dataclass

from plain_forces import Law

HEAD = """\
units lj
newton on
processors * * 1
dimension 2
boundary p p p
atom_style molecular
atom_modify map array
fix d_a0 all property/atom d_a0
bond_style line/tension
pair_style circuloline 0.25 1.2 walls 2 disks 3
read_data data fix d_a0 NULL d_a0 extra/bond/per/atom 2 extra/special/per/atom 8
special_bonds lj/coul 1.0 1.0 1.0
bond_coeff * 0.13
pair_coeff 1 1 1.7 0.25
pair_coeff 2 2 0.9 0.3
pair_coeff 3 3 2.5 1.25
group rings type 1
"""
AGAIN = """\
neighbor 0.1 bin
neigh_modify every 1 delay 0 check yes
fix area rings polygon/area 20.0 d_a0
fix move all nve
timestep 0.01
compute virial all pressure NULL virial
thermo_style custom step pe evdwl ebond press
thermo_modify norm no
thermo 1000
"""
STEPS, STEP = 30, 0.01  # of the paths


PLAIN = Law()


@dataclass(frozen=True)
class Row:
    """See above."""

    name: str
    lines: str = ""
    head: str = ""
    ranks: int = 1
    law: Law = PLAIN
    words: str = ""
    scene: str = "all"
    said: str = ""
    after: str = ""


def on(ranks, name, lines="", head="", **more):
    """The same on several numbers of ranks."""
    return [Row(f"{name}, {n} ranks", lines, head, n, **more) for n in ranks]


TILES = "comm_style tiled\nbalance 1.0 rcb\nfix tiles all balance 5 1.0 rcb"
TIES = Law(bonds=((3, 9), (1, 20)))  # between droplets
TIE = "create_bonds single/bond 1 3 9\ncreate_bonds single/bond 1 1 20"
TWICE = Law(bonds=((1, 2),))
ASK = """
compute e all pe/atom
compute s all stress/atom NULL virial
compute touch all polygon/contact
compute shape rings polygon
fix asked all ave/time 1 1 1 c_shape[1] c_shape[2] mode vector
fix of_atoms all ave/atom 1 1 1 c_e c_s[1]
fix parts all ave/histo 1 1 1 -0.3 0 10 c_touch[5] kind local mode vector
"""
STYLE = "circuloline 0.25 1.2 walls 2 disks 3"
LAWS = ((1, 1.7, 0.25), (2, 0.9, 0.3), (3, 2.5, 1.25))  # type, eps, width


def coefficients(style="", scale=1.0):
    """Of all pairs of types: hybrid styles do not mix what two styles share."""
    return "".join(
        f"\npair_coeff {i} {j} {style} {scale * math.sqrt(one * two):.17g} {(first + second) / 2:.17g}"
        for i, one, first in LAWS
        for j, two, second in LAWS[i - 1 :]
    )


HYBRID = f"pair_style hybrid {STYLE}" + coefficients("circuloline")
TWO_HALVES = f"pair_style hybrid/overlay {STYLE} {STYLE}" + "".join(
    coefficients(f"circuloline {k}", 0.5) for k in (1, 2)
)
SCALED = f"pair_style hybrid/scaled 0.5 {STYLE} 0.0 soft 0.3{coefficients('circuloline', 2.0)}\npair_coeff * * soft 1"
WITH_SOFT = f"pair_style hybrid/overlay {STYLE} soft 0.3{coefficients('circuloline')}\npair_coeff * * soft 0.1"
SOFT = Law(soft=(0.1, 0.3))
SMOOTH = "pair_style circuloline 0.25 1.2 contact segment/smooth walls 2 disks 3"
GROUPS = "group a molecule <> 1 5\ngroup b molecule <> 6 10\n"
RESTART = "run 10\nwrite_restart {0}\nclear\nread_restart {0}\nfix d_a0 all property/atom d_a0\n{{again}}run 20"
OWN = "pair_style circuloline 0.25 1.2 self 0.1\npair_coeff * * 1.7"
FLAT = "pair_style circuloline 0.25 1.2 flat 2 disks 3"

# The path is that of velocity Verlet in plain numpy; energies, virial and forces at its end too. Without a run in the
# lines, one of STEPS follows them.
PATHS = [
    *on((1, 2, 4), "plain"),
    Row("three ranks along y", head="processors 1 3 1", ranks=3),
    Row("six ranks", head="processors 3 2 1", ranks=6),
    *on((1, 2, 4), "newton off", head="newton off"),
    *on((1, 2, 4), "newton on off", head="newton on off"),
    *on((1, 2, 4), "newton off on", head="newton off on"),
    *on((2, 3, 4), "tiled", TILES),
    *on((2, 3, 4), "tiled, newton off", TILES, "newton off"),
    Row("tiled, newton on off", TILES, "newton on off", 3),
    Row("tiled, newton off on", TILES, "newton off on", 3),
    Row("balance shift", "fix b all balance 5 1.0 shift xy 10 1.0", ranks=4),
    Row("map hash", head="atom_modify map hash", ranks=2),
    Row("map by default", head="atom_modify sort 10 0.3"),
    Row("sort 0", head="atom_modify map array sort 0 0"),
    Row("sort 3", head="atom_modify map array sort 3 0.3"),
    *(
        Row(f"special_bonds {weights}", head=f"special_bonds {weights}")
        for weights in ("lj/coul 0 0 0", "lj/coul 0 1 1", "lj/coul 1 0.5 1", "lj 0 0 0 coul 1 1 1", "fene", "charmm")
    ),
    Row("neighbor nsq", "neighbor 0.1 nsq"),
    Row("neighbor multi", "neighbor 0.1 multi"),
    Row("neighbor multi, modes", "neighbor 0.1 multi\ncomm_modify mode multi", ranks=2),
    Row("cutoff by type", "neighbor 0.1 multi\ncomm_modify mode multi cutoff/multi * 0.1", ranks=2),
    Row("collections", "neighbor 0.1 multi\nneigh_modify collection/type 2 1*2 3", ranks=2),
    Row("lists now and then", "neighbor 0.6 bin\nneigh_modify every 10 delay 10 check no"),
    Row("lists once", "neighbor 0.8 bin\nneigh_modify once yes"),
    Row("neigh one, page", "neigh_modify one 150 page 1500"),
    Row("binsize", "neigh_modify binsize 0.4"),
    Row("skin 0", "neighbor 0.0 bin\nneigh_modify check no", ranks=2),
    Row("cutoff 0.5", "comm_modify cutoff 0.5", ranks=2),
    Row("cutoff 3, velocities", "comm_modify cutoff 3 vel yes", ranks=2),
    Row("cutoffs that change", "comm_modify cutoff 3.4\nrun 15\ncomm_modify cutoff 0.0\nrun 15", ranks=4),
    Row("comm group", "comm_modify group all", ranks=2),
    Row("tilted box", "change_box all triclinic"),
    *on((2, 3), "tilted box, newton off", "change_box all triclinic", "newton off"),
    Row("respa", "run_style respa 2 1 bond 1 pair 2"),
    Row("respa, areas inside", "run_style respa 2 1 bond 1 pair 2\nfix_modify area respa 1"),
    Row("respa of three", "run_style respa 3 1 1 bond 1 pair 2 kspace 3", ranks=2),
    *on((1, 2), "suffix omp", words="-sf omp -pk omp 2"),
    Row("suffix opt", words="-sf opt"),
    Row("suffix in the deck", head="package omp 1\nsuffix omp"),
    *(Row(f"thermo {n}", f"thermo {n}") for n in (1, 7)),
    *on((2, 3), "thermo 1, newton off", "thermo 1", "newton off"),
    Row("energies alone", "thermo_style custom step pe\nthermo 1\nrun 30 post no\n{thermo}\nrun 0"),
    *(
        Row(f"thermo_modify {word}", f"thermo_modify {word}\nthermo 1")
        for word in ("line multi", "line yaml", "lost warn")
    ),
    Row("atom_style bond", head="atom_style bond", ranks=2),
    Row("in three runs", "run 10\nrun 10 pre no post no\nrun 10 post no"),
    Row("run every", 'run 30 every 10 "print x"', ranks=2),
    Row("run upto", "run 10\nrun 30 upto\nrun 30 upto"),
    Row("another clock", "run 10\nreset_timestep 1000000\nrun 20", ranks=2),
    *(
        Row(f"numdiff {n}, thermo {m}, {scene}", f"fix d all numdiff {n} 1e-6\nthermo {m}", scene=scene)
        for n, m in ((1, 1), (5, 1), (5, 5))
        for scene in ("all", "droplets")
    ),
    Row("numdiff/virial", "fix d all numdiff/virial 5 1e-6\nthermo 1"),
    Row("numdiff, two ranks", "fix d all numdiff 5 1e-6\nthermo 1", "newton off", 2),
    Row(
        "numdiff before areas", "unfix area\nfix d all numdiff 5 1e-6\nfix area rings polygon/area 20.0 d_a0\nthermo 1"
    ),
    *on((1, 3), "computes of every step", ASK),
    *on((2, 4), "computes of every step, newton off", ASK, "newton off"),
    Row(
        "dumps of every step",
        "compute c all polygon/contact\ndump d all custom 1 d id x fx\ndump l all local 1 l c_c[1]",
    ),
    *on((1, 2, 3), "nothing but droplets", scene="droplets"),
    *on((1, 2), "nothing but droplets, thermo 1, newton off", "thermo 1", "newton off", scene="droplets"),
    *on((1, 2), "bonds of all", "create_bonds single/bond 1 3 30", law=Law(bonds=((3, 30),))),
    *on((1, 2), "bonds between droplets", TIE, law=TIES, scene="droplets"),
    *on((1, 2), "bonds between droplets, thermo 1", TIE + "\nthermo 1", law=TIES, scene="droplets"),
    *on((1, 3), "bonds between droplets, newton off", TIE, "newton off", law=TIES, scene="droplets"),
    Row("bonds between droplets, numdiff", TIE + "\nfix d all numdiff 5 1e-6\nthermo 5", law=TIES, scene="droplets"),
    Row("a bond that stands twice", "create_bonds single/bond 1 1 2", law=TWICE, scene="droplets"),
    Row(
        "a bond that stands twice, newton off",
        "create_bonds single/bond 1 1 2\nthermo 1",
        "newton off",
        law=TWICE,
        scene="droplets",
    ),
    Row("bond hybrid", "bond_style hybrid line/tension\nbond_coeff 1 line/tension 0.13", ranks=2),
    Row("eta", "bond_coeff * 0.13 0.05", law=Law(eta=0.05), ranks=2),
    Row("pair hybrid", HYBRID, ranks=2),
    Row("two halves", TWO_HALVES, ranks=2),
    Row("two halves, newton off", TWO_HALVES, "newton off", 2),
    Row("hybrid/scaled", SCALED, ranks=2),
    Row("with pair soft", WITH_SOFT, law=SOFT),
    Row("with pair soft, ranks, newton off", WITH_SOFT, "newton off", 2, law=SOFT),
    Row("with pair soft/omp", WITH_SOFT, law=SOFT, words="-sf omp -pk omp 2"),
    *on((1, 2), "segment/smooth", head=SMOOTH, law=Law(form="segment/smooth")),
    *on((1, 3), "segment/smooth, newton off", head=SMOOTH + "\nnewton off", law=Law(form="segment/smooth")),
    Row(
        "one form a pair",
        "pair_coeff 1 2 2.0 0.28 segment/smooth",
        law=Law(pairs=((1, 2, 2.0, 0.28, "segment/smooth"),)),
    ),
    Row("a law for a pair", "pair_coeff 1 3 0.7 0.6", law=Law(pairs=((1, 3, 0.7, 0.6, "outline"),)), ranks=2),
    Row(
        "labels",
        "labelmap atom 1 drop 2 wall 3 disk\nlabelmap bond 1 edge\npair_coeff drop drop 1.7 0.25\nbond_coeff edge 0.13",
    ),
    Row(
        "roles by labels",
        f"labelmap atom 1 drop 2 wall 3 disk\npair_style {STYLE.replace('walls 2 disks 3', 'walls wall disks disk')}"
        + coefficients(),
    ),
    Row("exclude groups", GROUPS + "neigh_modify exclude group a b", law=Law(apart=(range(1, 6), range(6, 11)))),
    Row("exclude types", "neigh_modify exclude type 1 3", law=Law(pairs=((1, 3, 1.0, 0.0, "outline"),)), ranks=2),
    Row(
        "adapt to the same", "variable e equal 1.7\nfix ad all adapt 1 pair circuloline eps 1 1 v_e reset yes", ranks=2
    ),
    Row("adapt gamma", "variable g equal 0.13\nfix ad all adapt 1 bond line/tension gamma 1 v_g"),
    Row("gravity", "fix g all gravity 0.1 vector 0 -1 0", law=Law(push=(0.0, -0.1)), ranks=2),
    Row(
        "addforce before areas",
        "unfix area\nfix p all addforce 0.05 0 0\nfix area rings polygon/area 20.0 d_a0",
        law=Law(push=(0.05, 0.0)),
    ),
    Row("setforce after areas", "group w molecule 3\nfix z w setforce 0 0 0", law=Law(held=(3,)), ranks=2),
    Row(
        "two fixes of areas",
        "unfix area\ngroup a molecule <> 1 5\ngroup b subtract rings a\n"
        "fix area a polygon/area 20.0 d_a0\nfix area2 b polygon/area 20.0 d_a0",
        ranks=2,
    ),
    Row("areas by variables", "variable k equal 20.0\nunfix area\nfix area rings polygon/area v_k d_a0"),
    Row("rest areas by a variable", "variable a atom d_a0\nunfix area\nfix area rings polygon/area 20.0 v_a"),
    Row("restart", RESTART.format("kept"), ranks=2),
    Row("restart of many files", RESTART.format("kept.%"), ranks=3),
    Row("restart, newton off", RESTART.format("kept"), "newton off", 2),
    Row("restart, smooth", RESTART.format("kept"), SMOOTH, 2, law=Law(form="segment/smooth")),
    Row("data file", "run 10\nwrite_data kept\nclear\n{head:kept}{again}\nrun 20", ranks=2),
    Row("data file with laws", "run 10\nwrite_data kept pair ij\nclear\n{head:kept}{again}\nrun 20", "newton off", 3),
    Row("image flags anew", "run 10\nreset_atoms image all\nrun 20", ranks=2),
    Row("molecules anew", "run 10\nreset_atoms mol all compress yes single yes\nrun 20", ranks=2),
    Row("internal fix taken away", "run 10\nunfix POLYGON_OUTLINE\nrun 20", ranks=2),
    Row("areas taken away and back", "run 10\nunfix area\nfix area rings polygon/area 20.0 d_a0\nrun 20", ranks=2),
    Row("pair taken away and back", f"run 10\npair_style none\npair_style {STYLE}{coefficients()}\nrun 20", ranks=2),
    Row(
        "bonds taken away and back",
        "run 10\nbond_style none\nbond_style line/tension\nbond_coeff * 0.13\nrun 20",
        ranks=2,
    ),
    Row("plugin twice", "variable p getenv LAMMPS_PLUGIN_PATH\nplugin load ${p}/jamlabplugin.so\nplugin list"),
    Row("clear and again", "run 3\nclear\n{head}{again}\nrun 30", ranks=2),
    Row("jamlab/forces between", "run 10\njamlab/forces\nrun 20", ranks=2),
    *on((1, 2, 3), "self", head=OWN, scene="folded", law=Law(near=0.1)),
    *on((1, 2, 4), "self, newton off", head=OWN + "\nnewton off", scene="folded", law=Law(near=0.1)),
    Row(
        "self, smooth",
        head=OWN.replace("self", "contact segment/smooth self"),
        scene="folded",
        ranks=2,
        law=Law(near=0.1, form="segment/smooth"),
    ),
    Row("self, thermo 1", "thermo 1", OWN, scene="folded", law=Law(near=0.1)),
    Row("self, numdiff", "fix d all numdiff 5 1e-6\nthermo 5", OWN, scene="folded", law=Law(near=0.1)),
    Row("self, tiled, newton off", TILES, OWN + "\nnewton off", 3, scene="folded", law=Law(near=0.1)),
    Row("self, restart", RESTART.format("kept"), OWN, 2, scene="folded", law=Law(near=0.1)),
    *on((1, 2, 4), "flat walls", head=FLAT, scene="flat"),
    *on((1, 2, 3), "flat walls, newton off", head=FLAT + "\nnewton off", scene="flat"),
    Row("flat walls, tiled", TILES, FLAT, 3, scene="flat"),
    Row(
        "flat walls, smooth",
        head=FLAT.replace("flat", "contact segment/smooth flat"),
        scene="flat",
        law=Law(form="segment/smooth"),
        ranks=2,
    ),
]

NEARER = "pair_style circuloline 0.25 2.5 walls 2 disks 3"  # longer edges
# Energies, virial and forces are those of plain numpy where the lines end.
STATES = [
    *on((1, 2), "box/relax iso", "unfix move\nfix r all box/relax iso 1.0 vmax 0.001\nminimize 0 1e-6 100 500"),
    Row("box/relax aniso", "unfix move\nfix r all box/relax aniso 1.0 vmax 0.001\nminimize 0 1e-6 100 500"),
    Row(
        "box/relax tri",
        "unfix move\nchange_box all triclinic\nfix r all box/relax x 1.0 y 1.0 xy 0 vmax 0.001\n"
        "minimize 0 1e-6 100 500",
        ranks=2,
    ),
    *(
        Row(
            f"deform {words}",
            f"change_box all triclinic\nfix d all deform 10 {words}\nrun 105\nunfix d\nrun 0",
            NEARER,
            2,
        )
        for words in (
            "xy erate 0.5 remap x",
            "xy erate 0.05 remap v",
            "xy erate 2 remap x flip yes",
            "x trate -0.05 y trate -0.05 remap x",
            "x wiggle 0.1 1.0 remap x",
            "x erate 0.1 y volume remap x",
            "x final 0.1 5.4 remap none",
            "xy vel 2 remap x flip no",
        )
    ),
    Row(
        "deform, a flip with remap v",
        "change_box all triclinic\nchange_box all xy delta 2.5 remap\n"
        "fix d all deform 10 xy erate 0.05 remap v flip yes\nrun 105\nunfix d\nrun 0",
        NEARER,
        2,
    ),
    Row(
        "nvt/sllod",
        "unfix move\nchange_box all triclinic\nfix 1 all nvt/sllod temp 0.05 0.05 1\n"
        "fix d all deform 1 xy erate 0.5 remap v\nrun 60\nunfix d\nunfix 1\nrun 0",
        ranks=2,
    ),
    *(
        Row(
            f"nph {words}",
            f"unfix move\nchange_box all triclinic\nfix 1 all nph {words}\nrun 60\nunfix 1\nrun 0",
            ranks=2,
        )
        for words in (
            "iso 1.0 1.0 1.0",
            "aniso 1.0 1.0 1.0",
            "x 1 1 1 y 1 1 1 xy 0 0 1",
            "x 1 1 1 y 1 1 1 xy 1 1 1 flip yes",
        )
    ),
    Row("npt", "unfix move\nfix 1 all npt temp 0.05 0.05 1 iso 1.0 1.0 1.0\nrun 60\nunfix 1\nrun 0"),
    Row("press/berendsen", "fix p all press/berendsen iso 1.0 1.5 1.0\nrun 60\nunfix p\nrun 0"),
    Row("press/langevin", "fix p all press/langevin iso 1.0 1.5 1.0 temp 0.05 0.05 88\nrun 60\nunfix p\nrun 0"),
    Row("langevin", "fix l all langevin 0.05 0.05 1 4711\nfix e all enforce2d\nrun 60\nunfix l\nrun 0", ranks=2),
    *(
        Row(f"change_box {words}", f"run 10\n{before}change_box all {words}\nrun 0", NEARER, ranks=2)
        for before, words in (
            ("", "x scale 0.98 y scale 1.01 remap"),
            ("", "set x scale 0.99 remap"),
            ("", "x scale 1.2"),
            ("change_box all triclinic\n", "xy delta 1.5 remap"),
            ("change_box all triclinic\n", "ortho"),
            ("change_box all triclinic\nbox tilt large\n", "xy delta 2.5 remap"),
            ("change_box all triclinic\nchange_box all xy delta 2.5 remap\n", "xy delta 2.0 remap"),
        )
    ),
    Row("closed box", "run 0", "boundary f f p", scene="closed", law=Law(closed=True), ranks=2),
    Row("closed box later", "change_box all boundary f f p\nrun 0", scene="closed", law=Law(closed=True)),
    Row(
        "walls of LAMMPS",
        "fix w all wall/reflect xlo EDGE xhi EDGE ylo EDGE yhi EDGE\nrun 30",
        "boundary f f p",
        scene="closed",
        law=Law(closed=True),
    ),
    Row("rotated", "run 10\ngroup g molecule 3\ndisplace_atoms g rotate 2 0.5 0 0 0 1 10\nrun 0", ranks=2),
    Row("moved far", "run 10\ndisplace_atoms all move 10.3 -7.7 0\nrun 20", ranks=2),
    Row("one moved across", "run 10\ngroup g molecule 3\ndisplace_atoms g move 5.2 5.5 0\nrun 0", ranks=2),
    Row("ramp", "displace_atoms all ramp x 0 0.05 y 0 5\nrun 0", ranks=2),
    Row("random", "displace_atoms all random 0.02 0.02 0 5\nrun 0", ranks=2),
    *(
        Row(
            f"delete_atoms {words}", f"run 10\ngroup g molecule 3\ngroup h id 30\ndelete_atoms {words}\nrun 10", ranks=2
        )
        for words in ("group g", "group g compress no", "group g bond yes", "group h mol yes")
    ),
    Row(
        "replicate",
        "unfix area\nunfix d_a0\nunfix POLYGON_OUTLINE\nreplicate 2 1 1\n"
        "fix d_a0 all property/atom d_a0\nset group all d_a0 1.1\n"
        "fix area rings polygon/area 20.0 1.1\nrun 0",
        scene="droplets",
        ranks=2,
    ),
    Row(
        "read_dump",
        "dump q all custom 10 kept id mol type x y z ix iy iz vx vy vz\n"
        "dump_modify q sort id format float %.17g\nrun 20\nundump q\nread_dump kept 10 x y ix iy vx vy box yes\nrun 10",
        ranks=2,
    ),
    Row(
        "rerun",
        "dump q all custom 10 kept id mol type x y z ix iy iz\ndump_modify q sort id format float %.17g\n"
        "run 20\nundump q\nunfix move\nrerun kept dump x y ix iy box yes",
        ranks=2,
    ),
    Row(
        "rerun of unwrapped places",
        "dump q all custom 10 kept id mol type xu yu\n"
        "dump_modify q sort id format float %.17g\nrun 20\nundump q\nunfix move\n"
        "rerun kept dump x y wrapped no box yes",
        ranks=2,
    ),
    Row(
        "adapt ramps",
        "variable e equal 1.7-0.01*step\nvariable d equal 0.25-0.001*step\n"
        "variable g equal 0.13+0.01*step\n"
        "fix ad all adapt 1 pair circuloline eps 1 1 v_e pair circuloline delta 1 1 v_d &\n"
        "bond line/tension gamma 1 v_g\nrun 20",
        law=Law(eps=(1.5, 0.9, 2.5), width=(0.23, 0.3, 1.25), gamma=0.33),
        ranks=2,
    ),
    Row(
        "rigid",
        "unfix move\ngroup w molecule 3\ngroup m subtract all w\nfix r w rigid molecule\nfix 1 m nve\nrun 20\n"
        "unfix r\nrun 0",
        ranks=2,
    ),
    Row(
        "fix move",
        "unfix move\ngroup w molecule 3\ngroup m subtract all w\nfix r w move linear 0.1 0 0\nfix 1 m nve\nrun 20",
        ranks=2,
    ),
    Row("rest areas between runs", "run 10\nset group rings d_a0 1.1\nrun 1 pre no", ranks=1),
    Row("rest areas between runs, ranks", "run 10\nset group rings d_a0 1.1\nrun 1 pre no", "newton off", 3),
    Row("dynamical_matrix", "run 0\ndynamical_matrix all regular 1e-6 file matrix\nrun 0", scene="droplets"),
    Row(
        "mean values",
        ASK + "compute ch all chunk/atom molecule\nfix k all ave/chunk 1 5 5 ch vx density/number\n"
        "compute g all gyration/chunk ch\nvariable one equal c_shape[1][1]\nfix v all vector 5 v_one\nrun 20",
        ranks=2,
    ),
    *(
        Row(
            f"min {style} {words}",
            f"unfix move\nmin_style {style}\n{words and 'min_modify '}{words}\ntimestep 0.02\nminimize 0 1e-4 60 600",
            NEARER,
        )
        for style, words in (
            ("fire", ""),
            ("fire", "abcfire yes"),
            ("fire", "integrator leapfrog"),
            ("fire", "integrator verlet vdfmax 3"),
            ("quickmin", ""),
            ("cg", ""),
            ("cg", "line quadratic"),
            ("cg", "line backtrack"),
            ("cg", "line forcezero"),
            ("cg", "norm inf"),
            ("sd", ""),
        )
    ),
    *on((2, 3), "min fire", "unfix move\nmin_style fire\nminimize 0 1e-4 60 600"),
    *(
        Row(f"units {units}", "run 0", f"units {units}\nneighbor 0.1 bin\ntimestep 1e-9")
        for units in ("real", "metal", "si", "cgs", "electron", "micro", "nano")
    ),
    Row("wide droplets", "run 0", scene="wide"),
    *on((2, 3), "wide droplets, newton off", "run 0", "newton off", scene="wide"),
    Row("wide droplets, smooth", "run 0", SMOOTH, scene="wide", law=Law(form="segment/smooth"), ranks=2),
]

# What the words `said` of the plugin refuse.
REFUSALS = [
    Row("a bond less", "run 1\ngroup g id 3\ndelete_bonds g bond 1 any\nrun 1", said="molecule"),
    Row("a vertex less", "run 1\ngroup g id 3\ndelete_atoms group g bond yes\nrun 1", said="closed ring"),
    Row(
        "a vertex less, ranks", "run 1\ngroup g id 3\ndelete_atoms group g bond yes\nrun 1", ranks=3, said="closed ring"
    ),
    Row(
        "a dynamic group",
        "variable v atom mol<4\ngroup d dynamic rings var v every 5\nunfix area\n"
        "fix area d polygon/area 20 d_a0\nrun 1",
        said="dynamic",
    ),
    Row("a force along z", "fix z all addforce 0 0 0.1\nneigh_modify check no\nrun 9", said="enforce2d"),
    Row(
        "langevin without enforce2d",
        "fix l all langevin 0.1 0.1 1 4711\nneigh_modify check no\nrun 9",
        ranks=2,
        said="enforce2d",
    ),
    Row("three dimensions", "run 0", "dimension 3", said="2d"),
    Row("an edge too long", "displace_atoms all ramp x 0 5 x 0 5.2\nrun 0", said="edge between atoms"),
    *(
        Row(f"compute {style}", f"{GROUPS}compute q {group} {style}\nrun 0\nrun 0", said=said)
        for group, style, said in (
            ("a", "group/group b", "group/group"),
            ("all", "centroid/stress/atom NULL virial", "centroid"),
            ("all", "pair/local dist", "pair/local"),
            ("all", "born/matrix", "born"),
        )
    ),
    Row("pair_write", "pair_write 1 1 10 r 0.1 0.2 file label", said="circuloline"),
    Row("walls unknown", "pair_style circuloline 0.25 1.2 walls 9\npair_coeff * * 1.0\nrun 0", said="out of bounds"),
]
