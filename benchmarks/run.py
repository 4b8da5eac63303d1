# SPDX-License-Identifier: BSD-3-Clause
"""Measures this library and its peers.

It runs on Debian, and builds what it measures. It installs missing packages by apt, as root or with
sudo. coal, Embree 4 and the peers of Python come from PyPI, and FCL's source from Debian, into
build/benchmarks. A peer that cannot be fetched is left out and named. A set goes on where it was
ended: what was measured of this code is kept. All times are of 2 cores and do not include the
build. Results, tables, picture and page go to build/benchmarks/results. To write the tables into
the documents:

  /usr/bin/python3 benchmarks/report/report.py SET build/benchmarks/results/SET --docs .
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import sets

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build" / "benchmarks"
SET_HELP = {
    "full": "the table of docs/performance.md and most of docs/measured, in three and a half "
    "hours. It takes 6 GB of memory, and up to 20 GB if the machine has it",
    "trade": "docs/trade.md: what options cost and miss on fourteen scenes, and narrow phases, in "
    "20 minutes. A fifteenth, real hair, is measured if FCL_FIBERS_DATA names the folder of "
    "tressfx31_ponytail_tail.tfx",
    "paper": "the paper's Table I, figures, pictures and claims, in 110 minutes",
    "python": "docs/python.md: a step of the Python package, beside others and C++, in 10 "
    "minutes",
    "card": "FCL's managers as they are and ours on the paper's scenes, in double and in float, in "
    "an hour",
    "threads": "what 2, 4, ... and all cores of the machine gain, in 3 minutes",
}
PACKAGES = (
    "cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev libtbb-dev "
    "libpugixml-dev zlib1g-dev libcli11-dev libboost-dev libbenchmark-dev "
    "python3-pandas python3-jinja2 python3-matplotlib python3-venv"
)
TOOLS = "libfmt-dev nlohmann-json3-dev libjs-three"
OF_PYTHON = f"python3-dev pybind11-dev python3-numpy {TOOLS}"
OPTIONAL = "libembree-dev libbullet-dev"
COAL, EMBREE_4 = "coal==3.0.3", "embreex==4.4.0.post1"  # of PyPI
PONYTAIL = "tressfx31_ponytail_tail.tfx"


def parse(arguments):
    parser = argparse.ArgumentParser(
        prog="benchmarks/run.sh",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Without the name of a set it measures the README's table (SET is headline), in 30 "
        "to 45 minutes.",
        allow_abbrev=False,
    )
    group = parser.add_mutually_exclusive_group()
    for kind, text in SET_HELP.items():
        group.add_argument(f"--{kind}", dest="set", action="store_const", const=kind, help=text)
    parser.add_argument(
        "--only",
        metavar="NAME",
        help="only the measures whose names begin with it, such as obstacles of --full or "
        "trade_yarn of --trade",
    )
    parser.add_argument(
        "--processes",
        metavar="N",
        type=int,
        choices=range(1, 10),
        help="how many processes measure each scene of the README's table, 3 if it is not told. "
        "They differ more than the runs of one",
    )
    parser.add_argument("--again", action="store_true", help="measure what is measured already")
    parser.add_argument("--list", action="store_true", help="print the measures of the set")
    parser.add_argument(
        "--hair",
        metavar="FILE",
        type=Path,
        help="the fibers of a file instead of the scenes; alone, with --full or with --paper",
    )
    parser.add_argument("--radius", help="their radius in the file's unit, if the file has none")
    options = parser.parse_args(arguments)
    options.set = options.set or "headline"
    if options.radius and not options.hair:
        parser.error("--radius needs --hair FILE")
    if options.hair and options.set not in ("headline", "full", "paper"):
        parser.error(f"--hair does not go with --{options.set}")
    if options.hair and options.only:
        parser.error("--only does not go with --hair")
    if options.processes and (options.set != "headline" or options.hair):
        parser.error("--processes goes with the README's table alone")
    if options.hair and not options.hair.is_file():
        parser.error(f"--hair: {options.hair} is no file")
    options.measures = measures(options)
    is_readme = options.set == "headline" and not options.hair
    options.processes = (options.processes or 3) if is_readme else 1
    if not options.measures:
        parser.error(f"--only {options.only}: this set has no measure of that name")
    return options


def ponytail():
    folder = os.environ.get("FCL_FIBERS_DATA")
    path = Path(folder, PONYTAIL).resolve() if folder else None
    return path if path and path.exists() else None


def measures(options):
    if options.hair:
        words = f"--hair={options.hair.resolve()}"
        return sets.hair(
            options.set, words + (f" --radius={options.radius}" * bool(options.radius))
        )
    found = sets.SETS[options.set]
    if options.set == "trade":
        found = tuple(sets.trade(ponytail() is not None))
    return [one for one in found if one.name.startswith(options.only or "")]


def run(*command, **kwargs):
    subprocess.run(list(map(str, command)), check=True, stdout=sys.stderr, **kwargs)


def install(words):
    run(ROOT / ".ci" / "apt_install.sh", *words.split())


def of_pypi(package, path):
    """The path in a package of PyPI, which is installed; nothing if pip does not reach it."""
    name = package.split("=")[0]
    prefix = BUILD / name
    if not (prefix / "bin" / "pip").exists():
        run("/usr/bin/python3", "-m", "venv", prefix)
    done = subprocess.run([prefix / "bin" / "pip", "install", "-q", package], check=False)
    found = list(prefix.glob(f"lib/python3*/site-packages/{path}"))
    if done.returncode != 0 or not found:
        print(f"{name} cannot be installed; it is left out", file=sys.stderr)
        return None
    return found[0]


def coal():
    """Where CMake finds coal."""
    prefix = of_pypi(COAL, "cmeel.prefix")
    if not prefix:
        return []
    return [
        f"-DFCL_FIBERS_COAL_INCLUDE={prefix}/include",
        f"-DFCL_FIBERS_COAL={prefix}/lib/libcoal.so",
    ]


def embree_4():
    """Embree 4, or nothing. It is loaded in place of the Embree that a program is linked with: the
    functions that the benchmark calls are the same in Embree 3 and 4."""
    return of_pypi(EMBREE_4, "embreex.libs/libembree4*.so.4")


def build(programs):
    """Of the measures that are due."""
    install(PACKAGES)
    try:
        install(OPTIONAL)
    except subprocess.CalledProcessError:
        print("Embree or Bullet cannot be installed; they are left out", file=sys.stderr)
    goals = []
    flags = ["-DFCL_FIBERS_BUILD_TESTS=OFF", "-DFCL_FIBERS_BUILD_BENCHMARKS=ON"]
    flags += ["-DCMAKE_BUILD_TYPE=Release"]
    with_python, with_tools = "steps" in programs, "trade" in programs or "paper" in programs
    if with_python:
        install(OF_PYTHON)
        run(ROOT / "benchmarks" / "python" / "peers.sh", BUILD / "peers")
        goals += ["fcl_fibers_python", "fcl_fibers_step_in_cpp"]
        flags.append("-DPython3_EXECUTABLE=/usr/bin/python3")
    if with_tools:
        install(TOOLS)
        goals += ["fcl_fibers_program"] + ["fcl_fibers_topologies"] * ("paper" in programs)
    if programs & {"bench", "embree_4", "trade"}:
        goals.append("fcl_fibers_bench")
    if "headline" in programs:
        goals.append("fcl_fibers_headline")
    for name, wanted in (("PYTHON", with_python), ("TOOLS", with_tools)):
        flags.append(f"-DFCL_FIBERS_BUILD_{name}={'ON' if wanted else 'OFF'}")
    run("cmake", "-S", ROOT, "-B", BUILD, "-G", "Ninja", *flags, *coal())
    run("cmake", "--build", BUILD, "--target", *goals)


def build_native():
    """FCL and the benchmark for this machine's processor. Returns whether they are there."""
    try:
        run(ROOT / "benchmarks" / "fcl_native.sh", BUILD / "native")
    except subprocess.CalledProcessError:
        print("FCL cannot be built from Debian's source; that build is left out", file=sys.stderr)
        return False
    return True


