# SPDX-License-Identifier: LGPL-2.1-or-later
"""Draws the pictures of `docs/optics.md` from simulations of small scenes.

    PYTHONPATH=core:. .venv/bin/python -m docs.drawing [NAME ...]

writes ``docs/pictures/optics_NAME.png``, by default all of them, in a few minutes. Seeds are fixed, so that only the
version of matplotlib changes a picture; and the machine that of exact surfaces, which tells times.

    PYTHONPATH=core:. .venv/bin/python -m docs.drawing.accuracy [FILE.json]

draws the pictures of `docs/accuracy.md` from what `make bench` measured, as that does at its end.
"""
