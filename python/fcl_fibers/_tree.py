# SPDX-License-Identifier: BSD-3-Clause
"""The tree over fibers, and meshes that fibers may touch."""

from __future__ import annotations

from typing import Any, Callable, Dict, Literal, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _arrays, _contacts, _core
from ._arrays import ArrayLike, Points
from ._contacts import Nodes
from ._files import Fibers
from ._shapes import Shape

# Why some calls take no shape.
NO_POINTS = "a shape has no points that could carry a force, so leave it out"
NO_DISTANCE = "contacts() has the distances of a shape, up to the margin of the tree"


class Options(NamedTuple):
    """The options of a `FiberTree`; its constructor describes them."""

    report: str
    topology: str
    volumes: str
    ignored_neighbors: int
    ignored_arc_length: float
    margin: float
    threads: int


class Volumes(NamedTuple):
    """Boxes or spheres of one level of a tree, which contain the capsules below them.

    center    (n, 3) float64
    half      (n, 3) float64: half the edges of a box; a sphere's radius, three times
    offsets   (n + 1,) int64: volume v has segments[offsets[v]:offsets[v + 1]] below it
    segments  (m,) int32, named as in pairs()
    """

    center: np.ndarray
    half: np.ndarray
    offsets: np.ndarray
    segments: np.ndarray


class TriangleMesh:
    """A triangle mesh that fibers may touch, such as a head or a part of a machine.

    points         (n, 3) float32 or float64, in the mesh's own frame
    triangles      (m, 3) whole numbers: indices of the corners. Seen from outside, they are
                   counterclockwise.
    solid          if True, a capsule wholly inside touches the mesh too. Such a mesh has to be
                   watertight.

    A ValueError names the point or triangle that is wrong. Meshes can be copied and pickled.
    """

    def __init__(self, points: ArrayLike, triangles: ArrayLike, solid: bool = False) -> None:
        array = _arrays.rows("points", _arrays.numbers("points", points))
        self._triangles = _arrays.corners(triangles)
        self._mesh = _core.Mesh(array, self._triangles, bool(solid))
        self._points = array.copy()

    def update(self, points: ArrayLike) -> None:
        """Reads the points again after they have moved. Copies keep theirs."""
        array = _arrays.rows("points", _arrays.numbers("points", points))
        self._mesh.update(array, self._triangles)
        self._points = array.copy()

    def set_pose(self, rotation: ArrayLike, position: ArrayLike) -> None:
        """Places the mesh: a point p of it is at rotation @ p + position in the fibers' frame.

        rotation       (3, 3), orthonormal and no reflection
        position       (3,)
        """
        self._mesh.set_pose(
            _arrays.vector("the rotation", rotation, (3, 3)),
            _arrays.vector("the position", position),
        )

    @property
    def pose(self) -> Tuple[np.ndarray, np.ndarray]:
        """The rotation (3, 3) and the position (3,) that were set last."""
        rotation, position = self._mesh.pose()
        return np.array(rotation).reshape(3, 3), np.array(position)

    @property
    def categories(self) -> int:
        """32 bits, all set at first. A fiber and the mesh meet if each has a category that the
        other one meets.
        """
        return self._mesh.categories

    @categories.setter
    def categories(self, bits: int) -> None:
        self._mesh.categories = _arrays.integer("categories", bits, np.uint32)

    @property
    def meets(self) -> int:
        """32 bits, all set at first: the categories of fibers that the mesh meets."""
        return self._mesh.meets

    @meets.setter
    def meets(self, bits: int) -> None:
        self._mesh.meets = _arrays.integer("meets", bits, np.uint32)

    @property
    def solid(self) -> bool:
        """Whether a capsule wholly inside touches the mesh."""
        return self._mesh.solid

    def copy(self) -> TriangleMesh:
        """A mesh of its own pose, which shares the triangles until one of both is updated."""
        mesh = TriangleMesh.__new__(TriangleMesh)
        mesh._points, mesh._triangles, mesh._mesh = self._points, self._triangles, self._mesh.copy()
        return mesh

    __copy__ = copy

    def __deepcopy__(self, memo: Any) -> TriangleMesh:
        return self.copy()

    def __getstate__(self) -> tuple:
        return self._points, self._triangles, self.solid, *self.pose, self.categories, self.meets

    def __setstate__(self, state: tuple) -> None:
        points, triangles, solid, rotation, position, categories, meets = state
        TriangleMesh.__init__(self, points, triangles, solid)
        self.set_pose(rotation, position)
        self.categories, self.meets = categories, meets

    def placed(self) -> Tuple[np.ndarray, np.ndarray]:
        """The points in the fibers' frame, (n, 3) float64, and the triangles, (m, 3) int32."""
        rotation, position = self.pose
        return self._points @ rotation.T + position, self._triangles.copy()

    @property
    def point_count(self) -> int:
        """The number of points, also of those at no triangle."""
        return self._mesh.point_count

    @property
    def triangle_count(self) -> int:
        """The number of triangles."""
        return self._mesh.triangle_count

    @property
    def memory_usage(self) -> int:
        """Bytes of triangles and tree, which copies share."""
        return self._mesh.memory_usage

    def __repr__(self) -> str:
        kind = "solid" if self.solid else "surface"
        return f"<TriangleMesh: {kind}, {self.triangle_count} triangles>"


