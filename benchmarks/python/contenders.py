# SPDX-License-Identifier: BSD-3-Clause
"""Who takes part in steps.py: this package, and others of PyPI that find what touches.

peers.sh installs the others; those that are absent are left out. Each contender has prepare(k),
which is not timed and has frame k in its own form; step(), which is timed, moves the fibers there
and asks; and check(), which raises an error if the answer is wrong. Every segment is a capsule.
"""

import contextlib
import importlib
import itertools
import logging
from functools import partial
from pathlib import Path

import numpy as np

import fcl_fibers

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "python"
ALIKE = 1e-4  # share of the radius within which floats decide as they like


class Truth:
    """What touches in a frame, as our exact test has it, and what contenders have to agree on."""

    def __init__(self, scene, k):
        self.scene, self.k, self.agreed = scene, k, {}
        self.pairs = self.keys(self.of(1))

    def of(self, factor, ignored_neighbors=1):
        """The pairs of capsules of so many times the radius."""
        tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=ignored_neighbors)
        tree.build(self.scene.frames[self.k], self.scene.offsets, factor * self.scene.radius)
        return tree.pairs()

    def contacts(self):
        return Ours(self.scene, "contacts").step(self.scene.frames[self.k])

    def keys(self, pairs):
        pairs = np.sort(np.asarray(pairs, np.int64).reshape(-1, 2), axis=1)
        return np.unique(pairs[:, 0] * len(self.scene.frames[0]) + pairs[:, 1])

    def between(self, least, found, most):
        """Keys: all of the least are found, and none that are not among the most."""
        missed, false = len(np.setdiff1d(least, found)), len(np.setdiff1d(found, most))
        if missed or false:
            raise RuntimeError(f"{missed} of {len(least)} are missed, {false} are too many")

    def alike(self, found, **options):
        """The pairs that touch, up to the rounding of floats."""
        bounds = (self.keys(self.of(f, **options)) for f in (1 - ALIKE, 1 + ALIKE))
        least, most = bounds
        self.between(least, self.keys(found), most)

    def agree(self, what, value, within=0.0):
        known = self.agreed.setdefault(what, value).astype(float)
        if np.linalg.norm(value - known) > within * np.linalg.norm(known):
            raise RuntimeError(f"another contender has found other {what}")


class Contender:
    def __init__(self, scene):
        self.scene, self.radius = scene, scene.radius
        starts = np.ones(scene.offsets[-1], bool)
        starts[scene.offsets[1:] - 1] = False
        self.starts = np.flatnonzero(starts)

    def prepare(self, k):
        return self.scene.frames[k]

    def check(self, found, truth):
        """The number of what was found."""
        truth.between(truth.pairs, truth.keys(found), truth.pairs)
        return len(found)


class Ours(Contender):
    def __init__(self, scene, query, threads=1, **options):
        super().__init__(scene)
        known = {"report": "capsules", "ignored_neighbors": 1, "threads": threads}
        self.tree = fcl_fibers.FiberTree(**{**known, **options})
        self.tree.build(scene.frames[0], scene.offsets, scene.radius)
        self.query = getattr(self.tree, query)

    def step(self, points):
        self.tree.update(points)
        return self.query()

    def check(self, found, truth):
        pairs = np.stack([found["a"], found["b"]], axis=1) if found.dtype.names else found
        options = self.tree.options
        every = truth.keys(truth.of(1, options.ignored_neighbors))
        most = every if options.report == "capsules" else truth.keys(pairs)
        truth.between(every, truth.keys(pairs), most)
        return len(found)


class OurSafeStep(Contender):
    """Of fibers without thickness, which touch nothing in the beginning."""

    def __init__(self, scene):
        super().__init__(scene)
        self.tree = fcl_fibers.FiberTree(ignored_neighbors=1)
        self.tree.build(scene.frames[0], scene.offsets, 0.0)

    def prepare(self, k):
        return self.scene.frames[1 - k], self.scene.frames[k]

    def step(self, points):
        self.tree.update(*points)
        return self.tree.safe_step()

    def check(self, found, truth):
        truth.agreed["step"] = found
        return 1


