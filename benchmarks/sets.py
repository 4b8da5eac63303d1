# SPDX-License-Identifier: BSD-3-Clause
"""The one list of what is measured: by set, the measures that belong together.

benchmarks/run.py runs them, and benchmarks/report makes tables of their results.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Measure:
    name: str  # of the file of its results
    words: tuple  # the measure of the program and its flags; {data} is the folder of results
    program: str = "bench"  # as command_of() in run.py has it
    title: str = ""  # of its scene in tables
    env: dict = field(default_factory=dict)


def measure(name, words, program="bench", title="", **env):
    return Measure(name, tuple(words.split()), program, title, env)


HELIX = "--scene=helix:fibers=1000,segments"


def frames(against, scenes, program="bench"):
    words = f"frames --against={against}"
    return [measure(f"frames_{name}", f"{words} {scene}", program) for name, scene in scenes]


def headline():
    return frames(
        "headline",
        (
            ("helix", f"{HELIX}=100"),
            ("cap", "--scene=cap:fibers=10000"),
            ("paper-dynamic", "--scene=paper-dynamic --steps=20"),
        ),
        "headline",  # Its own files compile in a tenth of the time.
    )


def live():
    def of(name, scene, motion, steps, runs, kind="live", title="{}"):
        return measure(
            f"live_{name}",
            f"{kind} --scene={scene} --motion={motion} --steps={steps} --runs={runs}",
            title=title.format(scene.split(":")[0]),
        )

    helix = "helix:fibers=1000,segments"
    yield of("helix", f"{helix}=100", "slow,fast,weather", 300, 5)
    yield of("helix-objects", f"{helix}=100", "fast", 500, 1, "live-objects", "FCL's objects, {}")
    yield of("helix-thick", f"{helix}=100,radius=0.016", "slow,fast", 300, 1, title="{}, thick")
    yield of("helix-2000", f"{helix}=2000", "slow,fast", 100, 1)
    yield of("cap", "cap:fibers=10000", "creeping", 150, 1)
    yield of("cap-frames", "cap:fibers=10000", "frames", 25, 1)
    yield of("paper-dynamic", "paper-dynamic", "frames", 200, 5)
    for fibers, segments in ((3, 3), (10, 5), (10, 20), (10, 100)):
        scene = f"helix:fibers={fibers},segments={segments}"
        yield of(f"helix-{fibers * segments}", scene, "fast", 500, 9)


def full():
    cap, dynamic = "--scene=cap:fibers=50000", "--scene=paper-dynamic"
    scenes = (
        ("helix", f"{HELIX}=100"),
        ("helix-2000", f"{HELIX}=2000"),
        ("cap", cap),
        ("paper-dynamic", dynamic),
    )
    yield from frames("full", scenes)
    small = (scenes[0], ("cap", "--scene=cap:fibers=10000"), scenes[3])
    for name, scene in small:
        words = f"frames --against=fcl {scene}"
        yield measure(f"best_{name}_debian", words)
        yield measure(f"best_{name}_native", words, "native")
        yield measure(f"best_{name}_float", f"{words} --scalar=float")
        for simd in ("avx2", "sse4"):
            yield measure(f"best_{name}_{simd}", words, FCL_FIBERS_SIMD=simd)
    for name, scene in small:
        words = f"frames --against=embree {scene}"
        yield measure(f"embree_{name}_installed", words)
        yield measure(f"embree_{name}_4", words, "embree_4")
    for name in ("queries", "clients", "shapes", "arms"):
        yield measure(name, name)
    for name, scene in scenes[:3]:
        yield measure(f"arrays_{name}", f"arrays {scene}")
    yield measure("growth", "growth")
    yield measure("obstacles_cap", f"obstacles {cap}")
    yield measure("obstacles_combed", "obstacles --scene=combed:fibers=10000")
    yield measure("obstacles_cables", "cables")
    for radii in (5, 50, 150, 480):
        yield measure(f"motion_{radii}", f"motion --radii={radii}")
    yield from live()
    yield measure("safe-distances", f"safe-distances {cap} --motion=slow --runs=1")


def trade(has_ponytail=True):
    """What `fcl_fibers trade` tells of scenes, what options cost, and narrow phases."""
    yield measure("costs", "costs")
    yield measure("unused", f"unused {HELIX}=100")
    files = "{data}/scenes"
    head = f"{files}/parting.txt --radius=0.05"
    cables = f"{files}/cables.txt --radius=0.004"
    strand = "paper-strand:fibers=200,area=0.615,straight=1,turns=2,helix_radius=0.5,deviation=0.3"
    scalp = "paper-half-scalp:straight=1,fibers=4000,length=7,wisp_fibers=300"
    for name, title, words in (
        ("static", "the paper's static assembly", "paper-static"),
        ("dynamic", "its dynamic assembly", "paper-dynamic"),
        ("dynamic-step", "a step of that", "paper-dynamic:frame=85 --end=paper-dynamic:frame=86"),
        ("half-scalp", "its half scalp", scalp),
        ("strand", "its strand", strand),
        ("wind", "a head in the wind, a step", "cap:fibers=5000 --end=cap:fibers=5000,frame=1"),
        ("curls", "helices, finely cut", "helix:fibers=100,segments=1600"),
        ("head", "combed hair", head),
        ("head-mesh", "combed hair, on its head", f"{head} --mesh={files}/head.obj"),
        ("yarn", "yarn", f"{files}/tube.txt --radius=0.125"),
        ("cables", "cables", cables),
        ("cables-mesh", "cables, beside an arm", f"{cables} --mesh={files}/arm.obj"),
        ("neuron", "a neuron", f"{files}/neuron.swc"),
        ("tract", "a tract", f"{files}/tract.txt --radius=0.05"),
        *((("hair", "real hair", "{ponytail} --radius=0.05"),) if has_ponytail else ()),
    ):
        picture = f"{{data}}/trade_{name}.svg"
        words = f"trade {words} --longest=4s --picture={picture}"
        yield measure(f"trade_{name}", words, "trade", title)
    yield measure("skins", f"live-skins {HELIX}=100 --motion=slow,fast --steps=100 --runs=1")
    yield measure("narrow", f"narrow {HELIX}=100")
    narrow = "narrow --scene=paper-static:fibers=1000 --benchmark_filter=^Narrow/cm/"
    yield measure("narrow_paper-static", narrow)


def card():
    """All of FCL's managers and ours on the paper's scenes."""
    for scalar in ("double", "float"):
        for name, title, scene in (
            ("static", "static assembly", "paper-static"),
            ("dynamic", "dynamic assembly", "paper-dynamic"),
            ("half-scalp", "half scalp", "paper-half-scalp"),
            ("strand-1000", "strand of 1,000", "paper-strand:fibers=1000"),
            ("strand-2000", "strand of 2,000", "paper-strand:fibers=2000"),
        ):
            words = f"card --scene={scene} --scalar={scalar} --limit=10"
            yield measure(f"card_{name}_{scalar}", words, title=title)


def threads():
    yield measure("threads_helix", f"threads {HELIX}=100 --runs=25")
    yield measure("threads_helix-2000", f"threads {HELIX}=2000")
    yield measure("threads_cap", "threads --scene=cap:fibers=50000 --runs=3")


def python():
    def steps(name, words, title=""):
        return measure(name, words, "steps", title)

    yield steps("import", "import")
    yield steps("overhead_helix-1000", f"overhead {HELIX}=100")
    yield steps("overhead_bundles-1000", "overhead --scene=bundles:1000")
    for n in (30, 100, 300):
        yield steps(f"steps_rods-{n}", f"steps --scene=rods:{n}", f"rods {n} x 50")
    for n in (100, 1000):
        words = f"steps --scene=helix:fibers={n},segments=100"
        yield steps(f"steps_helix-{n}", words, f"helix {n:,} x 100")
    yield steps("steps_tract-2000", "steps --scene=bundles:2000,0.2", "tract 2,000 x 100")


# Straight rods at the paper's density, except the tight helix, whose rods are curved.
SCALP, STRAND = "--scene=paper-half-scalp", "--scene=paper-strand"
LOOSE = "straight=1,turns=2,helix_radius=0.5,deviation=0.3"
WISPS = "straight=1,length=7,wisp_fibers=300"


def table_one():
    """Table I. A published tree that takes minutes is measured by itself, or estimated."""
    most = 5400
    for name, scene, limit, slow in (
        ("strand-1000", f"{STRAND}:area=3.077,deviation=0.00015", most, None),
        ("strand-2000", f"{STRAND}:fibers=2000", most, None),
        ("strand-loose-1000", f"{STRAND}:area=3.077,{LOOSE}", most, None),
        (
            "strand-loose-2000",
            f"{STRAND}:fibers=2000,area=6.154,{LOOSE.replace('0.3', '0.2')}",
            most,
            None,
        ),
        ("half-scalp-wisps", f"{SCALP}:{WISPS}", most, "WrappedSphereTree"),
        ("half-scalp", f"{SCALP}:straight=1", 60, "LayeredAABBTree"),
    ):
        yield measure(f"table_{name}", f"frames --against=paper --limit=60 {scene}")
        tests = f"volume-tests --against=paper --limit={limit} {scene}"
        yield measure(f"tests_{name}", tests)
        if slow:
            against = f"--against=paper:{slow}/super_thread"
            yield measure(f"long_{name}_{slow}", f"frames {against} --limit={most} {scene}")


def styles():
    """A sample of each traversal is enough to compare scenes."""
    wisps = f"{SCALP}:wisp_fibers=300"
    curved = f"{STRAND}:turns=2,helix_radius=0.5,deviation=0.0034"
    straight = f"{STRAND}:area=3.077,{LOOSE}"
    straight_title = "2 turns, radius 0.5 cm, straight rods, half the area"
    for name, title, scene in (
        ("scalp-15", "15 cm, random order", SCALP),
        ("scalp-15-rows", "15 cm, rows", f"{SCALP} --rows"),
        ("scalp-15-wisps", "15 cm, wisps", f"{wisps},tip_deviation=0.2"),
        ("scalp-15-hanging", "15 cm, wisps, hanging", f"{wisps},hanging=1"),
        ("scalp-7", "7 cm, random order", f"{SCALP}:length=7"),
        ("scalp-7-wisps", "7 cm, wisps", f"{wisps},length=7"),
        ("scalp-5-wisps", "5 cm, wisps", f"{wisps},length=5"),
        ("scalp-7-hanging", "7 cm, wisps, hanging", f"{wisps},length=7,hanging=1"),
        ("scalp-5-hanging", "5 cm, wisps, hanging", f"{wisps},length=5,hanging=1"),
        ("strand-tight", "4 turns, radius 1 cm", STRAND),
        ("strand-tight-turned", "4 turns, radius 1 cm, turned", f"{STRAND}:turned=1"),
        (
            "strand-dense",
            "4 turns, radius 1 cm, half the area",
            f"{STRAND}:area=3.077,deviation=0.00015",
        ),
        ("strand-loose", "2 turns, radius 0.5 cm", curved),
        ("strand-loose-turned", "2 turns, radius 0.5 cm, turned", f"{curved},turned=1"),
        ("strand-straight", straight_title, straight),
        ("strand-straight-turned", f"{straight_title}, turned", f"{straight},turned=1"),
    ):
        against = "LayeredAABBTree/super_thread,LayeredAABBTree/capsules"
        words = f"volume-tests {scene} --limit=10 --against=paper:{against}"
        yield measure(f"styles_{name}", words, title=title)


def cascade():
    """Enclosing spheres by Welzl's algorithm, and cascade verification as published."""
    # Balls that move to the front take minutes on millions of segments.
    random = "--benchmark_filter=exact|/welzl/|boxes"
    for name, title, scene in (
        ("static", "static assembly", "--scene=paper-static:frames=0:5"),
        ("dynamic", "dynamic assembly", "--scene=paper-dynamic:frames=0:100"),
        ("strand", "loose strand of 1,000", f"{STRAND}:area=3.077,{LOOSE} {random}"),
        ("half-scalp", "half scalp in wisps", f"{SCALP}:{WISPS} {random}"),
    ):
        yield measure(f"cascade_{name}", f"cascade --runs=3 {scene}", title=title)
    for n in range(50, 1001, 50):
        words = f"cascade --runs=3 --scene=paper-static:fibers={n}"
        yield measure(f"cascade_static_{n}", words)