class FiberTree:
    """Finds the pairs of segments that touch, in fibers that are NumPy arrays.

    report              "volumes": pairs whose boxes or spheres overlap, as a broad phase reports
                        them. "capsules": pairs that touch, which is what most programs want.
    topology            "bundle", or "super_thread", the paper's tree
    volumes             "boxes", or "spheres", those of the paper
    ignored_neighbors   leave out two segments of one fiber whose numbers differ by at most this. 1
                        leaves out adjacent segments, which always touch.
    ignored_arc_length  leave out two segments of one fiber with at most this length between them
    margin              segments at most this far apart count as touching
    threads             that share the work of a build, an update and a query

    Lengths are in the unit of the points. Names and defaults are those of C++'s FiberTree.

    A segment is named by the index of the point at which it starts. Queries may run in several
    threads at once and let other threads run. Ctrl-C ends those that list pairs, contacts or
    impacts among the next 64 pairs that they find. A build or update beside another call of the
    same tree raises RuntimeError. Wrong arrays raise ValueError or TypeError and leave the tree as
    it was.

    The tree keeps the arrays of the last build or update, and contacts() reads them again. It makes
    no copy of aligned arrays of float32 or float64, whatever their strides are, such as the
    transpose of (3, n). Do not change these in place before the next update.
    """

    def __init__(
        self,
        *,
        report: Literal["volumes", "capsules"] = "capsules",
        topology: Literal["bundle", "super_thread"] = "bundle",
        volumes: Literal["boxes", "spheres"] = "boxes",
        ignored_neighbors: int = 1,
        ignored_arc_length: float = 0.0,
        margin: float = 0.0,
        threads: int = 1,
    ) -> None:
        self._options = Options(
            report,
            topology,
            volumes,
            _arrays.integer("ignored_neighbors", ignored_neighbors),
            _arrays.number("ignored_arc_length", ignored_arc_length),
            _arrays.number("margin", margin),
            _arrays.integer("threads", threads),
        )
        self._made: Dict[str, np.ndarray] = {}
        self._tree = _core.Tree(
            _choice("report", report, "capsules", "volumes"),
            _choice("topology", topology, "bundle", "super_thread"),
            _choice("volumes", volumes, "boxes", "spheres"),
            *self._options[3:],
        )

    def build(
        self,
        points: Union[Points, Fibers],
        offsets: Optional[ArrayLike] = None,
        radii: Optional[Points] = None,
        closed: Optional[ArrayLike] = None,
        groups: Optional[ArrayLike] = None,
        meets: Optional[ArrayLike] = None,
        root_segments: Optional[ArrayLike] = None,
        categories: Optional[ArrayLike] = None,
        *,
        radius: Optional[float] = None,
        starts_at: Optional[ArrayLike] = None,
        ends_at: Optional[ArrayLike] = None,
    ) -> None:
        """Replaces all fibers and builds the tree.

        points         (n, 3), fiber after fiber. Without offsets: a list of arrays (n, 3), one for
                       each fiber, or an array (fibers, n, 3).
        offsets        (fibers + 1,) whole numbers: fiber f has points offsets[f] to offsets[f + 1].
                       Or (fibers, 2), the begin and the end of each fiber; points between fibers,
                       such as ghost nodes, are then of no fiber and may be NaN.
        radii          a number, or one for each fiber, for each segment, or for each first point of
                       a segment; the last is an array of all points, of which those that start no
                       segment are not read. Of rounded cones they are PointRadii.
        closed         (fibers,) bool: the last point of a closed fiber repeats its first
        groups         (fibers,) whole numbers: fibers of one group do not meet; 0 is no group
        meets          (fibers,) 32 bits each: the categories of meshes that the fiber may meet
        root_segments  (fibers,) whole numbers: so many segments at the start meet no mesh
        categories     (fibers,) 32 bits each: see TriangleMesh.categories
        radius         a number in the place of radii
        starts_at      (fibers,) whole numbers: the point of a fiber, mostly of another one, that
                       the first point of each repeats, or -1 for none. So fibers form trees, and
                       neighbours count along them: segments that share a point are adjacent.
        ends_at        (fibers,) whole numbers: the same of the last point; so vessels form loops
        """
        if isinstance(points, Fibers):
            if any(given is not None for given in (offsets, radii, closed, starts_at, ends_at)):
                raise TypeError(
                    "fibers of a file are given with arrays of their own; leave them out"
                )
            starts_at, ends_at = points.starts_at, points.ends_at
            groups = points.groups if groups is None else groups
            points, offsets, of_file, closed = points
            radii = of_file if radius is None else None
        array, begin = _arrays.points_and_offsets(points, offsets)
        values, kind = _arrays.radii_of(_arrays.one_of(radius, radii), array, begin)
        layout = _arrays.layout_of(
            array,
            begin,
            closed,
            groups,
            meets,
            root_segments,
            categories,
            starts_at,
            ends_at,
        )
        self._tree.build(_core.Numbers(array, values, kind), layout)
        self._made = {}

    def update(
        self,
        points: Points,
        end: Optional[Points] = None,
        radii: Optional[Points] = None,
        end_radii: Optional[Points] = None,
        *,
        radius: Optional[float] = None,
    ) -> None:
        """Reads the points again after they have moved. Each fiber has as many as before.

        With `end`, the update is a step: each point moves straight from its place in `points`, at
        time 0, to its place in `end`, at time 1. impacts(), moving_pairs() and safe_step() ask
        about the step, and all other calls about its end.

        points, end       (n, 3) of all fibers, or as in build() without offsets
        radii, radius     as in build(). Without them the radii stay as the tree has them, which is
                          rounded up if the points have been float32.
        end_radii         those of `end`, if they differ

        Fibers start and end at the points where they did at the last build(). The points that are
        one have to stay together, at both ends of a step.
        """
        radii = _arrays.one_of(radius, radii)
        start = self._numbers(points, radii, "points")
        if end is None:
            if end_radii is not None:
                raise TypeError("end_radii are given without end")
            self._tree.update(start)
        else:
            _arrays.refuse_radii("end", end)
            if end_radii is not None:
                radii = end_radii
            self._tree.update(start, self._numbers(end, radii, "end"))

    def _numbers(self, points: Any, radii: Optional[Points], name: str) -> _core.Numbers:
        kept = self._tree.numbers
        is_flat = isinstance(points, (list, tuple)) and len(points) > 0 and np.ndim(points[0]) == 1
        if is_flat or (_arrays.is_array(points) and np.ndim(points) == 2):
            array = _arrays.rows(name, _arrays.numbers(name, points, keeps_strides=True))
        else:
            array, begin = _arrays.points_and_offsets(points, None, name)
            if not np.array_equal(begin, self.offsets):
                raise ValueError(
                    f"{name} are of fibers with other numbers of points than at the last build()"
                )
        if len(array) != len(kept.points):
            raise ValueError(
                f"{name} are {len(array)}, but the last build() had {len(kept.points)}"
            )
        if radii is None:
            return _core.Numbers(array, _arrays.in_type_of(array, kept.radii), kept.radii_are)
        values, kind = _arrays.radii_of(radii, array, self.offsets)
        return _core.Numbers(array, values, kind)

    def pairs(
        self,
        other: Union[FiberTree, TriangleMesh, Shape, None] = None,
        order: Literal["found", "segments", "fibers"] = "found",
        *,
        limit: Optional[int] = None,
    ) -> np.ndarray:
        """All pairs, (n, 2) int32, each once.

        Without `other`, pairs of two segments a < b. With another tree, a segment of this tree and
        one of the other. With a mesh, a segment and a triangle. With a shape, its segments alone:
        (n,) int32. Roots and `meets` do not matter to a shape.

        order   "found": as the search comes to them. "segments": ascending by the first segment,
                then by the second one or the triangle. "fibers": ascending by the fiber of the
                first segment, by that of the second, and then by segments.
        limit   more pairs raise ValueError, before a radius far too large fills the memory; by
                default 1 GiB of them, or 256 for each segment if these are more
        """
        number = _contacts.order_number(order)
        return self._tree.pairs(_core_of(other), number, _limit(limit))

    def visit_pairs(
        self,
        visit: Callable[[np.ndarray], Any],
        other: Optional[FiberTree] = None,
        block: int = 65536,
    ) -> bool:
        """Calls visit(pairs) again and again, for more pairs than fit into memory.

        pairs   (n, 2) int32, at most `block` of those of pairs(), in the order "found"
        other   another tree; a mesh or a shape raises TypeError

        A true value that `visit` returns ends the query; an exception ends it and is passed on.
        Returns whether the query was ended.
        """
        if not callable(visit):
            raise TypeError(f"visit is {visit!r}; give a function")
        if _arrays.integer("block", block, np.int64) < 1:
            raise ValueError(f"block is {block}; give at least 1")
        return self._tree.visit_pairs(visit, _tree_of(other, "pairs()"), block)

    def contacts(
        self,
        other: Union[FiberTree, TriangleMesh, Shape, None] = None,
        order: Literal["found", "segments", "fibers"] = "found",
        bare: bool = False,
        *,
        limit: Optional[int] = None,
    ) -> np.ndarray:
        """The contacts of all pairs, in the order of pairs(), as a structured array.

        a, b        the segments, named as in pairs()
        fiber_a, number_a, fiber_b, number_b   their fibers, and their numbers along these, from 0
        layout      tells of which offsets the segments are
        s, t        place of the closest points along the two axes, from 0 to 1
        distance    from surface to surface: negative if they overlap, and then minus the depth
        point_a, point_b   (3,) closest points, on the surfaces
        normal      (3,) unit vector from a to b

        Contacts with a mesh have `segment`, named as in pairs(), `fiber`, `number`, `triangle`,
        `weights` (3,) and `solid` in place of both segments and t; `normal` points from the fiber
        to the mesh. Those with a shape have `segment`, `fiber` and `number` too. C++'s contact.h
        tells more.

        order, limit   as in pairs()
        bare    leaves out fibers, numbers and points, in less than half of the memory; contacts
                with a mesh or a shape have all fields
        """
        number = _contacts.order_number(order)
        return self._tree.contacts(_core_of(other), number, _limit(limit), bool(bare))

    def nodes(
        self, contacts: np.ndarray, other: Union[FiberTree, TriangleMesh, None] = None
    ) -> Union[Nodes, Tuple[Nodes, Nodes]]:
        """The points that carry contacts, and with which weights, as (points, weights).

        contacts   those of contacts() or impact_contacts(), or some of them
        other      the tree or mesh that they are with, if there is one; a shape has no points

        Without `other`, both are (n, 4): the two points of a, then the two of b; of contacts with a
        mesh or a shape (n, 2), those of the fiber. With `other`, two are returned: (n, 2) of this
        tree, and (n, 2) of the other tree or (n, 3) of the mesh. The weights of each side
        sum up to 1. Contacts of other offsets or of another partner raise ValueError.
        """
        array = _contacts.contacts_of(contacts)
        names = _contacts.names_of(array)
        core, points = _core_of(other, NO_POINTS), len(self.points)
        if "segment" not in names:
            if isinstance(other, TriangleMesh):
                raise TypeError("the contacts are of two segments; leave the mesh out")
            others = points if other is None else len(other.points)
            _contacts.require_found(array, self._tree.layout(core), a=points - 1, b=others - 1)
            a, b = _contacts.side_of(array, "a", "s"), _contacts.side_of(array, "b", "t")
            return Nodes(*map(np.hstack, zip(a, b))) if other is None else (a, b)
        if isinstance(other, FiberTree):
            raise TypeError("the contacts are with a mesh or a shape; give the mesh, or nothing")
        _contacts.require_found(array, self._tree.layout(None), segment=points - 1)
        fiber = _contacts.side_of(array, "segment", "s")
        if other is None:
            return fiber
        if "triangle" not in names:
            raise TypeError("the contacts are with a shape; leave the mesh out")
        _contacts.require_found(array, self._tree.layout(None), triangle=other.triangle_count)
        return fiber, Nodes(other._triangles[array["triangle"]], array["weights"].copy())

    def accumulate(
        self,
        contacts: np.ndarray,
        forces: ArrayLike,
        out: Optional[np.ndarray] = None,
        other: Union[FiberTree, TriangleMesh, None] = None,
        other_out: Optional[np.ndarray] = None,
    ) -> np.ndarray:
        """Adds forces at contacts onto the points that carry them, and returns the sums.

        contacts   those of contacts() or impact_contacts(), or some of them
        forces     (n,) along the normals, where positive numbers push apart, or (n, 3). A force
                   acts on b, the mesh or the shape, and the opposite one acts on a.
        out        (points, 3) float32 or float64 to add to; zeros, float64, if there is none
        other      the tree or mesh that the contacts are with, if there is one; a shape has no
                   points
        other_out  such an array for its points; without it, what acts on these is left out

        `out` and `other_out` share no memory with each other, the contacts or the forces.
        Each force is shared by the weights of nodes(). The sums are those of a loop over the
        contacts, bit for bit, with any number of threads. Forces that are NaN or infinite, and
        contacts of other offsets, raise ValueError before anything is added.
        """
        array = _contacts.contacts_of(contacts)
        if out is None:
            out = np.zeros((len(self._tree.numbers.points), 3))
        if other is None and other_out is not None:
            raise TypeError("other_out is given without other")
        sums = _contacts.sums_of("out", out)
        other_sums = None if other_out is None else _contacts.sums_of("other_out", other_out)
        values = _contacts.forces_of(forces)
        _contacts.refuse_shared(contacts=array, out=sums, other_out=other_sums)
        _contacts.refuse_shared(forces=values, out=sums, other_out=other_sums)
        core = _core_of(other, NO_POINTS)
        self._tree.accumulate(array, values, core, sums, other_sums)
        return out

    def impacts(
        self,
        other: Union[FiberTree, TriangleMesh, Shape, None] = None,
        mesh_end: Optional[TriangleMesh] = None,
        *,
        limit: Optional[int] = None,
    ) -> np.ndarray:
        """The pairs that touch during the step, as a structured array: a, b, time, s, t.

        With a mesh, which moves from `other` to `mesh_end`: segment, triangle, time. `mesh_end` is
        a copy of the mesh that was moved; without it, the mesh rests. With a shape, which rests:
        segment, time. `limit` is as in pairs().
        """
        return self._tree.impacts(*self._others(other, mesh_end, _limit(limit)))

    def impact_contacts(
        self,
        impacts: np.ndarray,
        other: Union[FiberTree, TriangleMesh, Shape, None] = None,
        mesh_end: Optional[TriangleMesh] = None,
    ) -> np.ndarray:
        """The contacts of impacts at their times, as contacts(); `other` as in impacts()."""
        return self._tree.impact_contacts(
            np.ascontiguousarray(impacts), *self._others(other, mesh_end)
        )

    def moving_pairs(
        self, other: Optional[FiberTree] = None, *, limit: Optional[int] = None
    ) -> np.ndarray:
        """The pairs that may touch during the step, (n, 2) int32, for a test of your own.

        `limit` is as in pairs().
        """
        return self._tree.moving_pairs(_tree_of(other, "impacts()"), _limit(limit))

    def safe_step(
        self,
        other: Union[FiberTree, TriangleMesh, Shape, None] = None,
        mesh_end: Optional[TriangleMesh] = None,
    ) -> float:
        """A time in [0, 1] up to which no pair starts to touch; `other` as in impacts().

        It is close to 0, such as 1e-9, if a pair touches at the start and comes nearer at first.
        The least time above 0 of impacts() leaves such pairs out.
        """
        return self._tree.safe_step(*self._others(other, mesh_end))

    def touching_segments(self, mesh: TriangleMesh) -> np.ndarray:
        """The segments that touch the mesh, int32, each once."""
        return self._tree.touching_segments(_mesh_of("mesh", mesh))

    def closest(self, other: Union[FiberTree, TriangleMesh, None] = None) -> np.void:
        """The contact of the least distance, one row of what contacts() returns.

        Without `other`, of this tree, whose neighbours and groups are left out. If something
        touches, it is the deepest contact. A segment in a solid mesh counts by its shortest way
        out: of its contacts that have `solid` set, that of least depth. If the solid is not
        convex, this way need not free it. The margin does not count. If there is no pair, the
        distance is infinite and the segments are -1. A tree with report="volumes" raises
        ValueError.
        """
        return self._tree.closest(_core_of(other, NO_DISTANCE))[0]

    def distance(self, other: Union[FiberTree, TriangleMesh, None] = None) -> float:
        """The least distance of surfaces, that of closest(): negative if they overlap."""
        return float(self.closest(other)["distance"])

    def nearest(
        self, other: Union[FiberTree, TriangleMesh, None] = None, distance: float = np.inf
    ) -> np.ndarray:
        """Each segment at most `distance` from the other, and its nearest there: (n, 2) int32.

        The nearest of another tree is a segment, that of a mesh a triangle. Without `other`, it is
        another segment of this tree that is no neighbour. Distances are from surface to surface;
        the margin does not count.
        """
        return self._tree.nearest(
            _core_of(other, NO_DISTANCE), _arrays.number("distance", distance)
        )

    def nearest_to(self, points: ArrayLike, distance: float = np.inf) -> np.ndarray:
        """Each of the points (m, 3) at most `distance` from a segment, and its nearest segment.

        Returns (n, 2) int32: indices of points, ascending, and segments.
        """
        return self._of_points(points, lambda cloud: cloud.nearest(self, distance))

    def holding(self, points: ArrayLike, *, limit: Optional[int] = None) -> np.ndarray:
        """The points (m, 3) that segments hold, within the margin, with each of these segments.

        Returns (n, 2) int32: indices of points, ascending, and segments. `limit` is as in pairs().
        """
        return self._of_points(points, lambda cloud: cloud.pairs(self, limit=limit))

    def _of_points(self, points: ArrayLike, ask: Callable[[FiberTree], np.ndarray]) -> np.ndarray:
        array = _arrays.rows("points", _arrays.numbers("points", points))
        wrong = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(wrong) > 0:
            raise ValueError(f"point {wrong[0]} is NaN or infinite; give it finite coordinates")
        options = self._options._replace(report="capsules", ignored_arc_length=0.0)
        cloud = FiberTree(**options._asdict())
        # A point is a fiber of one segment without length.
        cloud.build(np.repeat(array, 2, axis=0), np.arange(0, 2 * len(array) + 1, 2), 0.0)
        found = ask(cloud)
        found[:, 0] //= 2
        return found[np.lexsort(found.T[::-1])]

    def fiber_segment(self, segments: ArrayLike) -> np.ndarray:
        """Fiber and number along it of segments of pairs(): an array of shape (..., 2), int64."""
        names = _names_of(segments)
        return self._tree.fiber_segments(names.reshape(-1)).reshape(names.shape + (2,))

    def running_number(self, segments: ArrayLike) -> np.ndarray:
        """The running numbers of segments of pairs(), which have no gaps: int64, of their shape.

        They are those along the fibers, fiber after fiber, so they suit arrays with an element for
        each segment. tree.segments[numbers] has the segments again.
        """
        names = _names_of(segments)
        self._tree.fiber_segments(names.reshape(-1))  # refuses what is no segment
        return np.searchsorted(self.segments, names)

    @property
    def segments(self) -> np.ndarray:
        """All segments, named as in pairs(), in ascending order: (segments,) int32, read-only."""
        return self._kept("segments", self._tree.segments)

    @property
    def points(self) -> np.ndarray:
        """The points of the last build or update, (n, 3), as a read-only view; of a step its end.

        It is the array that was passed, or the copy that the tree had to make of it.
        """
        return _read_only(self._tree.numbers.points)

    @property
    def radii(self) -> np.ndarray:
        """The radii of the last build or update, in the type of the points, as a read-only view.

        (1,) for all, (fibers,), or (n,) for the segments that start at the points, or PointRadii.
        """
        kept = self._tree.numbers
        at_points = kept.radii_are == _arrays.PER_POINT
        return _read_only(kept.radii.view(_arrays.PointRadii) if at_points else kept.radii)

    @property
    def offsets(self) -> np.ndarray:
        """Where each fiber begins in points: (fibers + 1,) int64, read-only."""
        return self._kept("offsets", lambda: self._tree.offsets)

    def _kept(self, name: str, make: Callable[[], np.ndarray]) -> np.ndarray:
        """What stays the same until the next build, and is made when it is first asked for."""
        if name not in self._made:
            self._made[name] = _read_only(make())
        return self._made[name]

    def __len__(self) -> int:
        """The number of fibers: that of segments is segment_count."""
        return self.fiber_count

    def __bool__(self) -> bool:
        return True  # also of an empty tree

    def volumes(self, depth: int) -> Volumes:
        """The volumes `depth` levels below the root, whose own depth is 0.

        Segments that are less deep come as volumes of their own, so that every segment is in one.
        A negative depth raises ValueError.
        """
        return Volumes(*self._tree.volumes(_arrays.integer("depth", depth)))

    @property
    def fiber_count(self) -> int:
        """The number of fibers, also of those without segments."""
        return self._tree.fiber_count

    @property
    def segment_count(self) -> int:
        """The number of segments of all fibers."""
        return self._tree.segment_count

    @property
    def memory_usage(self) -> int:
        """Bytes that the tree holds, without the arrays of points and radii."""
        return self._tree.memory_usage

    @property
    def options(self) -> Options:
        """What the tree was constructed with."""
        return self._options

    def __reduce__(self) -> Any:
        raise TypeError("a FiberTree can be neither copied nor pickled; build another one")

    def __repr__(self) -> str:
        return (
            f"<FiberTree: {self.fiber_count} fibers, {self.segment_count} segments, "
            f"report={self._options.report!r}>"
        )

    @staticmethod
    def _others(other: Any, mesh_end: Optional[TriangleMesh], *more: int) -> tuple:
        if isinstance(other, TriangleMesh):
            end = other if mesh_end is None else mesh_end
            return other._mesh, _mesh_of("mesh_end", end), *more
        if mesh_end is not None:
            raise TypeError("mesh_end is given without the mesh at the start")
        return _core_of(other), *more