class MidpointTree(Contender):
    """A k-d tree of the segments' midpoints, and a test of those that are near, by Numba."""

    def __init__(self, scene):
        super().__init__(scene)
        from scipy.spatial import cKDTree

        self.tree, self.touching = cKDTree, touching_pairs
        # Without Numba only tests run, whose scenes are small.
        with contextlib.suppress(ModuleNotFoundError):
            self.touching = importlib.import_module("numba").njit(touching_pairs)

    def step(self, points):
        starts = self.starts
        edges = points[starts + 1] - points[starts]
        middles = points[starts] + edges / 2
        longest = np.sqrt(np.max(np.einsum("nc,nc->n", edges, edges)))
        # Neither option makes the query faster, and both make the tree slower to build.
        tree = self.tree(middles, balanced_tree=False, compact_nodes=False)
        near = tree.query_pairs(longest + 2 * self.radius, output_type="ndarray")
        return self.touching(points, starts, near, (2 * self.radius) ** 2)


def touching_pairs(points, starts, near, most_squared):
    """Starts are ascending and query_pairs() has the lower first. Neighbours along a fiber are
    adjacent points, since the last point of a fiber starts no segment. Distances of segments:
    Ericson, Real-Time Collision Detection, section 5.1.9."""
    found, count = np.empty((len(near), 2), np.int64), 0
    for i in range(len(near)):
        p, q = starts[near[i, 0]], starts[near[i, 1]]
        if q - p <= 1:
            continue
        a = b = c = e = f = 0.0
        for k in range(3):
            d1, d2 = points[p + 1, k] - points[p, k], points[q + 1, k] - points[q, k]
            r = points[p, k] - points[q, k]
            a, b, c, e, f = a + d1 * d1, b + d1 * d2, c + d1 * r, e + d2 * d2, f + d2 * r
        area = a * e - b * b
        s = min(max((b * f - c * e) / area, 0.0), 1.0) if area > 1e-12 * a * e else 0.0
        t = min(max((b * s + f) / e, 0.0), 1.0)
        s = min(max((b * t - c) / a, 0.0), 1.0)
        squared = 0.0
        for k in range(3):
            on_p = points[p, k] + s * (points[p + 1, k] - points[p, k])
            on_q = points[q, k] + t * (points[q + 1, k] - points[q, k])
            squared += (on_p - on_q) ** 2
        if squared <= most_squared:
            found[count, 0], found[count, 1] = p, q
            count += 1
    return found[:count]


class WarpBvh(Contender):
    """wp.Bvh on the CPU, refitted, and a kernel of ours that asks it and tests."""

    def __init__(self, scene):
        super().__init__(scene)
        import warp as wp

        wp.config.log_level = wp.LOG_ERROR
        bounds, touching = warp_kernels(wp)
        count = len(self.starts)
        with wp.ScopedDevice("cpu"):
            self.points = wp.array(self.prepare(0), wp.vec3)
            low, high = wp.empty(count, wp.vec3), wp.empty(count, wp.vec3)
            self.found, self.counter = wp.empty((16 * count, 2), int), wp.empty(1, int)
            capsules = [self.points, wp.array(self.starts, int), float(self.radius), low, high]
            self.bounds = partial(wp.launch, bounds, count, capsules, device="cpu")
            self.bounds()
            self.bvh = wp.Bvh(low, high)
        asked = [self.bvh.id, *capsules, self.found, self.counter]
        self.query = partial(wp.launch, touching, count, asked, device="cpu")

    def prepare(self, k):
        return self.scene.frames[k].astype(np.float32)

    def step(self, points):
        self.points.assign(points)
        self.bounds()
        self.bvh.refit()
        self.counter.zero_()
        self.query()
        count = self.counter.numpy()[0]
        if count > len(self.found):
            raise RuntimeError(f"warp: {count} pairs do not fit into {len(self.found)}")
        return self.found.numpy()[:count]

    def check(self, found, truth):
        truth.alike(found)
        return len(found)