def paper():
    yield measure("pictures", "pictures --out_dir={data}")
    dynamic = "--scene=paper-dynamic"
    yield measure("replay", f"replay --against=paper_all {dynamic}")
    yield measure("replay_turned", f"replay --against=paper {dynamic}:turned=1")
    loads = "loads=scenes/recorded_loads.txt"
    yield measure("replay_recorded", f"replay --against=paper {dynamic}:{loads}")
    static = "--scene=paper-static"
    for n in (50, 100, 200, 350, 500, 700, 1000):
        words = f"frames --against=paper_all --limit=4 {static}:fibers={n}"
        yield measure(f"static_{n}", words)
    for turned, scene in ((0, "state=1,turned=0"), (1, "state=1")):
        words = f"frames --against=paper --limit=10 {static}:{scene}"
        yield measure(f"axis_turned_{turned}", words)
    yield from table_one()
    yield from styles()
    yield from cascade()


SETS = {
    make.__name__: tuple(make()) for make in (headline, full, trade, python, threads, card, paper)
}


def titles(kind):
    """Of the scenes of the measures `kind_NAME`, by NAME."""
    start = kind + "_"
    return {
        one.name[len(start) :]: one.title
        for measures in SETS.values()
        for one in measures
        if one.name.startswith(start) and one.title
    }


def hair(kind, words):
    """Of a set, with the fibers of a file instead of its scenes."""
    return frames(kind, (("hair", words),), "headline" if kind == "headline" else "bench")
