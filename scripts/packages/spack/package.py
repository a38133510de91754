from spack.package import *


class Nscdd(CMakePackage):
    """Nonsmooth Contact Domain Decomposition of disks and spheres: a header-only kernel, and the program that drives it."""

    license("BSD-3-Clause")

    version("0.2.0")

    variant("program", default=True, description="Build the program nscdd and its libraries")

    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("eigen@3.4")
    with when("+program"):
        depends_on("c", type="build")
        depends_on("mpi")
        depends_on("hdf5")
        depends_on("metis")
        depends_on("suite-sparse")
        depends_on("fmt")
        depends_on("cli11")
        depends_on("nlohmann-json")
        depends_on("tomlplusplus")

    conflicts("%gcc@:11")

    def cmake_args(self):
        return [
            self.define_from_variant("NSCDD_HARNESS", "program"),
            self.define_from_variant("NSCDD_PROGRAM", "program"),
            self.define("NSCDD_TESTS", False),
            self.define("NSCDD_PYTHON", False),
            self.define("NSCDD_LEVELS", ""),  # Spack's compilers know their target
        ]
