"""Changes of files that LAMMPS' tree has, for the two pull requests."""

from pprint import pformat

SCRIPT = '''\
"""Puts the files beside it into LAMMPS' tree, and changes files of LAMMPS' own: python tree_changes.py LAMMPS

Of each: a pattern of the line before which the text goes, the first that fits; words go into the dictionary by the
alphabet. Nothing is changed twice, and nothing at all unless every pattern is found. Sources get the form that the
tree asks for, by its own settings of clang-format (`pip install clang-format`). Afterwards: git diff.
"""

import re
import shutil
import subprocess
import sys
from bisect import bisect
from pathlib import Path

CHANGES = {changes}
DICTIONARY, WORDS = {dictionary!r}, {words!r}
FORM = "{{BasedOnStyle: InheritParentConfig, ReflowComments: true, AllowShortBlocksOnASingleLine: Never}}"  # from 14 on

beside, tree = Path(__file__).parent, Path(sys.argv[1])
texts = {{}}
for name, pattern, added in CHANGES:
    path = tree / name
    if not path.exists():
        sys.exit(f"{{path}}: no such file; needs a clone of LAMMPS' repository, not a tarball")
    text = texts.get(path) or path.read_text()
    place = re.search(pattern, text, re.MULTILINE)
    if place is None:
        sys.exit(f"{{name}}: no line begins with {{pattern}}")
    texts[path] = text if added in text else text[: place.start()] + added + text[place.start() :]
path = tree / DICTIONARY
listed = path.read_text().splitlines()
for word in WORDS:
    if word not in listed:
        listed.insert(bisect([other.casefold() for other in listed], word.casefold()), word)
texts[path] = "\\n".join([*listed, ""])
if shutil.which("clang-format") is None:
    sys.exit("needs clang-format: pip install clang-format")
if not (tree / "src" / ".clang-format").exists():
    sys.exit(f"{{tree}}: no file src/.clang-format, which says the form of sources")
for path, text in texts.items():
    path.write_text(text)
for folder in (path for path in beside.iterdir() if path.is_dir()):
    shutil.copytree(folder, tree / folder.name, dirs_exist_ok=True)
sources = sorted(path.name for path in (beside / "src" / "POLYGON").iterdir() if path.suffix in (".h", ".cpp"))
subprocess.run(["clang-format", "-i", f"--style={{FORM}}", *sources], cwd=tree / "src" / "POLYGON", check=True)
'''
DETAILS = """\
.. _PKG-POLYGON:

POLYGON package
---------------

**Contents:**

Deformable polygons in two dimensions, as models of droplets, bubbles, or cells:
rings of bonded atoms with line tension, with an elastic area, with bending stiffness and an elastic perimeter,
and with contacts between their rims, also to walls and disks, which may adhere.

.. versionadded:: TBD

**Author:** AUTHOR (AFFILIATION)

**Supporting info:**

* src/POLYGON: filenames -> commands
* src/POLYGON/README
* :doc:`bond_style line/tension <bond_line_tension>`
* :doc:`fix polygon/area <fix_polygon_area>`
* :doc:`fix polygon/bending <fix_polygon_bending>`
* :doc:`fix polygon/perimeter <fix_polygon_perimeter>`
* :doc:`compute polygon <compute_polygon>`

----------

"""
ROW = """\
   * - :ref:`POLYGON <PKG-POLYGON>`
     - deformable polygons
     - :doc:`bond_style line/tension <bond_line_tension>`
     - ``PACKAGES/polygon``
     - no
"""
CMAKE = """\
pkg_depends(POLYGON MOLECULE)
"""
EDGE = """\
.. _err_polygon_edge:

Edge between atoms of a polygon is longer than ...
--------------------------------------------------

Pair style circuloline finds ghost atoms up to its second argument, the longest edge that may occur, plus the contact
width.  A bond of a polygon that grows beyond it may end at an atom that its processor does not know.  Raise that
argument, or look for the reason why the bond grows: a time step too large, a line tension or area stiffness far from
the lattice of the start, or two atoms that are bonded by mistake.

"""
DEPEND = """\
if (test $1 = "MOLECULE") then
  depend POLYGON
fi

"""
DICTIONARY = "doc/utils/sphinx-config/false_positives.txt"
WORDS = {
    1: ["Boromand", "Lowensohn", "O'Hern", "Orellana", "Shattuck", "Signoriello"],
    2: ["circuloline"],
}  # by request
PRESETS = ("all_on", "all_off", "most", "windows", "mingw-cross")
Change = tuple[str, str, str]  # file, pattern of a line, what goes before it


