# SPDX-License-Identifier: BSD-3-Clause
"""Records anew what report_test.py makes reports of: record.py fcl_fibers_bench [NAME...]

Those of the Python package need it in PYTHONPATH, and fcl_fibers_step_in_cpp beside the program;
the Python that runs this needs the packages of benchmarks/python/peers.sh, too.
Small scenes, and of each file only what reports read, a run a line. full/growth.json and card are
written by hand, because ten million segments and managers that are slow take minutes.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[2] / "benchmarks" / "python"
HELIX = "--scene=helix:fibers=10,segments=20"
DYNAMIC = "--scene=paper-dynamic:fibers=40,segments=50"
HALF_SCALP = "--scene=paper-half-scalp:fibers=20,segments=10"
STRAND = "--scene=paper-strand:turns=2,helix_radius=0.5,fibers=10,segments=20"
STATIC = "--scene=paper-static:segments=20,fibers="
RECORDED = {
    "headline/frames_helix": ["frames", HELIX],
    "headline/frames_cap": ["frames", "--scene=cap:fibers=20,segments=10"],
    "headline/frames_paper-dynamic": ["frames", "--steps=5", DYNAMIC],
    "full/frames_helix": ["frames", "--against=full", HELIX],
    "full/best_helix_debian": ["frames", "--against=fcl", HELIX],
    "full/best_helix_float": ["frames", "--against=fcl", "--scalar=float", HELIX],
    "full/embree_helix_installed": ["frames", "--against=embree", HELIX],
    "full/queries": ["queries", "--benchmark_filter=collide, one|/spheres/"],
    "full/clients": ["clients", "--benchmark_filter=/9 capsules, self|/2 of 100"],
    "full/shapes": [
        "shapes",
        HELIX,
        "--benchmark_filter=Beside/kVolumes/|Beside/kCapsules/|FibersOf/|OneByOne/10 boxes",
    ],
    "full/arms": ["arms", "--benchmark_filter=Arms/(arm of hulls among 30|cable beside hulls)"],
    "full/arrays_helix": ["arrays", HELIX],
    "full/obstacles_combed": [
        "obstacles",
        "--scene=combed:fibers=100,segments=10",
        "--triangles=25600",
    ],
    "full/obstacles_cables": ["cables", "--cables=2", "--triangles=5000"],
    "full/live_helix": ["live", HELIX, "--motion=slow,weather", "--steps=40"],
    "full/live_helix-9": ["live", "--scene=helix:fibers=3,segments=3", "--motion=fast"],
    "full/live_helix-objects": ["live-objects", HELIX, "--motion=fast", "--steps=40"],
    "full/safe-distances": ["safe-distances", HELIX, "--motion=slow", "--steps=5"],
    "full/motion_50": ["motion", "--fibers=500", "--radii=50"],
    "full/motion_480": ["motion", "--fibers=500", "--radii=480"],
    "trade/costs": ["costs", "--benchmark_filter=Costs/.*/boxes(, fibers)?/|branches|mesh/"],
    "trade/trade_static": ["trade", "paper-static:fibers=20,segments=20,radius=0.05"],
    "trade/trade_dynamic-step": ["trade", "helix:fibers=20", "--end=helix:fibers=20,frame=3"],
    "trade/unused": ["unused", HELIX, "--benchmark_filter=cylinder|groups"],
    "trade/skins": ["live-skins", HELIX, "--steps=5", "--benchmark_filter=/(0|0.5|chosen)/"],
    "trade/narrow": [
        "narrow",
        HELIX,
        "--benchmark_filter=/(m|cm|um|m, 100 m away|grazing)/.*/(gjk_1e-6|ours)/",
    ],
    "trade/narrow_paper-static": [
        "narrow",
        STATIC + "20",
        "--benchmark_filter=Narrow/cm/.*/(gjk_1e-6|ours)/touch",
    ],
    "paper/static_50": ["frames", "--against=paper_all", STATIC + "10"],
    "paper/static_100": ["frames", "--against=paper_all", STATIC + "20"],
    "paper/axis_turned_1": ["frames", "--against=paper", STATIC + "10"],
    "paper/table_strand-loose-1000": ["frames", "--against=paper", STRAND],
    "paper/tests_strand-loose-1000": ["volume-tests", "--against=paper", STRAND],
    "paper/table_half-scalp": ["frames", "--against=paper", HALF_SCALP],
    "paper/tests_half-scalp": ["volume-tests", "--against=paper", HALF_SCALP],
    "paper/long_half-scalp_LayeredAABBTree": [
        "frames",
        "--against=paper:LayeredAABBTree/super_thread",
        HALF_SCALP,
    ],
    "paper/styles_scalp-15": [
        "volume-tests",
        "--against=paper:LayeredAABBTree/super_thread,LayeredAABBTree/capsules",
        HALF_SCALP,
    ],
    "paper/replay": ["replay", "--against=paper_all", "--steps=5", DYNAMIC],
    "paper/cascade_static": ["cascade", STATIC + "10,frames=0:2"],
    "paper/cascade_static_50": ["cascade", STATIC + "10"],
    "paper/cascade_static_100": ["cascade", STATIC + "20"],
    "python/steps_rods-30": ["steps", "--scene=rods:5"],
    "python/steps_helix-1000": ["steps", "--scene=helix:fibers=100,segments=20"],
    "python/overhead_helix-1000": ["overhead", "--scene=helix:fibers=10,segments=100"],
    "python/import": ["import"],
    "threads/threads_helix": ["threads", HELIX, "--threads=1,2,4"],
}
RUNS = 5  # of each name: a ratio asks for so many
CONTEXT = (
    *("machine", "compiler", "build_type", "commit", "code", "left_out"),
    *("libraries", "simd"),
)
COUNTS = ("segments", "contacts", "pieces", "judged_pieces")
READ = (
    "run_type",
    "run_name",
    "real_time",
    "time_unit",
    "label",
    "error_occurred",
    "error_message",
)


def shrunk(run):
    digits = {"end": 12}  # ends of runs are told apart
    numbers = {
        k: float(f"{v:.{digits.get(k, 5)}g}") for k, v in run.items() if isinstance(v, float)
    }
    numbers.pop("cpu_time", None)
    return {**{key: run[key] for key in READ if key in run}, **numbers}


def spread(runs):
    """RUNS of them from the whole time, because ratios are of runs next to each other."""
    count = min(RUNS, len(runs))
    return [runs[i * len(runs) // count] for i in range(count)]


def record(program, name, flags):
    path = Path(__file__).parent / "results" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "FCL_FIBERS_COMMIT": "abcdef0", "FCL_FIBERS_CODE": "0123456789ab"}
    command = [program]
    if name.startswith("python/"):
        beside = Path(program).parent / "fcl_fibers_step_in_cpp"
        command = [sys.executable, "-B", SCRIPTS / "steps.py", f"--program={beside}"]
    if "/trade_" in name:
        tool = Path(program).parent.parent / "tools" / "fcl_fibers"
        costs = path.parent / "costs.json"
        command = ["/usr/bin/python3", "-B", SCRIPTS / "trade.py", f"--program={tool}"]
        command.append(f"--context={costs}")
    command += [f"--measure={flags[0]}", *flags[1:], f"--benchmark_out={path}"]
    subprocess.run(command, check=True, env=environment)
    document = json.loads(path.read_text())
    runs = {}
    for run in document["benchmarks"]:
        if run["run_type"] == "iteration":
            runs.setdefault(run["run_name"], []).append(json.dumps(shrunk(run)))
    lines = ",\n".join(run for found in runs.values() for run in spread(found))
    known = document["context"]
    context = json.dumps({key: known[key] for key in (*CONTEXT, *COUNTS) if key in known})
    text = f'{{"context": {context},\n"benchmarks": [\n{lines}\n]}}\n'
    path.write_text(text)


if __name__ == "__main__":
    for name in sys.argv[2:] or RECORDED:
        record(sys.argv[1], name, RECORDED[name])
