# SPDX-License-Identifier: LGPL-2.1-or-later
"""A bench for the kernels of surfaces: rays meet one surface at the origin, without a scene around it."""

from __future__ import annotations

import importlib
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import RGB_BANDS, Bands
from raymaps.effects import EFFECTS, Lowering
from raymaps.frame import Frame
from raymaps.kernels.transport import PENDING
from raymaps.kinds import SurfaceKind
from raymaps.materials import VACUUM
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.wave import RunKey, Wave
from tests.kernel_types import tables

#: Plane of the surface: no axis of the scene lies in it.
NORMAL = np.array([2.0, -3.0, 6.0]) / 7.0


class Met(NamedTuple):
    """Rays after they met the surface."""

    kind: NDArray[np.uint8]
    direction: NDArray[np.float64]  # (n, 3) x along the plane of incidence, z out of the side where the ray arrived
    light: NDArray[np.float64]  # (n, n_bands)
    side: NDArray[np.int8]  # relative to the side of arrival: 1 back, -1 through
    medium: NDArray[np.int16]  # 0 that of arrival, 1 beyond


def lines(*wavelength_nm: float) -> Bands:
    """Bands without width at wavelengths."""
    nm = np.array(wavelength_nm)
    return Bands(nm, nm, True, "cie_1931_2deg", np.zeros((len(nm), 3)), np.zeros(len(nm)))


def spectrum(from_nm: float, to_nm: float, bands: int) -> Bands:
    """Bands of equal width."""
    edges = np.linspace(from_nm, to_nm, bands + 1)
    return Bands(edges[:-1], edges[1:], True, "cie_1931_2deg", np.zeros((bands, 3)), np.zeros(bands))


def scene_with(
    surface: dict[str, Any], media: dict[str, Any] | None = None, medium: str | None = "inside", **more: Any
) -> Scene:
    """A body of a medium with a surface property, in the medium ``around`` (index 1 unless said otherwise)."""
    return Scene.model_validate(
        {
            "format": "raymaps-scene",
            "version": 1,
            "ambient": "around",
            "media": {"around": {"refractive_index": 1.0}, "inside": {"refractive_index": 1.5}, **(media or {})},
            "surfaces": {"tested": surface, **more.pop("surfaces", {})},
            "bodies": {"Part": {"geometry": {"file": "a.ply"}, "medium": medium, "surface": "tested"}},
            "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
            **more,
        }
    )


def lowering_of(scene: Scene, bands: Bands = RGB_BANDS) -> Lowering:
    """A scene on its way to arrays, without its geometry."""
    media = dict(scene.media) if scene.ambient else {**scene.media, "vacuum": VACUUM}
    names = Names(
        sources=tuple(scene.sources),
        bodies=tuple(scene.bodies),
        surfaces=tuple(scene.surfaces),
        media=tuple(media),
        detectors=(),
        faces=((0, "Face1"),),
    )
    return Lowering(scene, names, bands, tuple(media.values()), Frame(np.zeros(3), 1.0, 1e-6))


def lowered(name: str, scene: Scene, bands: Bands = RGB_BANDS) -> Any:
    """What the kernel of an effect reads."""
    effect = next(effect for effect in EFFECTS if effect.name == name)
    data = effect.lower(lowering_of(scene, bands))
    for array in data:
        array.setflags(write=False)
    return data


