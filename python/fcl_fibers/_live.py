# SPDX-License-Identifier: BSD-3-Clause
"""The pairs that touch, kept from step to step."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _arrays, _core
from ._tree import FiberTree, TriangleMesh, _core_of

# Why a partner is no shape.
NO_LIST = "pairs() of the tree finds those with a shape, without a list"


class LiveChanges(NamedTuple):
    """Pairs that began or ended to touch.

    pairs   (n, 2) int32, as in LivePairs.pairs()
    slots   (n,) int32: the slot of each pair
    """

    pairs: np.ndarray
    slots: np.ndarray


class LiveCounters(NamedTuple):
    """What LivePairs have done since they were constructed.

    updates            calls of update() that have not raised an exception
    listings           searches for all pairs, or for all within the skin
    uncovered_pairs    pairs that were tested though the last search had not listed them
    tested_pairs       pairs that were tested, of all lists
    touching_pairs     those of them that touched; the others were in vain
    longest_life       the most updates that one listing of all pairs has served
    """

    updates: int
    listings: int
    uncovered_pairs: int
    tested_pairs: int
    touching_pairs: int
    longest_life: int


class LivePairs:
    """Keeps the pairs that touch while fibers move little from step to step, as in a solver.

    An update tests only the pairs that were near, and searches only where others may have come
    near:

        live = fcl_fibers.LivePairs(tree)
        while True:
            tree.update(points)
            live.update()
            contacts = live.contacts()

    tree      a FiberTree with report="capsules" and volumes="boxes"
    partner   another such FiberTree or a TriangleMesh; None for the pairs of the tree itself
    skin      how far beyond what touches pairs are listed, in the unit of the points. A wide skin
              serves for many steps, and each step tests more pairs. None has it chosen, by counts
              and not by time. At 0 there is no list, and each update searches.

    A pair lives while it touches at each of consecutive updates. It has a slot, a small number for
    arrays of a program's own, such as friction or impulses. The slot is that of another pair only
    after ended() has had the pair for one update. FiberTree.build() ends all pairs. Those with a
    mesh outlast its set_pose() and update(). A segment wholly inside a solid is paired with its
    nearest triangle: if another one becomes the nearest, one pair ends and another one begins.

    While live pairs have a list, FiberTree.update() without `end` reads and checks the points, and
    leaves it to the first search to refit the tree. After an update with `end`, the pairs are those
    at its end.

    The tree and the partner are kept alive. Reading the pairs is a query of the tree: several
    threads may read at once, and a read beside a build or update of the tree raises RuntimeError.
    update() is a change of the tree: beside any other call of it, it raises RuntimeError and
    changes nothing.
    """

    def __init__(
        self,
        tree: FiberTree,
        partner: Union[FiberTree, TriangleMesh, None] = None,
        skin: Optional[float] = None,
    ) -> None:
        if not isinstance(tree, FiberTree):
            raise TypeError(f"tree is a {type(tree).__name__}; give a FiberTree")
        length = -1.0 if skin is None else _arrays.number("skin", skin)
        if skin is not None and not 0 <= length < np.inf:
            raise ValueError(f"skin is {length}; give a finite length, or None to have one chosen")
        self._tree, self._partner = tree, partner
        core = _core_of(tree if partner is None else partner, NO_LIST, "partner")
        kind = _core.LiveOfMesh if isinstance(partner, TriangleMesh) else _core.LiveOfTrees
        self._live: Any = kind(tree._tree, core, length)

    def update(self) -> None:
        """Brings the pairs to where the fibers and the partner are now.

        Raises ValueError where pairs() of the tree does. After an exception all is as it was.
        """
        self._live.update()

    def pairs(self) -> np.ndarray:
        """The pairs that touch, (n, 2) int32, as FiberTree.pairs() has them.

        They are in the order of the list: that of the search which has listed them, and then what
        was listed later. It depends only on the calls and the arrays.
        """
        return self._live.pairs()

    def slots(self) -> np.ndarray:
        """The slot of each pair, (n,) int32, in the order of pairs()."""
        return self._live.slots()

    def contacts(self, bare: bool = False) -> np.ndarray:
        """The contacts of the pairs, in the order of pairs(), as FiberTree.contacts() has them.

        They are computed from the points of the tree as they are now, so call update() before. If
        the tree has been built with other offsets since then, ValueError is raised.

        bare    as in FiberTree.contacts()
        """
        return self._live.contacts(bool(bare))

    def begun(self) -> LiveChanges:
        """The pairs that began to touch in the last update, with their slots."""
        return LiveChanges(*self._live.begun())

    def ended(self) -> LiveChanges:
        """The pairs that ended to touch in the last update, with the slots that they had.

        They may be of segments that are no more.
        """
        return LiveChanges(*self._live.ended())

    def safe_distances(
        self, skip_touching: bool = False
    ) -> Union[np.ndarray, Tuple[np.ndarray, np.ndarray]]:
        """How far each point may move without a new contact: (points,) float64.

        If no point moves further than its own distance, no two segments touch then that do not
        touch now. It is at most half of the gap to the nearest segment that it is not to touch, and
        at most half of what is left of the skin. Points of no segment have infinity.

        skip_touching   pairs that touch do not count, because the program parts them; else their
                        points have 0

        With another tree as the partner, two arrays are returned, and the points of both may move
        at once. Neighbours and groups that are left out of the pairs do not count, and the margin
        of the tree does.

        A mesh as the partner stays where it is. Then no segment touches it, or is inside a solid,
        that does not now. The distance is the whole gap, or what is left of the skin if that is
        less. With skip_touching, a segment that touches the mesh or is inside does not count at
        all. Of several partners, the least distance of all LivePairs is safe.

        ValueError is raised if the fibers or the mesh have changed since update(), or if there is
        no list because the skin is 0. Give LivePairs a skin to have one always.
        """
        return self._live.safe_distances(bool(skip_touching))

    def __len__(self) -> int:
        """The number of pairs that touch."""
        return self._live.count

    def __bool__(self) -> bool:
        return True  # also without pairs

    @property
    def slot_count(self) -> int:
        """All slots are from 0 to slot_count - 1. It never falls.

        It is at most the largest sum of pairs that touched at an update and those that had ended at
        the same.
        """
        return self._live.slot_count

    @property
    def skin(self) -> float:
        """The skin at present, in the unit of the points; 0 if each update searches."""
        return self._live.skin

    @property
    def counters(self) -> LiveCounters:
        """What the pairs have cost so far."""
        return LiveCounters(*self._live.counters())

    @property
    def memory_usage(self) -> int:
        """Bytes that the pairs hold, without those of the trees."""
        return self._live.memory_usage

    @property
    def tree(self) -> FiberTree:
        """The tree, as given."""
        return self._tree

    @property
    def partner(self) -> Union[FiberTree, TriangleMesh, None]:
        """The partner, as given."""
        return self._partner

    def __reduce__(self) -> Any:
        raise TypeError("LivePairs can be neither copied nor pickled; make others of the tree")

    def __repr__(self) -> str:
        return f"<LivePairs: {len(self)} pairs, {self.slot_count} slots, skin {self.skin:g}>"