def warp_kernels(wp):
    vectors, numbers = wp.array(dtype=wp.vec3), wp.array(dtype=int)

    @wp.kernel
    def bounds(p: vectors, starts: numbers, r: float, low: vectors, high: vectors):
        i = wp.tid()
        a, b, around = p[starts[i]], p[starts[i] + 1], wp.vec3(r, r, r)
        low[i] = wp.min(a, b) - around
        high[i] = wp.max(a, b) + around

    @wp.kernel
    def touching(
        bvh: wp.uint64,
        p: vectors,
        starts: numbers,
        r: float,
        low: vectors,
        high: vectors,
        found: wp.array2d(dtype=int),
        counter: numbers,
    ):
        i = wp.tid()
        a, j = starts[i], int(0)
        query = wp.bvh_query_aabb(bvh, low[i], high[i])
        while wp.bvh_query_next(query, j):
            b = starts[j]
            if b > a + 1:
                near = wp.closest_point_edge_edge(p[a], p[a + 1], p[b], p[b + 1], 1.0e-12)
                if near[2] <= 2.0 * r:
                    at = wp.atomic_add(counter, 0, 1)
                    if at < found.shape[0]:
                        found[at, 0] = a
                        found[at, 1] = b

    return bounds, touching


def turned(points, starts):
    """Middles, quaternions (x, y, z, w) and lengths of capsules along the z axis."""
    edges = points[starts + 1] - points[starts]
    lengths = np.linalg.norm(edges, axis=1)
    x, y, z = (edges / lengths[:, np.newaxis]).T
    turns = np.stack([-y, np.where(z > -1, x, 1), 0 * x, 1 + z], axis=1)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return (points[starts] + points[starts + 1]) / 2, turns, lengths


class Newton(Contender):
    """A body for each segment, and collide() on the CPU. Adjacent segments are filtered."""

    def __init__(self, scene, broad_phase):
        super().__init__(scene)
        import newton
        import warp as wp

        wp.config.log_level = wp.LOG_ERROR
        builder, adjacent = newton.ModelBuilder(), np.diff(self.starts) == 1
        shape = newton.ModelBuilder.ShapeConfig(gap=0.0)
        for middle, turn, length in zip(*turned(scene.frames[0], self.starts)):
            body = builder.add_body(xform=wp.transform(middle, turn))
            half = float(length / 2)
            builder.add_shape_capsule(body, radius=self.radius, half_height=half, cfg=shape)
        for i in np.flatnonzero(adjacent).tolist():
            builder.add_shape_collision_filter_pair(i, i + 1)
        model = builder.finalize(device="cpu")
        self.state = model.state()
        self.pipeline = newton.CollisionPipeline(model, broad_phase=broad_phase)
        self.contacts = self.pipeline.contacts()

    def prepare(self, k):
        middles, turns, _ = turned(self.scene.frames[k], self.starts)
        return np.concatenate([middles, turns], axis=1).astype(np.float32)

    def step(self, poses):
        self.state.body_q.assign(poses)
        self.pipeline.collide(self.state, self.contacts)
        count = self.contacts.rigid_contact_count.numpy()[0]
        both = self.contacts.rigid_contact_shape0, self.contacts.rigid_contact_shape1
        return np.stack([shapes.numpy()[:count] for shapes in both], axis=1)

    def check(self, found, truth):
        truth.alike(self.starts[found])
        return len(found)


class PythonFcl(Contender):
    """An object for each segment in its dynamic tree, and the default callback."""

    def __init__(self, scene):
        super().__init__(scene)
        import fcl

        self.fcl = fcl
        lengths = turned(scene.frames[0], self.starts)[2]
        self.shapes = [fcl.Capsule(self.radius, length) for length in lengths]
        self.objects = [fcl.CollisionObject(*both) for both in zip(self.shapes, self.prepare(0))]
        self.manager = fcl.DynamicAABBTreeCollisionManager()
        self.manager.registerObjects(self.objects)
        self.manager.setup()
        self.request = fcl.CollisionRequest(num_max_contacts=10**9, enable_contact=True)

    def prepare(self, k):
        middles, turns, _ = turned(self.scene.frames[k], self.starts)
        return list(map(self.fcl.Transform, turns[:, [3, 0, 1, 2]], middles))

    def step(self, poses):
        for thing, pose in zip(self.objects, poses):
            thing.setTransform(pose)
        self.manager.update()
        data = self.fcl.CollisionData(request=self.request)
        self.manager.collide(data, self.fcl.defaultCollisionCallback)
        return data.result.contacts

    def check(self, found, truth):
        number = {id(shape): start for shape, start in zip(self.shapes, self.starts)}
        pairs = [(number[id(contact.o1)], number[id(contact.o2)]) for contact in found]
        truth.alike(pairs, ignored_neighbors=0)
        return len(found)


