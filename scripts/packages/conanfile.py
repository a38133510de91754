"""Recipe of the header for Conan 2: conan create scripts/packages"""

from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.files import copy, load


class Nscdd(ConanFile):
    name = "nscdd"
    license = "BSD-3-Clause"
    description = "Nonsmooth Contact Domain Decomposition: header-only kernel"
    topics = ("contact mechanics", "domain decomposition", "granular media", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    def set_version(self):
        text = load(self, Path(self.recipe_folder, "../../CMakeLists.txt"))
        self.version = text.split("project(nscdd VERSION ", 1)[1].split()[0]

    def export_sources(self):
        root = Path(self.recipe_folder, "../..")
        for pattern in ("CMakeLists.txt", "LICENSE", "kernel/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def requirements(self):
        self.requires("eigen/[>=3.4 <4]", transitive_headers=True)

    def validate(self):
        check_min_cppstd(self, 20)

    def package_id(self):
        self.info.clear()

    def package(self):
        root = Path(self.source_folder)
        copy(self, "LICENSE", root, Path(self.package_folder, "licenses"))
        copy(self, "*.hpp", root / "kernel/include", Path(self.package_folder, "include"))

    def package_info(self):
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
        self.cpp_info.set_property("cmake_file_name", "nscdd")
        self.cpp_info.set_property("cmake_target_name", "nscdd::kernel")
        if self.settings.os == "Linux":
            self.cpp_info.system_libs = ["pthread"]
