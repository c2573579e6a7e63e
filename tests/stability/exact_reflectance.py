# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fresnel's equations to fifty digits, from the very numbers that a kernel is given."""

from __future__ import annotations

from decimal import Decimal, localcontext

__all__ = ["interface", "metal"]

DIGITS = 50


def interface(cos_i: float, n_i: float, n_t: float) -> tuple[Decimal, Decimal]:
    """Power reflectance of two clear media for unpolarised light, and the cosine of refraction (0: none).

    M. Born, E. Wolf: Principles of Optics, 7th ed., section 1.5.2, eq. 21a, and Snell's law.
    """
    with localcontext() as context:
        context.prec = DIGITS
        c, n, m = Decimal(cos_i), Decimal(n_i), Decimal(n_t)
        cos2_t = 1 - (n / m) ** 2 * (1 - c * c)
        if cos2_t <= 0:
            return Decimal(1), Decimal(0)
        t = cos2_t.sqrt()
        r_s, r_p = (n * c - m * t) / (n * c + m * t), (m * c - n * t) / (m * c + n * t)
        return (r_s * r_s + r_p * r_p) / 2, t


def metal(cos_i: float, n_i: float, n: float, k: float) -> Decimal:
    """Power reflectance of a metal of index n + ik for unpolarised light.

    M. Born, E. Wolf, section 14.4.1: with (p + iq)² = (n + ik)² - n_i² sin²,
    R_s = |n_i cos - (p + iq)|² / |n_i cos + (p + iq)|² and R_p = R_s ((p - s)² + q²) / ((p + s)² + q²), where
    s = n_i sin² / cos.
    """
    with localcontext() as context:
        context.prec = DIGITS
        c, a = Decimal(cos_i), Decimal(n_i)
        n_, k_ = Decimal(n), Decimal(k)
        s2 = 1 - c * c
        real, imaginary = n_ * n_ - k_ * k_ - a * a * s2, 2 * n_ * k_
        size = (real * real + imaginary * imaginary).sqrt()
        p, q = (max(Decimal(0), (size + real) / 2)).sqrt(), (max(Decimal(0), (size - real) / 2)).sqrt()
        r_s = ((a * c - p) ** 2 + q * q) / ((a * c + p) ** 2 + q * q)
        if c == 0:
            return Decimal(1)
        s = a * s2 / c
        return r_s * (1 + ((p - s) ** 2 + q * q) / ((p + s) ** 2 + q * q)) / 2
