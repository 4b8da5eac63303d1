# SPDX-License-Identifier: BSD-3-Clause
"""Adds what CMake builds to a wheel; pyproject.toml tells the rest."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CMakeBuild(BuildHookInterface):
    def initialize(self, version, build_data):
        # One folder for all versions of Python, because most of what is compiled is the same for
        # all. The cache would keep the Python and the pybind11 of the last one.
        build = Path(self.root, "build", "wheel")
        (build / "CMakeCache.txt").unlink(missing_ok=True)
        is_editable = version == "editable"
        package = Path(self.root, "python", "fcl_fibers") if is_editable else build / "package"
        os.environ.setdefault("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count()))
        for arguments in (
            ["--preset", "wheel", "-B", build, f"-DPython3_EXECUTABLE={sys.executable}"],
            ["--build", build, "--target", "fcl_fibers_python"],
            ["--install", build, "--component", "python", "--strip", "--prefix", package],
        ):
            subprocess.run(["cmake", *arguments], cwd=self.root, check=True)
        ending = sysconfig.get_config_var("EXT_SUFFIX")
        files = [*package.glob(f"*{ending}"), *package.glob("lib*.so")]
        build_data["pure_python"] = False
        python = "cp" + sysconfig.get_config_var("py_version_nodot")
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["tag"] = f"{python}-{python}{sys.abiflags}-{platform}"
        build_data["force_include"].update({f: f"fcl_fibers/{f.name}" for f in files})
