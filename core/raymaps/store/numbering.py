# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compiled loops of the store: number the distinct signatures of a portion, hash its rays, sum where light went.

A signature is a path through a trie: the root, the source, then a node a step. Rays that share a beginning share
its nodes, so finding a ray's signature is a look-up a step.
"""

from __future__ import annotations

import numpy as np

from raymaps.jit import allocating_kernel, kernel

__all__ = ["hash_rays", "number_rows", "number_signatures", "sum_light"]

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


@kernel
def _mix(value):
    """Spread a 64-bit value over 64 bits (finaliser of splitmix64, G. Steele et al., OOPSLA 2014, figure 16)."""
    value = (value ^ (value >> np.uint64(30))) * _MIX_1
    value = (value ^ (value >> np.uint64(27))) * _MIX_2
    return value ^ (value >> np.uint64(31))


@allocating_kernel
def number_signatures(source, n_sources, event_offsets, event_code, crossing_row, crossing_code):
    """Number the distinct sequences of codes among the rays, in the order in which they first appear.

    Parameters
    ----------
    source : (n_rays,) int16
    n_sources : int
    event_offsets : (n_rays + 1,) int64
    event_code : (n_events,) int64
    crossing_row : (n_crossings,) int64, ascending
        Event after which each crossing comes.
    crossing_code : (n_crossings,) int64

    Returns
    -------
    ray_signature : (n_rays,) uint32
    signature_source : (n_signatures,) int16
    offsets : (n_signatures + 1,) int64
    codes : (n_steps,) int64
    """
    capacity = 1 + n_sources + len(event_code) + len(crossing_code)
    n_slots = 2
    while n_slots < 2 * capacity:
        n_slots *= 2
    slots = np.zeros(n_slots, np.int32)  # node in each slot of the hash table, 0 none
    parent = np.zeros(capacity, np.int32)
    code = np.zeros(capacity, np.int64)
    signature_of_node = np.full(capacity, -1, np.int64)
    n_nodes = 1 + n_sources  # the root, then a node a source

    n_rays = len(source)
    ray_signature = np.empty(n_rays, np.uint32)
    last_node = np.empty(n_rays, np.int32)  # of each signature
    n_steps = np.empty(n_rays, np.int64)
    n_signatures = 0
    crossing = 0
    for ray in range(n_rays):
        node = 1 + source[ray]
        steps = 0
        for row in range(event_offsets[ray], event_offsets[ray + 1]):
            crossings_here = 0
            while crossing + crossings_here < len(crossing_row) and crossing_row[crossing + crossings_here] == row:
                crossings_here += 1
            for k in range(1 + crossings_here):
                step = event_code[row] if k == 0 else crossing_code[crossing + k - 1]
                key = _mix(np.uint64(step) + np.uint64(node) * _GOLDEN)
                slot = np.int64(key & np.uint64(n_slots - 1))
                while slots[slot] != 0 and (parent[slots[slot]] != node or code[slots[slot]] != step):
                    slot = (slot + 1) & (n_slots - 1)
                if slots[slot] == 0:
                    slots[slot] = n_nodes
                    parent[n_nodes] = node
                    code[n_nodes] = step
                    n_nodes += 1
                node = slots[slot]
                steps += 1
            crossing += crossings_here
        if signature_of_node[node] < 0:
            signature_of_node[node] = n_signatures
            last_node[n_signatures] = node
            n_steps[n_signatures] = steps
            n_signatures += 1
        ray_signature[ray] = signature_of_node[node]

    offsets = np.zeros(n_signatures + 1, np.int64)
    for s in range(n_signatures):
        offsets[s + 1] = offsets[s] + n_steps[s]
    codes = np.empty(offsets[n_signatures], np.int64)
    signature_source = np.empty(n_signatures, np.int16)
    for s in range(n_signatures):
        node = last_node[s]
        for at in range(offsets[s + 1] - 1, offsets[s] - 1, -1):
            codes[at] = code[node]
            node = parent[node]
        signature_source[s] = node - 1
    return ray_signature, signature_source, offsets, codes


@allocating_kernel
def number_rows(bits):
    """Number the distinct rows of a table in the order in which they first appear.

    Parameters
    ----------
    bits : (n_rows, n_columns) uint32

    Returns
    -------
    index : (n_rows,) uint32, which distinct row each row is
    first : (n_distinct,) int64, where each distinct row first stands
    """
    n_rows, n_columns = bits.shape
    n_slots = 1024
    slots = np.full(n_slots, -1, np.int64)  # distinct row in each slot of the hash table
    index = np.empty(n_rows, np.uint32)
    first = np.empty(n_rows, np.int64)
    hashes = np.empty(n_rows, np.uint64)
    count = 0
    for row in range(n_rows):
        h = np.uint64(0)
        for column in range(n_columns):
            h = (h ^ np.uint64(bits[row, column])) * _MIX_1
            h ^= h >> np.uint64(29)
        slot = np.int64(h & np.uint64(n_slots - 1))
        while slots[slot] >= 0:
            other = slots[slot]
            same = hashes[other] == h
            if same:
                for column in range(n_columns):
                    same = same and bits[first[other], column] == bits[row, column]
            if same:
                break
            slot = (slot + 1) & (n_slots - 1)
        if slots[slot] < 0:
            slots[slot] = count
            first[count], hashes[count] = row, h
            count += 1
            if 2 * count > n_slots:  # grow
                n_slots *= 4
                slots = np.full(n_slots, -1, np.int64)
                for distinct in range(count):
                    place = np.int64(hashes[distinct] & np.uint64(n_slots - 1))
                    while slots[place] >= 0:
                        place = (place + 1) & (n_slots - 1)
                    slots[place] = distinct
            index[row] = count - 1
        else:
            index[row] = slots[slot]
    return index, first[:count].copy()


@kernel
def hash_rays(first_ray, source, event_offsets, event_code, triangle, position_bits, light_of_event, light_bits,
              wavelength_bits, crossing_row, crossing_code, crossing_bits):  # fmt: skip
    """Sum over the rays of a 64-bit hash of each ray's whole history, twice: a 128-bit hash of a set of rays.

    The sum does not depend on the order of the rays or on how they are split into portions.

    Parameters
    ----------
    first_ray : int
    source : (n_rays,) int, what stands for the source of each ray
    event_offsets, crossing_row : see `number_signatures`
    event_code, crossing_code : (n_events,), (n_crossings,) int64, what stands for what happened
    triangle : (n_events,) int32
    position_bits : (n_events, 3) unsigned view of the positions
    light_of_event : (n_events,) uint32, row of the light after each event
    light_bits : (n_lights, n_values) uint32 view of the distinct lights
    wavelength_bits : (n_rays,) uint32 view of the wavelengths, 0 of a ray that has none
    crossing_bits : (n_crossings, 3) uint32 view of x, y and angle

    Returns
    -------
    two uint64
    """
    n_values = light_bits.shape[1]
    low, high = np.uint64(0), np.uint64(0)
    crossing = 0
    for ray in range(len(source)):
        h = _mix(np.uint64(first_ray + ray) + np.uint64(source[ray]) * _GOLDEN)
        if wavelength_bits[ray] != 0:
            h = _mix(h ^ np.uint64(wavelength_bits[ray]))
        for row in range(event_offsets[ray], event_offsets[ray + 1]):
            h = _mix(h ^ np.uint64(event_code[row]))
            h = _mix(h + np.uint64(triangle[row] + 1) * _GOLDEN)
            for axis in range(3):
                h = _mix(h ^ (np.uint64(position_bits[row, axis]) + _GOLDEN))
            light = light_bits[light_of_event[row]]
            for value in range(0, n_values, 2):
                word = np.uint64(light[value])
                if value + 1 < n_values:
                    word |= np.uint64(light[value + 1]) << np.uint64(32)
                h = _mix(h ^ word)
            while crossing < len(crossing_row) and crossing_row[crossing] == row:
                h = _mix(h ^ np.uint64(crossing_code[crossing]))
                for value in range(3):
                    h = _mix(h ^ np.uint64(crossing_bits[crossing, value]))
                crossing += 1
        low += h
        high += _mix(h ^ _GOLDEN)
    return low, high


@kernel
def sum_light(source, event_offsets, light_of_event, light_power, account, sums, rounded, of_ray):
    """Add the light that each event took, or that ended there, to the event's account, and its squares ray by ray.

    Parameters
    ----------
    source, event_offsets : see `number_signatures`
    light_of_event : (n_events,) uint32, row of the light after each event
    light_power : (n_lights,) float64
    account : (n_events,) int32
        Account that the light lost at an event goes to; ``-1 - a`` if all light that arrives goes to account a.
    sums, rounded : (2, n_sources, n_accounts) float64
        Light and squares, added to; and what rounding added to each so far, zeros at first.
    of_ray : (n_accounts,) float64
        Room for the light of one ray; zeros, and zeros again afterwards.
    """
    for ray in range(len(source)):
        of_source = source[ray]
        before = 0.0
        for row in range(event_offsets[ray], event_offsets[ray + 1]):
            after = light_power[light_of_event[row]]
            if account[row] < 0:
                of_ray[-1 - account[row]] += before
            elif row > event_offsets[ray]:
                of_ray[account[row]] += before - after
            before = after
        for row in range(event_offsets[ray], event_offsets[ray + 1]):
            to = account[row] if account[row] >= 0 else -1 - account[row]
            if of_ray[to] != 0.0:
                _add(sums[0, of_source], rounded[0, of_source], to, of_ray[to])
                _add(sums[1, of_source], rounded[1, of_source], to, of_ray[to] * of_ray[to])
                of_ray[to] = 0.0


@kernel
def _add(sums, rounded, at, value):
    """Add a value to one of the sums without the rounding of many additions (W. Kahan, Comm. ACM 8 (1965), p. 40)."""
    corrected = value - rounded[at]
    total = sums[at] + corrected
    rounded[at] = (total - sums[at]) - corrected
    sums[at] = total
