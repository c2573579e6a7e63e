# SPDX-License-Identifier: LGPL-2.1-or-later
"""Emission: where rays start and where they go, one module a kind of source.

Each has ``run(slots, wave, key, ...)``, which fills position and direction of the slots whose source it is; lengths in
frame units.
"""
