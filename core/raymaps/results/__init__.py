# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is read from a Ray Map: detectors, paths, reports, segments, pictures and the energy ledger.

Each stands in a module of its own and is imported by whoever needs it, so that none pays for another's libraries.
"""