def command_of(measure, data):
    words = [word.format(data=data, ponytail=ponytail()) for word in measure.words]
    programs = {
        "bench": [BUILD / "benchmarks" / "fcl_fibers_bench"],
        "headline": [BUILD / "benchmarks" / "fcl_fibers_headline"],
        "embree_4": [BUILD / "benchmarks" / "fcl_fibers_bench"],
        "native": [BUILD / "native" / "build" / "benchmarks" / "fcl_fibers_bench"],
        "steps": [
            *(BUILD / "peers" / "bin" / "python", "-B", ROOT / "benchmarks/python/steps.py"),
            f"--program={BUILD}/benchmarks/fcl_fibers_step_in_cpp",
        ],
        "trade": [
            *("/usr/bin/python3", "-B", ROOT / "benchmarks" / "python" / "trade.py"),
            *(f"--program={BUILD}/tools/fcl_fibers", f"--context={data}/costs.json"),
        ],
    }
    return [*map(str, programs[measure.program]), f"--measure={words[0]}", *words[1:]]


def git(*words):
    done = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def is_measured(path, code):
    return path.exists() and f'"code": "{code}"' in path.read_text(encoding="utf-8")


def results_of(measure, process, data):
    """Its file, as benchmarks/report/results.py reads it."""
    return data / f"{measure.name}{f'.{process}' * (process > 1)}.json"


