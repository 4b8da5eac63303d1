# SPDX-License-Identifier: BSD-3-Clause
"""Contacts of all rods of a PyElastica simulation by one tree, instead of a RodRodContact for each
two rods.

    pip install pyelastica
    python examples/python/pyelastica_contact.py [--times]

The forces are those of RodRodContact, in the same order, up to rounding. Where elements are nearly
parallel, its distance is only near the least one, which the tree finds.
"""

import itertools
import sys
import time

import elastica
import numba
import numpy as np

import fcl_fibers


# [forces]
@numba.njit
def add_forces(contacts, share, velocity, internal, external, k, nu):
    """One contact after another, because each sees the forces of those before it."""
    for c in contacts:
        pressed = approach = 0.0
        for element, half in ((c.a, 0.5), (c.b, -0.5)):
            for node in range(element, element + 2):
                for x in range(3):
                    pressed += half * c.normal[x] * (external[x, node] + internal[x, node])
                    approach += half * c.normal[x] * velocity[x, node]
        force = max(pressed, 0.0) + (c.distance < 0) * 0.5 * (nu * approach - k * c.distance)
        for element, sign in ((c.a, -force), (c.b, force)):
            for x in range(3):
                external[x, element] += sign * share[element] * c.normal[x]
                external[x, element + 1] += sign * (2 - share[element]) * c.normal[x]


class FiberContact(elastica.NoContact):
    def __init__(self, rods, k, nu):
        super().__init__()
        # All rods are in the same arrays, one behind the other, with a ghost node between two.
        self.nodes, self.radii = rods[0].position_collection.base, rods[0].radius.base
        moving = rods[0].velocity_collection, rods[0].internal_forces, rods[0].external_forces
        end = np.cumsum([rod.n_elems + 2 for rod in rods]) - 1
        begin = end - [rod.n_elems + 1 for rod in rods]
        share = np.ones(end[-1])  # of a force on an element, for its first node
        share[begin], share[end - 2] = 2 / 3, 4 / 3
        self.more = share, *(array.base for array in moving), k, nu
        self.tree = fcl_fibers.FiberTree(margin=1e-5)
        fibers = self.nodes.T, np.column_stack([begin, end]), self.radii
        self.tree.build(*fibers, groups=1 + np.arange(len(end)))

    def apply_contact(self, system_one, system_two, time=0.0):
        self.tree.update(self.nodes.T, radii=self.radii)
        add_forces(self.tree.contacts(order="fibers", bare=True), *self.more)


# [forces]


class Simulation(elastica.BaseSystemCollection, elastica.Contact):
    pass


def rods_in(simulation, layers, rods, elements):
    """Layers of rods, each across the one below, which overlap by a little."""
    random, made = np.random.default_rng(1), []
    for layer, number in itertools.product(range(layers), range(rods)):
        along, beside = np.roll(np.eye(3)[:2], layer, axis=0)
        start = 0.022 * number * beside + 0.0195 * layer * np.eye(3)[2]
        rod = elastica.CosseratRod.straight_rod(
            elements, start, along, np.eye(3)[2], 0.022 * rods, 0.01, 1e3, youngs_modulus=1e6
        )
        simulation.append(rod)
        rod.position_collection += 1e-4 * random.normal(size=rod.position_collection.shape)
        rod.velocity_collection += 1e-2 * random.normal(size=rod.velocity_collection.shape)
        made.append(rod)
    return made


def forces(layers, rods, elements, with_tree):
    """Of all rods, after one look for contacts, and the seconds that it has taken."""
    simulation = Simulation()
    made = rods_in(simulation, layers, rods, elements)
    if with_tree:  # in the name of any two rods
        contact = simulation.detect_contact_between(made[0], made[1])
        contact.using(FiberContact, rods=made, k=1e3, nu=1.0)
    else:
        for one, two in itertools.combinations(made, 2):
            contact = simulation.detect_contact_between(one, two)
            contact.using(elastica.RodRodContact, k=1e3, nu=1.0)
    simulation.finalize()
    for _ in range(2):  # Numba compiles at the first time
        for rod in made:
            rod.external_forces[:] = 0
        begin = time.process_time()
        simulation.synchronize(0.0)
        seconds = time.process_time() - begin
    return np.concatenate([rod.external_forces for rod in made], axis=1), seconds


theirs, before = forces(6, 8, 40, with_tree=False)
ours, after = forces(6, 8, 40, with_tree=True)
print(f"{np.count_nonzero(theirs.any(axis=0))} of {theirs.shape[1]} nodes are pushed")
difference = np.abs(ours - theirs).max() / np.abs(theirs).max()
assert difference < 1e-9, difference
print("the forces are those of RodRodContact")
if "--times" in sys.argv:
    print(f"processor time of a step: {1e3 * before:.1f} ms before, {1e3 * after:.1f} ms by a tree")
