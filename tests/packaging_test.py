#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether the recipes of packaging/ follow the build: its version, its options and what it needs;
and whether all public headers are installed.

It reads them as text. Whether a registry's own tool accepts them is not tested here."""

import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RECIPES = {
    "vcpkg": "packaging/vcpkg/fcl-fibers/portfile.cmake",
    "Conan": "packaging/conan/conanfile.py",
    "conda": "packaging/conda/recipe.yaml",
    "Spack": "packaging/spack_repo/fcl_fibers/packages/fcl_fibers/package.py",
}
# What CMake finds, and its name in each registry. Spack has no FCL.
NAMES = {
    "hwy": {"vcpkg": "highway", "Conan": "highway", "conda": "libhwy", "Spack": "highway"},
    "TBB": {"vcpkg": "tbb", "Conan": "onetbb", "conda": "tbb-devel", "Spack": "intel-tbb"},
    "Eigen3": {"vcpkg": "eigen3", "Conan": "eigen", "conda": "eigen"},
    "fcl": {"vcpkg": "fcl", "Conan": "fcl", "conda": "fcl"},
    "pugixml": {name: "pugixml" for name in RECIPES},
    "ZLIB": {"vcpkg": "zlib", "Conan": "zlib", "conda": "zlib", "Spack": "zlib-api"},
}
# A recipe needs these for building, and CMake does not look for them.
TOOLS = {"cxx", "cmake", "vcpkg-cmake", "vcpkg-cmake-config"}


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def version_errors():
    versions = {
        "CMakeLists.txt": re.search(r"\bVERSION (\d+\.\d+\.\d+)", read("CMakeLists.txt"))[1],
        "package.xml": re.search(r"<version>(.*)</version>", read("package.xml"))[1],
        "CITATION.cff": re.search(r"^version: (.*)$", read("CITATION.cff"), re.M)[1],
        RECIPES["conda"]: re.search(r'^  version: "(.*)"$', read(RECIPES["conda"]), re.M)[1],
        "packaging/vcpkg/fcl-fibers/vcpkg.json": port()["version"],
    }
    right = versions["CMakeLists.txt"]
    return [
        f"{path}: the version is {version}, and {right} in CMakeLists.txt"
        for path, version in versions.items()
        if version != right
    ]


def port():
    return json.loads(read("packaging/vcpkg/fcl-fibers/vcpkg.json"))


def option_errors():
    parts = set(re.findall(r"fcl_fibers_part\((\w+)", read("CMakeLists.txt")))
    for path in RECIPES.values():
        named = set(re.findall(r"FCL_FIBERS_\w+", read(path)))
        for option in sorted(named - parts):
            yield f"{path}: CMakeLists.txt has no part {option}"
        for option in sorted(parts - named):
            yield f"{path}: does not say whether {option} is ON or OFF"


def found_by_cmake():
    """What the libraries need that recipes build: without that of the benchmark."""
    text = read("CMakeLists.txt")
    found = re.findall(r"find_package\((\w+) REQUIRED\)", text)
    for library in ("MANAGERS", "IO"):
        packages = re.search(rf"FCL_FIBERS_BUILD_{library} [^)]*PACKAGES ([^)]*)\)", text)[1]
        found += re.findall(r'"?([A-Za-z]\w*)', packages)
    return set(found) - {"Threads"}


def named_by_recipes():
    parts = [port(), *port()["features"].values()]
    host = re.search(r"^  host:\n((?:    - .*\n)+)", read(RECIPES["conda"]), re.M)[1]
    named = {
        "vcpkg": [d if isinstance(d, str) else d["name"] for p in parts for d in p["dependencies"]],
        "Conan": re.findall(r'self\.requires\("([\w-]+)/', read(RECIPES["Conan"])),
        "conda": re.findall(r"- ([\w-]+)", host),
        "Spack": re.findall(r'depends_on\("([\w-]+)', read(RECIPES["Spack"])),
    }
    return {registry: set(names) - TOOLS for registry, names in named.items()}


def dependency_errors():
    found = found_by_cmake()
    if found != set(NAMES):
        yield f"NAMES in tests/packaging_test.py has {sorted(NAMES)}; CMake finds {sorted(found)}"
    config = read("cmake/fcl_fibers-config.cmake.in")
    asked = re.findall(r"find_dependency\((\w+)\)", config)
    for needs in re.findall(r"set\(fcl_fibers_needs (.+)\)", config):
        asked += re.findall(r'"?([A-Za-z]\w*)', needs)
    if set(asked) - {"Threads", "benchmark"} != found:
        yield f"cmake/fcl_fibers-config.cmake.in finds {asked}; CMakeLists.txt {sorted(found)}"
    for registry, named in named_by_recipes().items():
        expected = {names[registry] for names in NAMES.values() if registry in names}
        if named != expected:
            yield f"{RECIPES[registry]}: needs {sorted(named)}, and should need {sorted(expected)}"


def header_errors():
    installed = set(re.findall(r"[\w/]+\.h\b", read("cmake/install.cmake")))
    for header in sorted((ROOT / "include" / "fcl_fibers").glob("**/*.h")):
        name = header.relative_to(ROOT / "include" / "fcl_fibers").as_posix()
        if name not in installed:
            yield f"cmake/install.cmake does not install {name}"


def main():
    errors = [*version_errors(), *option_errors(), *dependency_errors(), *header_errors()]
    print("\n".join(errors) or f"{len(RECIPES)} recipes follow CMakeLists.txt")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