def measure_all(due, data):
    """A measure that fails or is ended leaves no results. Returns whether all went well."""
    right, start = True, time.monotonic()
    for one, process in due:
        path = results_of(one, process, data)
        print(f"{time.monotonic() - start:4.0f} s  {path.stem}", file=sys.stderr)
        part = path.with_suffix(".part")
        path.unlink(missing_ok=True)
        command = [*command_of(one, data), f"--benchmark_out={part}"]
        env = {**os.environ, **one.env}
        if one.program == "embree_4":
            env["LD_PRELOAD"] = str(embree_4())
        done = subprocess.run(command, cwd=ROOT, env=env, check=False)
        if done.returncode == 0:
            part.rename(path)
            continue
        print(f"benchmarks/run.sh: the measure {one.name} has failed", file=sys.stderr)
        if part.exists():
            part.rename(path.with_suffix(".json.failed"))
        right = False
    return right


def pictures_of_paper(data):
    """What the page has beside curves."""
    view = (
        "paper-strand:fibers=500 paper-dynamic paper-half-scalp:straight=1,length=7,wisp_fibers=300"
    )
    run(
        *(BUILD / "tools" / "fcl_fibers", "view", *view.split(), "--points", 300000),
        *("--fragment", "-o", data / "view.html"),
    )
    run(
        *("/usr/bin/python3", "-B", ROOT / "docs" / "pictures" / "topologies.py"),
        *(BUILD / "docs" / "pictures" / "fcl_fibers_topologies", data / "topologies.png"),
    )


def main(arguments):
    options = parse(arguments)
    if options.list:
        print("\n".join(one.name for one in options.measures))
        return 0
    data = BUILD / "results" / (f"{options.set}_hair" if options.hair else options.set)
    data.mkdir(parents=True, exist_ok=True)
    code = subprocess.run(
        ["/usr/bin/python3", "-B", ROOT / "benchmarks" / "report" / "code_hash.py"],
        **{"check": True, "capture_output": True, "text": True},
    ).stdout.strip()
    # All measures, then all again: so the processes of one are far apart.
    due = [(one, 1 + i) for i in range(options.processes) for one in options.measures]
    if not (options.again or options.hair):
        count = len(due)
        due = [one for one in due if not is_measured(results_of(*one, data), code)]
        if len(due) < count:
            done = count - len(due)
            print(f"{done} measures of this code are kept; --again repeats them", file=sys.stderr)
    os.environ["FCL_FIBERS_COMMIT"] = git("describe", "--always", "--dirty")
    os.environ["FCL_FIBERS_CODE"] = code
    os.environ["PYTHONPATH"] = str(BUILD / "python")
    for path in data.glob("*.[2-9].json"):
        if not is_measured(path, code):
            path.unlink()  # It would be one of more processes than are asked for now.
    if due:
        programs = {one.program for one, _ in due}
        if options.set == "paper" and not options.hair:
            programs.add("paper")
        build(programs)
        for program, make in (("native", build_native), ("embree_4", embree_4)):
            if program in programs and not make():
                due = [(one, process) for one, process in due if one.program != program]
        if any("{data}/scenes" in " ".join(one.words) for one, _ in due):
            (data / "scenes").mkdir(exist_ok=True)
            run("/usr/bin/python3", "-B", ROOT / "docs" / "pictures" / "scenes.py", data / "scenes")
    right = measure_all(due, data)
    if due and options.set == "paper" and not (options.only or options.hair):
        pictures_of_paper(data)
    page, picture = data / "page.html", data / "picture.png"
    report = [
        *("/usr/bin/python3", "-B", ROOT / "benchmarks" / "report" / "report.py"),
        options.set,
    ]
    done = subprocess.run([*report, data, "--page", page, "--picture", picture], check=False)
    print(f"\nPage: {page}" + (f"\nPicture: {picture}" if picture.exists() else ""))
    return 0 if right and done.returncode == 0 else 1


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except subprocess.CalledProcessError as error:
        sys.exit(f"benchmarks/run.sh: {' '.join(map(str, error.cmd))} has failed")