def meet(
    name: str,
    data: Any,
    angle_rad: float | NDArray[np.float64],
    n_rays: int,
    *,
    kind: SurfaceKind | None = None,
    light: tuple[float, ...] = (0.5, 0.3, 0.2),
    n_near: float = 1.0,
    n_far: float = 1.5,
    from_back: bool = False,
    media: tuple[int, int] = (0, 1),
    threshold: float = 1.0,
    seed: int = 1,
) -> Met:
    """Let rays meet the surface of index 0.

    Parameters
    ----------
    angle_rad : float or (n_rays,) float64
        Angle of incidence.
    media : (int, int)
        Indices of the medium in front of the surface and of that behind it.
    """
    kernel = importlib.import_module(f"raymaps.kernels.{name}")
    wave = Wave.allocate(n_rays, len(light))
    outward = -NORMAL if from_back else NORMAL
    x = np.cross(outward, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(outward, x), outward])
    angle = np.broadcast_to(angle_rad, n_rays)
    wave.direction[:] = np.sin(angle)[:, None] * axes[0] - np.cos(angle)[:, None] * axes[2]
    wave.light[:] = np.array(light, np.float32)
    wave.near_side[:] = -1 if from_back else 1
    wave.hit[:] = 0
    wave.normal[:] = NORMAL
    near, far = media[::-1] if from_back else media
    wave.medium[:], wave.beyond[:] = near, far
    wave.n_near[:], wave.n_far[:] = n_near, n_far
    wave.state[:] = PENDING
    kinds = np.array([SurfaceKind[name.upper()] if kind is None else kind], np.uint8)
    kernel.run(
        np.arange(n_rays, dtype=np.int32), wave, tables(surface_kind=kinds), data,
        RunKey(np.uint64(seed), np.uint64(10**9), threshold), 1,
    )  # fmt: skip
    assert np.allclose(np.linalg.norm(wave.direction, axis=1), 1, atol=1e-12)
    return Met(
        wave.state.copy(),
        wave.direction @ axes.T,
        wave.light.astype(np.float64),
        wave.side * wave.near_side,
        np.where(wave.medium == far, 1, 0) if near != far else (wave.side != wave.near_side).astype(np.int16),
    )


def lambertian_angles(n_rays: int, seed: int) -> NDArray[np.float64]:
    """Angles of incidence of light that is equally bright from all sides."""
    return np.arcsin(np.sqrt(np.random.default_rng(seed).uniform(size=n_rays)))


def reciprocal(
    what: str, there: NDArray[np.int64], back: NDArray[np.int64], n_there: int, n_back: int, ratio: float
) -> None:
    """Assert by chi-square that flux from cell i to cell j is ``ratio`` times that from j to i.

    Parameters
    ----------
    there, back : (n_cells, n_cells) int
        Counts by cells of incidence and of exit, each of Lambertian light.
    n_there, n_back : int
        Rays behind them.
    ratio : float
        Squared index on the side where ``back`` starts over that where ``there`` starts; both fluxes are relative.
    """
    one, other = there / n_there, ratio * back.T / n_back
    variance = there / n_there**2 + ratio**2 * back.T / n_back**2
    enough = (there >= 10) & (back.T >= 10)
    assert enough.sum() >= 10, f"{what}: too few counts"
    k = int(enough.sum())
    chi_square = float(((one - other)[enough] ** 2 / variance[enough]).sum())
    deviate = ((chi_square / k) ** (1 / 3) - (1 - 2 / (9 * k))) / math.sqrt(2 / (9 * k))
    print(f"  {what}: chi-square {chi_square:.1f} of {k}, {deviate:+.2f} sigma")
    assert deviate < 5, f"{what}: chi-square {chi_square:.1f} with {k} degrees of freedom"


def cells_agree(what: str, counts: NDArray[Any], expected: NDArray[Any], *, n: int | None = None) -> None:
    """Assert by chi-square that counts follow expected counts (p > 1e-4); cells of fewer than ten are put together.

    With ``n`` counts need not add up: what is missing to n draws is one more cell.
    """
    from scipy.stats import chi2

    counts, expected = np.ravel(counts).astype(float), np.ravel(expected).astype(float)
    if n is not None:
        counts, expected = np.append(counts, n - counts.sum()), np.append(expected, max(0.0, n - expected.sum()))
    few = expected < 10
    pooled_counts = np.append(counts[~few], counts[few].sum())
    pooled = np.append(expected[~few], expected[few].sum())
    if pooled[-1] < 10:
        smallest = int(np.argmin(pooled[:-1]))
        pooled[smallest] += pooled[-1]
        pooled_counts[smallest] += pooled_counts[-1]
        pooled, pooled_counts = pooled[:-1], pooled_counts[:-1]
    chi_square = float(((pooled_counts - pooled) ** 2 / pooled).sum())
    p = float(chi2.sf(chi_square, len(pooled) - 1))
    print(f"  {what}: chi-square {chi_square:.1f} of {len(pooled) - 1}, p = {p:.3g}")
    assert p > 1e-4, f"{what}: chi-square {chi_square:.1f} with {len(pooled) - 1} degrees of freedom, p = {p:.2g}"