def root_segments(points: Points, offsets: Optional[ArrayLike], length: float) -> np.ndarray:
    """How many segments of each fiber begin less than `length` along it: (fibers,) int32.

    This is `root_segments` of build(). Points and offsets are as there, and the length is in the
    unit of the points. Wrong arrays raise ValueError or TypeError.
    """
    array, begin = _arrays.points_and_offsets(points, offsets)
    radius = np.zeros(1, array.dtype)
    return _core.root_segments(
        _core.Numbers(array, radius, _arrays.ONE),
        _arrays.layout_of(array, begin),
        _arrays.number("length", length),
    )


def _read_only(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view


def _names_of(segments: ArrayLike) -> np.ndarray:
    """Segments as C++ takes them, in their shape."""
    array = np.asarray(segments)
    if array.dtype.names is not None:
        raise TypeError(
            f"segments are {_arrays.type_of(array)}; give segments as in pairs(), such as the "
            "field a of contacts() or impacts()"
        )
    return _arrays.whole("segments", array.reshape(-1), np.int32).reshape(array.shape)


def flat(records: np.ndarray) -> np.ndarray:
    """A view of contacts whose fields are all numbers, for CSV, pandas and the like.

    Points and normals become three fields, such as point_a_x, point_a_y and point_a_z; `weights`
    become weight_0 to weight_2, as in the program's CSV. `records` are an array of contacts() or
    impacts(). There is no copy.
    """
    kind = getattr(records, "dtype", None)
    if kind is None or kind.names is None:
        raise TypeError(f"records are a {type(records).__name__}; give an array of contacts()")
    fields = []
    for name, (field, offset, *_) in kind.fields.items():
        ends = ["_x", "_y", "_z"] if field.shape else [""]
        stem, ends = ("weight", ["_0", "_1", "_2"]) if name == "weights" else (name, ends)
        fields += [
            (stem + end, field.base, offset + i * field.base.itemsize) for i, end in enumerate(ends)
        ]
    names, formats, offsets = (list(column) for column in zip(*fields))
    split = {"names": names, "formats": formats, "offsets": offsets, "itemsize": kind.itemsize}
    return records.view(np.dtype(split))  # type: ignore[call-overload]


def _choice(name: str, value: str, yes: str, no: str) -> bool:
    if not isinstance(value, str) or value not in (yes, no):
        raise ValueError(f"{name} is {value!r}; give {yes!r} or {no!r}")
    return value == yes


def _limit(limit: Optional[int]) -> int:
    found = np.iinfo(np.int64).max if limit is None else _arrays.integer("limit", limit, np.int64)
    if found < 0:
        raise ValueError(f"limit is {found}; give 0 or more")
    return int(found)


def _core_of(other: Any, no_shape: str = "", name: str = "other") -> Any:
    """The tree, mesh or shape of C++; `no_shape` tells why a shape is refused, if it is."""
    if other is None:
        return None
    if isinstance(other, FiberTree):
        return other._tree
    if isinstance(other, TriangleMesh):
        return other._mesh
    if isinstance(other, Shape) and not no_shape:
        return other._core_shape()
    kinds = (
        "a FiberTree or a TriangleMesh" if no_shape else "a FiberTree, a TriangleMesh or a Shape"
    )
    reason = f": {no_shape}" if isinstance(other, Shape) else ""
    raise TypeError(f"{name} is a {type(other).__name__}; give {kinds}{reason}")


def _tree_of(other: Any, with_others: str) -> Any:
    """The tree of C++; `with_others` is what takes meshes and shapes too."""
    if other is None or isinstance(other, FiberTree):
        return _core_of(other)
    is_partner = isinstance(other, (TriangleMesh, Shape))
    reason = f"; {with_others} takes meshes and shapes" if is_partner else ""
    raise TypeError(f"other is a {type(other).__name__}; give a FiberTree{reason}")


def _mesh_of(name: str, mesh: Any) -> _core.Mesh:
    if not isinstance(mesh, TriangleMesh):
        raise TypeError(f"{name} is a {type(mesh).__name__}; give a TriangleMesh")
    return mesh._mesh
