# SPDX-License-Identifier: BSD-3-Clause
from pathlib import Path

from spack_repo.builtin.build_systems.cmake import CMakePackage

from spack.package import depends_on, license, variant, version


class FclFibers(CMakePackage):
    """Collision detection among thousands of fibers, without managers: Spack has no FCL."""

    # No release is published yet, so this builds the checkout that it lies in.
    git = Path(__file__).resolve().parents[5].as_uri()
    version("main", branch="main")
    license("BSD-3-Clause")

    variant("shared", default=True, description="Build shared libraries")
    variant("io", default=True, description="Build fcl_fibers::io")

    depends_on("cxx", type="build")
    depends_on("cmake@3.22:", type="build")
    depends_on("highway")
    depends_on("intel-tbb@2021:")
    depends_on("pugixml", when="+io")
    depends_on("zlib-api", when="+io")

    def cmake_args(self):
        return [
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define_from_variant("FCL_FIBERS_BUILD_IO", "io"),
            self.define("FCL_FIBERS_BUILD_MANAGERS", False),
            self.define("FCL_FIBERS_BUILD_BENCHMARKS", False),
            self.define("FCL_FIBERS_BUILD_TESTS", False),
            self.define("FCL_FIBERS_BUILD_TOOLS", False),
            self.define("FCL_FIBERS_BUILD_PYTHON", False),
        ]