class IpcToolkit(Contender):
    """Its LBVH, built for each frame; the answers stay in C++."""

    def __init__(self, scene):
        super().__init__(scene)
        import ipctk

        ipctk.set_num_threads(1)
        self.ipctk = ipctk
        edges = np.stack([self.starts, self.starts + 1], axis=1).astype(np.int32, order="F")
        points = np.asfortranarray(scene.frames[0])
        self.mesh = ipctk.CollisionMesh(points, edges, np.zeros((0, 3), np.int32, order="F"))

    def prepare(self, k):
        return np.asfortranarray(self.scene.frames[k])


class IpcCandidates(IpcToolkit):
    def step(self, points):
        found = self.ipctk.Candidates()
        found.build(self.mesh, points, self.radius, self.ipctk.LBVH())
        return found

    def check(self, found, truth):
        edges = [(pair.edge0_id, pair.edge1_id) for pair in found.ee_candidates]
        keys = truth.keys(self.starts[edges])
        truth.between(truth.pairs, keys, keys)
        return len(found)


class IpcContacts(IpcToolkit):
    """Of edges and vertices, so that contacts of two segments at their common end are one."""

    def step(self, points):
        found = self.ipctk.NormalCollisions()
        found.build(self.mesh, points, 2 * self.radius, 0.0, self.ipctk.LBVH())
        return found

    def check(self, found, truth):
        edges = self.starts.tolist()
        both = {(edges[c.edge0_id], edges[c.edge1_id]) for c in found.ee_collisions}
        ends = {((edges[c.edge_id], 0.5), c.vertex_id) for c in found.ev_collisions}
        ends |= {(c.vertex0_id, c.vertex1_id) for c in found.vv_collisions}
        known = set(map(frozenset, both | ends))
        contacts, missed = truth.contacts(), 0
        for a, b, s, t in zip(*(contacts[name].tolist() for name in "abst")):
            # Of nearly parallel segments it takes both as wholes.
            at = frozenset((i, 0.5) if 0 < x < 1 else i + round(x) for i, x in ((a, s), (b, t)))
            missed += at not in known and frozenset((a, b)) not in known
        if missed:
            raise RuntimeError(f"{missed} of {len(contacts)} are missed")
        truth.between(truth.keys([]), truth.keys(list(both)), truth.pairs)
        return len(found)


class IpcSafeStep(IpcToolkit):
    """Of fibers without thickness."""

    def prepare(self, k):
        return super().prepare(1 - k), super().prepare(k)

    def step(self, points):
        tree, ccd = self.ipctk.LBVH(), self.ipctk.AdditiveCCD()
        return self.ipctk.compute_collision_free_stepsize(self.mesh, *points, 0.0, tree, ccd)

    def check(self, found, truth):
        share = found / truth.agreed["step"]
        if not 0.5 < share < 1 + 1e-9:
            raise RuntimeError(f"the safe step is {share} of ours")
        return 1


def shown(example, section, **names):
    """The part of an example that the documents show."""
    text = (EXAMPLES / f"{example}.py").read_text(encoding="utf-8")
    exec(text.split(f"# [{section}]\n")[1], names)
    return names


