"""Rows of `option_table` with adhesion, bending and elastic perimeters at once, and rows of their own."""

from dataclasses import replace

import option_table
from option_table import FLAT, HEAD, OWN, PLAIN, TILES, Row
from plain_forces import Law

ADHESION = ((0.1, 0.3), (0.05, 0.2), (0.02, 0.035))  # of each type: pull and range, over the width
LAW = Law(adhesion=ADHESION, bend=(0.02, 0.6), perimeter=(0.3, 0.2, 3.7))
COEFFICIENTS = [line for line in HEAD.splitlines() if line.startswith("pair_coeff")]
STICKY = "".join(f"{line} adhesion {a} {b}\n" for line, (a, b) in zip(COEFFICIENTS, ADHESION, strict=True))
FIXES = """\
fix bend rings polygon/bending 0.02 0.6
fix perimeter rings polygon/perimeter 0.3 0.2 3.7 d_a0
"""
MOST_RANKS = 3  # more cost time
OTHER = ("pair_coeff", "pair_style", "respa", "{head", "bond_coeff", "polygon/", "numdiff", "create_bonds")


def with_laws(rows):
    """Those of at most three ranks and no law of their own, which start where all meet: all have one path of plain
    numpy, which takes 15 s of CPU time."""
    for row in rows:
        own = row.law != PLAIN or row.scene != "all" or any(word in row.head + row.lines for word in OTHER)
        if not own and row.ranks <= MOST_RANKS:
            yield sticky(row.name, row.lines, row.head, row.ranks, words=row.words)


def sticky(name, lines, head, ranks, law=LAW, **more):
    return Row(f"outline laws, {name}", lines, f"{head}\n{STICKY}".lstrip(), ranks, law, after=FIXES, **more)


SELF = OWN.replace("pair_coeff * * 1.7", "pair_coeff * * 1.7 adhesion 0.1 0.3")
FOLDED = {"law": replace(LAW, near=0.1), "scene": "folded", "after": FIXES}
PATHS = [
    *with_laws(option_table.PATHS),
    Row("outline laws, self", "", SELF, 1, **FOLDED),
    Row("outline laws, self, newton off", "thermo 1", f"{SELF}\nnewton off", 2, **FOLDED),
    Row("outline laws, self, tiled", TILES, SELF, 3, **FOLDED),
    *(sticky(f"flat, {n} ranks", "", FLAT, n, scene="flat") for n in (1, 3)),
    sticky("flat, newton off", "", f"{FLAT}\nnewton off", 2, scene="flat"),
]
STATES = list(with_laws(option_table.STATES))
RESPA = "run_style respa 2 1 bond 1 pair 2\nrun 1"
REFUSALS = [Row("bending and respa", RESPA, after=FIXES, said="works without run_style respa")]
