# SPDX-License-Identifier: BSD-3-Clause
"""What a program does with contacts: their points, forces onto these, and pairs of fibers."""

from __future__ import annotations

from typing import Any, NamedTuple, Tuple

import numpy as np

from . import _arrays, _core

ORDERS = ("found", "segments", "fibers")


class Nodes(NamedTuple):
    """The points that carry contacts.

    points   (n, k) int32: indices of points
    weights  (n, k) float64: the part of a force at the contact that each point carries
    """

    points: np.ndarray
    weights: np.ndarray


def fiber_pairs(contacts: np.ndarray) -> np.ndarray:
    """The pairs of fibers of contacts in the order of fibers, as a structured array.

    contacts   those of contacts(order="fibers"), or some of them in this order

    fiber_a, fiber_b   the two fibers
    begin, end         their contacts are contacts[begin:end]
    count              how many they are
    deepest            the index of the one whose distance is least
    """
    array = contacts_of(contacts)
    if "fiber_a" not in names_of(array):
        raise TypeError(
            f"contacts are {_arrays.type_of(array)}; give contacts of two segments, with the field "
            "fiber_a, which bare ones lack"
        )
    return _core.fiber_pairs(array)


def order_number(order: str) -> int:
    if not isinstance(order, str) or order not in ORDERS:
        raise ValueError(f"order is {order!r}; give one of {', '.join(map(repr, ORDERS))}")
    return ORDERS.index(order)


def names_of(array: np.ndarray) -> Tuple[str, ...]:
    return array.dtype.names or ()


def contacts_of(contacts: Any) -> np.ndarray:
    """Contacts as C++ has them: without a copy, unless a program has picked or repacked some."""
    array = np.asarray(contacts)
    for kind in _core.contact_types:
        if array.ndim == 1 and array.dtype.names == kind.names:
            return np.require(array, kind, ["C", "A"])
    raise TypeError(
        f"contacts are {_arrays.type_of(array)} and shape {array.shape}; give an array that "
        "contacts() or impact_contacts() returned"
    )


def require_found(contacts: np.ndarray, layout: int, **counts: int) -> None:
    """Refuses the first contact of another layout, or whose field is not below its count."""
    layouts = contacts["layout"]
    is_wrong = (layouts != layout) & (layouts != 0)
    for name, count in counts.items():
        is_wrong |= (contacts[name] < 0) | (contacts[name] >= count)
    wrong = np.flatnonzero(is_wrong)
    if len(wrong) > 0:
        raise ValueError(
            f"contact {wrong[0]}: it is not of this tree and this partner; pass contacts that were "
            "found since the last build(), with the partner that they were found with"
        )


def side_of(contacts: np.ndarray, segment: str, s: str) -> Nodes:
    """The two points of a segment, by the names of its fields."""
    first, along = contacts[segment], contacts[s]
    return Nodes(np.stack([first, first + 1], 1), np.stack([1 - along, along], 1))


def forces_of(forces: Any) -> np.ndarray:
    values = _arrays.numbers("forces", forces).astype(np.float64, copy=False)
    if values.ndim != 1 and values.shape[1:] != (3,):
        raise ValueError(f"forces have shape {values.shape}; give (n,) or (n, 3)")
    return values


def sums_of(name: str, out: Any) -> np.ndarray:
    """A view of the array, (points, 3)."""
    if not isinstance(out, np.ndarray) or out.dtype not in (np.float32, np.float64):
        what = _arrays.type_of(out) if isinstance(out, np.ndarray) else f"a {type(out).__name__}"
        raise TypeError(f"{name} is {what}; give an array of float32 or float64")
    if out.ndim < 2 or out.shape[-1] != 3:
        raise ValueError(f"{name} has shape {out.shape}; give (points, 3)")
    if not (out.flags.c_contiguous and out.flags.aligned and out.flags.writeable):
        raise ValueError(f"{name} has to be C-contiguous and writable")
    return out.reshape(-1, 3)


def refuse_shared(**arrays: Any) -> None:
    """Refuses arrays, by name, that share memory with one that comes before them."""
    names = [name for name, array in arrays.items() if array is not None]
    for i, name in enumerate(names):
        for before in names[:i]:
            if np.may_share_memory(arrays[before], arrays[name]):
                raise ValueError(f"{name} shares memory with {before}; give another array")
