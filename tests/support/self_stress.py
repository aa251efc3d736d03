"""What states of self-stress of droplets at onset consist of: forces between droplets, or couples within pairs."""

from collections import defaultdict, deque
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from jamlab.mechanics.held_motions import DEPENDENT, held_conditions

PARALLEL = 1e-2  # sine of the angle of two contacts of a flat; measured: below 2e-3
DIFFER = 0.1  # force between droplets of states of norm 1, as a singular value; measured: below 0.013, above 0.88
LEAST = 3e-4  # of the largest force: a contact with less just touches; measured where S = 1: below 2e-4, above 5e-4
NOISE = 1e-5  # of the largest force: pull that rounding leaves


@dataclass(frozen=True)
class SelfStress:
    """States of self-stress of one packing, by what they consist of.

    Attributes:
        states: dimension S of all of them.
        forces: dimension of the forces between droplets that they make; the others are couples.
        rings: droplets of every independent ring of droplets that rest flat on flat.
        coinciding: dimension of states of single pairs: contacts that are not independent of others of their pair.
        contacts, droplets: that may bear load.
        loaded, spanned: contacts and droplets of the state without pull that loads most contacts.
        pushing_couples: some state of couples has no pull.
    """

    states: int
    forces: int
    rings: tuple[int, ...]
    coinciding: int
    contacts: int
    droplets: int
    loaded: int
    spanned: int
    pushing_couples: bool


def self_stress(packing):
    """Take the states of self-stress of droplets at onset apart."""
    rows, droplets, _ = held_conditions(packing)
    both = rows.reshape(len(rows), droplets, 3)
    ends = [tuple(map(int, np.flatnonzero(row.any(axis=1)))) for row in both]
    pairs = defaultdict(list)
    for contact, pair in enumerate(ends):
        pairs[pair].append(contact)
    normals = np.array([row[pair[-1], :2] for row, pair in zip(both, ends, strict=True)])
    ranks = {pair: int((np.linalg.svd(rows[of], compute_uv=False) > DEPENDENT).sum()) for pair, of in pairs.items()}
    flats = [pair for pair, of in pairs.items() if ranks[pair] == 2 and _parallel(normals[of])]
    states = states_of_self_stress(rows)
    between = np.concatenate([normals[of].T @ states[of] for of in pairs.values()])  # forces between droplets
    _, sizes, turns = np.linalg.svd(between)
    forces = int((sizes > DIFFER).sum())
    loaded = loaded_without_pull(states)
    return SelfStress(
        states=states.shape[1],
        forces=forces,
        rings=independent_rings(flats),
        coinciding=len(rows) - sum(ranks.values()),
        contacts=len(rows),
        droplets=droplets,
        loaded=int(loaded.sum()),
        spanned=len({end for contact in np.flatnonzero(loaded) for end in ends[contact]}),
        pushing_couples=bool(loaded_without_pull(states @ turns[forces:].T).any()),
    )


def states_of_self_stress(rows):
    """(contacts, S) orthonormal forces that balance, of conditions (contacts, motions)."""
    left, singular, _ = np.linalg.svd(rows)
    return left[:, int((singular > DEPENDENT).sum()) :]


def loaded_without_pull(states):
    """(contacts,) those that bear load in the state with the most of them in which none pulls: a linear programme.

    Such states add up to one that loads all that any of them loads, so that one programme finds it: the sum of
    min(force, LEAST) is largest, of forces between -NOISE and 1.
    """
    contacts, count = states.shape
    if not count:
        return np.zeros(contacts, dtype=bool)
    below = np.block([[-states, LEAST * np.eye(contacts)], [states, np.zeros((contacts, contacts))]])
    ends = np.repeat([NOISE, 1.0], contacts)  # LEAST * share <= force + NOISE, with share >= 0; force <= 1
    cost = np.repeat([0.0, -1.0], [count, contacts])
    bounds = [(None, None)] * count + [(0, 1)] * contacts
    found = linprog(cost, below, ends, bounds=bounds)
    assert found.status == 0, found.message
    return np.asarray(states @ found.x[:count] > 0.9 * LEAST)


def independent_rings(edges):
    """Lengths of as many short rings of a graph as are independent, the shortest through every edge first.

    These span all rings of graphs as sparse as those of flats; that they do is checked.
    """
    beside = defaultdict(set)
    for i, j in edges:
        beside[i].add(j)
        beside[j].add(i)
    number = {frozenset(edge): k for k, edge in enumerate(edges)}
    rings = [ring for i, j in edges if (ring := _shortest(beside, i, j))]
    kept, reduced = [], {}
    for ring in sorted(rings, key=len):
        bits = sum(1 << number[frozenset(step)] for step in zip(ring, [*ring[1:], ring[0]], strict=True))
        while bits and bits.bit_length() in reduced:  # rings add up modulo 2
            bits ^= reduced[bits.bit_length()]
        if bits:
            reduced[bits.bit_length()] = bits
            kept.append(len(ring))
    vertices = {vertex: k for k, vertex in enumerate(beside)}
    links = np.array([[vertices[i], vertices[j]] for i, j in edges]).reshape(-1, 2)
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(vertices),) * 2)
    parts = connected_components(graph, directed=False)[0] if vertices else 0
    assert len(kept) == len(number) - len(vertices) + parts, "longer rings than the shortest through an edge are needed"
    return tuple(kept)


def _shortest(beside, start, end):
    """The shortest way from start to end that does not take the edge between them; none where there is none."""
    came, queue = {start: None}, deque([start])
    while queue and end not in came:
        at = queue.popleft()
        for other in beside[at]:
            if other not in came and {at, other} != {start, end}:
                came[other] = at
                queue.append(other)
    way = [end] if end in came else []
    while way and came[way[-1]] is not None:
        way.append(came[way[-1]])
    return way


def _parallel(normals):
    first = normals[0]
    return bool(np.all(np.abs(normals @ [-first[1], first[0]]) < PARALLEL))
