# SPDX-License-Identifier: BSD-3-Clause
"""Conan 2 builds the libraries from this checkout: conan create packaging/conan --build=missing"""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir


class FclFibers(ConanFile):
    name = "fcl_fibers"
    description = "Collision detection among thousands of fibers, for the collision library FCL"
    license = "BSD-3-Clause"
    topics = ("collision-detection", "fibers", "hair")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {name: [True, False] for name in ("shared", "fPIC", "managers", "io")}
    default_options = {"shared": False, "fPIC": True, "managers": True, "io": True}
    implements = ["auto_shared_fpic"]

    def set_version(self):
        text = load(self, os.path.join(self.recipe_folder, "..", "..", "CMakeLists.txt"))
        self.version = re.search(r"VERSION (\d+\.\d+\.\d+)", text)[1]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "CITATION.cff", "package.xml"):
            copy(self, pattern, root, self.export_sources_folder)
        for folder in ("cmake", "examples", "include", "src"):
            copy(self, f"{folder}/*", root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def validate(self):
        check_min_cppstd(self, 17)

    def requirements(self):
        self.requires("highway/[>=1.0.3 <2]")
        self.requires("onetbb/[>=2021.3 <2023]")
        if self.options.managers:
            # The version of Eigen that FCL's recipe names.
            self.requires("eigen/3.4.0", transitive_headers=True)
            self.requires("fcl/0.7.0", transitive_headers=True, transitive_libs=True)
        if self.options.io:
            self.requires("pugixml/[>=1.13 <2]")
            self.requires("zlib/[>=1.2.11 <2]")

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables.update(
            FCL_FIBERS_BUILD_MANAGERS=bool(self.options.managers),
            FCL_FIBERS_BUILD_IO=bool(self.options.io),
            FCL_FIBERS_BUILD_BENCHMARKS=False,
            FCL_FIBERS_BUILD_TESTS=False,
            FCL_FIBERS_BUILD_TOOLS=False,
            FCL_FIBERS_BUILD_PYTHON=False,
        )
        toolchain.generate()
        dependencies = CMakeDeps(self)
        dependencies.set_property("highway", "cmake_file_name", "hwy")
        dependencies.set_property("highway::hwy", "cmake_target_name", "hwy::hwy")
        dependencies.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        # Conan writes these itself, with the names that its packages have.
        for folder in ("cmake", "pkgconfig"):
            rmdir(self, os.path.join(self.package_folder, "lib", folder))

    def package_info(self):
        # A component has the name that would be the package's.
        self.cpp_info.set_property("cmake_target_name", "fcl_fibers::all")
        self.add_component("tree", "fcl_fibers_tree", ["highway::hwy", "onetbb::libtbb"])
        if self.options.managers:
            self.add_component("fcl_fibers", "fcl_fibers", ["tree", "fcl::fcl", "eigen::eigen"])
        if self.options.io:
            self.add_component("io", "fcl_fibers_io", ["tree", "pugixml::pugixml", "zlib::zlib"])

    def add_component(self, name, library, requires):
        component = self.cpp_info.components[name]
        component.set_property("cmake_target_name", f"fcl_fibers::{name}")
        component.set_property("pkg_config_name", library)
        component.libs = [library]
        component.requires = requires
        if self.settings.os == "Linux":
            component.system_libs = ["pthread"]