def listed(kind: str, style: str, page: str, says: str) -> list[Change]:
    """A style in its table of commands and in the list of its kind, before the style that follows in the alphabet."""
    following = {"bond": "mesocnt", "fix": "pour", "compute": "pressure", "pair": "colloid"}[kind]
    name = kind if kind in ("fix", "compute") else f"{kind}_style"
    row = rf"^   \* :doc:`{following}\b"
    bullet = rf"^\* :doc:`{following}\b"
    return [
        (f"doc/src/Commands_{kind}.rst", row, f"   * :doc:`{style} <{page}>`\n"),
        (f"doc/src/{name}.rst", bullet, f"* :doc:`{style} <{page}>` - {says}\n"),
    ]


def first_request(files: list[str]) -> list[Change]:
    """A new package, with its bond style, fix and compute; `files`: of its sources."""
    return [
        ("cmake/CMakeLists.txt", r"^  PTM$", "  POLYGON\n"),
        ("cmake/CMakeLists.txt", r"^pkg_depends\(", CMAKE),
        *((f"cmake/presets/{name}.cmake", r"^  (PTM|PYTHON|QEQ)$", "  POLYGON\n") for name in PRESETS),
        ("src/Makefile", r"^\tptm \\$", "\tpolygon \\\n"),
        ("src/Depend.sh", r'^if \(test "?\$1"? = "PERI"\)', DEPEND),
        ("src/.gitignore", r"^/\w+\.cpp$", "".join(f"/{name}\n" for name in files)),
        (".github/CODEOWNERS", r"^src/PTM/", "src/POLYGON/*         @AUTHOR\n"),
        ("doc/src/Packages_list.rst", r"^   \* - :ref:`PTM ", ROW),
        ("doc/src/Packages_details.rst", r"^   \* :ref:`PTM ", "   * :ref:`POLYGON <PKG-POLYGON>`\n"),
        ("doc/src/Packages_details.rst", r"^\.\. _PKG-PTM:", DETAILS),
        *listed("bond", "line/tension", "bond_line_tension", "tension that does not depend on the length"),
        *listed("fix", "polygon/area", "fix_polygon_area", "elastic area of polygons"),
        *listed("fix", "polygon/bending", "fix_polygon_bending", "bending stiffness of polygons"),
        *listed("fix", "polygon/perimeter", "fix_polygon_perimeter", "elastic perimeter and edges of polygons"),
        *listed("compute", "polygon", "compute_polygon", "area, perimeter and shape of polygons"),
    ]


def second_request(files: list[str]) -> list[Change]:
    """A pair style and its compute in that package."""
    return [
        ("src/.gitignore", r"^/\w+\.cpp$", "".join(f"/{name}\n" for name in files)),
        *listed("pair", "circuloline", "pair_circuloline", "contacts of polygons, walls and disks"),
        *listed("compute", "polygon/contact", "compute_polygon_contact", "contacts of polygons"),
        ("doc/src/Howto.rst", r"^   Howto_polarizable$", "   Howto_polygon\n"),
        ("doc/src/Errors_details.rst", r"^\.\. _err0001:", EDGE),
    ]


def changes(request: int, files: list[str]) -> list[Change]:
    """Of one request, with the names of its sources."""
    return (first_request if request == 1 else second_request)(files)


def script(request: int, changes: list[Change]) -> str:
    """The program that makes them."""
    listed = pformat(changes, width=116)
    return SCRIPT.format(changes=listed, dictionary=DICTIONARY, words=WORDS[request])
