# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces of CAD faces: what they are, and the arrays that kernels read.

Topology comes from the triangles, geometry from the exact surfaces: Embree names the facet that a ray meets, and the
crossing is computed with the exact surface of the facet's face.
"""
