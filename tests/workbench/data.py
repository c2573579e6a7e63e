# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small files of every format that a study can speak of."""

import os
import struct

SPECTRUM = "wavelength_nm, value\n380, 0.2\n550, 0.4\n780, 0.8\n"
INDEX = "# own measurement\n380 1.53\n550 1.51\n780 1.505\n"
ANGLES = "angle_deg, value\n0, 0.04\n60, 0.1\n90, 1\n"
COATING = "angle_deg; 380; 550; 780\n0; 0.02; 0.01; 0.02\n60; 0.1; 0.05; 0.1\n"
PHASE = "angle value\n0 10\n90 1\n180 2\n"
EMISSION = "0, 1\n45, 0.5\n90, 0\n"
YAML = """REFERENCES: "G. Somebody, J. Somewhere 1 (2000) 1"
DATA:
  - type: formula 1
    wavelength_range: 0.3 2.5
    coefficients: 0 1.03961212 0.077464177 0.231792344 0.14148462 1.01046945 10.1764755
"""
AGF = """VERSION
CC small catalogue
NM N-BK7 2 517642 1.5168 64.17 0 1
ED 7.1 8.3 2.51 -0.0009 0
CD 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653 0 0 0 0
LD 0.3 2.5
NM N-SF11 2 785257 1.78472 25.68 0 1
ED 8.5 9.4 3.22 0.0149 0
CD 1.73759695 0.013188707 0.313747346 0.0623068142 1.89878101 155.23629 0 0 0 0
LD 0.37 2.5
"""
IES = """IESNA:LM-63-2002
[TEST] small
[MANUFAC] none
TILT=NONE
1 1000 1 3 1 1 2 0.1 0.1 0
1 1 10
0 45 90
0
300 200 0
"""
BSDF = """# raymaps-bsdf
# from: front
# to: reflection
theta_i, theta_s, bsdf
0, 0, 0.1
0, 89, 0.1
80, 0, 0.1
80, 89, 0.1
"""


def write(folder, name, content):
    """Write a file; its path."""
    path = os.path.join(folder, name)
    with open(path, "wb") as file:
        file.write(content if isinstance(content, bytes) else content.encode("utf-8"))
    return path


def zemax_rays(n=3):
    """A binary source file of Zemax with n rays along z; header of 208 bytes, then float32 records."""
    header = struct.pack("<II100sfff4f", 1010, n, b"small", 1.0, 1.0, 0.55, 0, 0, 0, 0)
    header += struct.pack("<i3f3f3f4fii2i", 4, 0, 0, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0)
    assert len(header) == 208, len(header)
    return header + b"".join(struct.pack("<7f", i, 0, 0, 0, 0, 1, 1.0 / n) for i in range(n))