class PyElastica(Contender):
    """RodRodContact for each two rods, or the tree in its place, in the same rods."""

    def __init__(self, scene, with_tree=False):
        super().__init__(scene)
        import elastica

        class Rods(elastica.BaseSystemCollection):
            pass

        simulation, self.rods = Rods(), []
        for begin, end in itertools.pairwise(scene.offsets):
            start, axes = scene.frames[0][begin], np.eye(3)
            rod = elastica.CosseratRod.straight_rod(
                int(end - begin - 1),
                start,
                axes[0],
                axes[1],
                1.0,
                self.radius,
                1.0,
                youngs_modulus=1.0,
            )
            simulation.append(rod)
            self.rods.append(rod)
        simulation.finalize()
        contact = elastica.RodRodContact(k=1.0, nu=0.0)
        self.calls = [(contact, *two) for two in itertools.combinations(self.rods, 2)]
        if with_tree:
            import numba

            known = {"elastica": elastica, "numba": numba, "np": np, "fcl_fibers": fcl_fibers}
            tree = shown("pyelastica_contact", "forces", **known)["FiberContact"]
            self.calls = [(tree(self.rods, k=1.0, nu=0.0), None, None)]

    def prepare(self, k):
        """Of each rod what the last step of a simulation has left."""
        prepared = []
        for begin, end in itertools.pairwise(self.scene.offsets):
            points = self.scene.frames[k][begin:end].T.copy()
            edges = np.diff(points)
            lengths = np.linalg.norm(edges, axis=0)
            prepared.append((points, lengths, edges / lengths))
        return prepared

    def step(self, prepared):
        for rod, (points, lengths, tangents) in zip(self.rods, prepared):
            rod.position_collection[:] = points
            rod.lengths[:], rod.tangents[:], rod.external_forces[:] = lengths, tangents, 0
        for contact, one, two in self.calls:
            contact.apply_contact(one, two)
        return self.rods

    def check(self, rods, truth):
        forces = np.concatenate([rod.external_forces.T for rod in rods])
        # Its distance of nearly parallel elements is a little too large, and each contact sees the
        # forces of those before it.
        truth.agree("forces", forces, within=1e-3)
        return np.count_nonzero(forces.any(axis=1))


class Scilpy(Contender):
    """IntersectionFinder, or the tree in its place."""

    def __init__(self, scene, with_tree=False):
        super().__init__(scene)
        from nibabel import Nifti1Image
        from scilpy.tractograms.intersection_finder import IntersectionFinder

        logging.getLogger().setLevel(logging.ERROR)  # of segments above 0.3 mm
        self.image, self.finder = Nifti1Image(np.zeros((9, 9, 9)), np.eye(4)), IntersectionFinder
        if with_tree:
            known = {"IntersectionFinder": IntersectionFinder, "np": np, "fcl_fibers": fcl_fibers}
            self.finder = shown("scilpy_finder", "finder", **known)["TreeIntersectionFinder"]

    def prepare(self, k):
        from dipy.io.stateful_tractogram import Space, StatefulTractogram

        lines = np.split(self.scene.frames[k].astype(np.float32), self.scene.offsets[1:-1])
        return StatefulTractogram(lines, self.image, Space.RASMM)

    def step(self, tracts):
        found = self.finder(tracts, np.full(len(tracts), 2 * self.radius))
        found.find_intersections()
        return found.invalid

    def check(self, found, truth):
        truth.agree("streamlines", found)
        return np.count_nonzero(found)


OURS = {
    "pairs, 1 thread": partial(Ours, query="pairs"),
    "pairs, 2 threads": partial(Ours, query="pairs", threads=2),
    "contacts, 1 thread": partial(Ours, query="contacts"),
    "contacts, 2 threads": partial(Ours, query="contacts", threads=2),
    "boxes, 1 thread": partial(Ours, query="pairs", report="volumes"),
    "adjacent too, 1 thread": partial(Ours, query="contacts", ignored_neighbors=0),
    "safe step, 1 thread": OurSafeStep,
}
# With the package of PyPI, and beyond how many segments a step would take more than 10 s, by its
# times of fewer.
PEERS = {
    "midpoint tree": (MidpointTree, "SciPy", None),
    "warp": (WarpBvh, "warp-lang", None),
    "newton, SAP": (partial(Newton, broad_phase="sap"), "newton", 20_000),
    "newton, NxN": (partial(Newton, broad_phase="nxn"), "newton", 15_000),
    "python-fcl": (PythonFcl, "python-fcl", None),
    "ipc-toolkit, candidates": (IpcCandidates, "ipctk", None),
    "ipc-toolkit, contacts": (IpcContacts, "ipctk", None),
    "ipc-toolkit, safe step": (IpcSafeStep, "ipctk", None),
    "PyElastica": (PyElastica, "PyElastica", 20_000),
    "PyElastica with our tree": (partial(PyElastica, with_tree=True), "PyElastica", 20_000),
    "scilpy": (Scilpy, "scilpy", None),
    "scilpy with our tree": (partial(Scilpy, with_tree=True), "scilpy", None),
}
