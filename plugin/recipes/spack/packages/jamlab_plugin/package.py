"""Spack package of the plugin and the decks, built from the sdist for Spack's LAMMPS: docs/how_to/another_lammps.md."""

from pathlib import Path

from spack.package import conflicts, depends_on, license, version
from spack_repo.builtin.build_systems.cmake import CMakePackage


class JamlabPlugin(CMakePackage):
    """LAMMPS plugin and decks for jammed packings of disks and deformable polygons in two dimensions."""

    homepage = "https://doi.org/10.1039/C9SM00775J"
    url = f"file://{Path(__file__).resolve().parents[5] / 'dist' / 'jamlab-0.3.0.tar.gz'}"
    root_cmakelists_dir = "plugin"

    license("GPL-2.0-or-later")

    version("0.3.0")  # with --no-checksum: python -m build --sdist --outdir dist

    depends_on("cxx", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("mpi")
    depends_on("lammps@20230802:20250722 +lib+mpi+plugin+molecule+extra-pair", type=("build", "link", "run"))
    conflicts("^lammps lammps_sizes=smallsmall")

    def cmake_args(self):
        lammps = self.spec["lammps"]
        date, _, update = str(lammps.version).partition(".")
        sizes = lammps.variants["lammps_sizes"].value.upper()
        return [
            self.define("LAMMPS_PREFIX", lammps.prefix),
            self.define("LAMMPS_RELEASE", f"{date[:4]}.{int(date[4:6])}.{int(date[6:])}.{update or 0}"),
            self.define("LAMMPS_SIZES", f"LAMMPS_{sizes}"),
            self.define("MPI_INCLUDE", self.spec["mpi"].prefix.include),
        ]

    def setup_run_environment(self, env):
        env.prepend_path("LAMMPS_PLUGIN_PATH", self.prefix.jamlab.plugin)
