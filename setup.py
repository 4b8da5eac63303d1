# SPDX-License-Identifier: BSD-3-Clause
"""Builds the Python package by CMake. What it needs of Debian is in docs/installing.md:

pip install --no-build-isolation .
"""

import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).parent.resolve()


class CMakeBuild(build_ext):
    """Both modules in C++ and their libraries come from one build."""

    def run(self):
        build = Path(self.build_temp).resolve()
        package = Path(self.get_ext_fullpath("fcl_fibers._core")).resolve().parent
        off = ["MANAGERS", "TESTS", "BENCHMARKS", "TOOLS"]
        options = [f"-DFCL_FIBERS_BUILD_{part}=OFF" for part in off]
        options += ["-DFCL_FIBERS_BUILD_IO=ON", "-DFCL_FIBERS_BUILD_PYTHON=ON"]
        options += ["-DFCL_FIBERS_INSTALL=OFF", "-DCMAKE_BUILD_TYPE=Release"]
        options += [f"-DPython3_EXECUTABLE={sys.executable}"]
        subprocess.check_call(["cmake", "-S", ROOT, "-B", build, *options])
        threads = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count()))
        subprocess.check_call(
            ["cmake", "--build", build, "--target", "fcl_fibers_python", "--parallel", threads]
        )
        subprocess.check_call(
            ["cmake", "--install", build, "--component", "python", "--strip", "--prefix", package]
        )
        # A wheel has no links. The loader looks for a library by the name of its last one.
        links = [path for path in package.glob("*.so.*") if path.is_symlink()]
        copies = {link: link.resolve().read_bytes() for link in links}
        for file in set(links) | {link.resolve() for link in links}:
            file.unlink()
        for link, content in copies.items():
            link.write_bytes(content)


def version():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"VERSION (\d+\.\d+\.\d+)", text)[1]


setup(
    version=version(),
    ext_modules=[Extension("fcl_fibers._core", [])],
    cmdclass={"build_ext": CMakeBuild},
)
