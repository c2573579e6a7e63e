# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which rays match a criterion: decided once per distinct signature, looked up per ray.

`bind` checks a criterion's names against a map once and replaces them by indices. `Bound.on_signatures` then says for
each signature whether its rays match *never*, *always*, or whether that *needs numbers*; only the area of a detector
needs them, of rays whose signature crosses that detector, and the wavelength of a ray. So the columns of a portion are
touched only where the signature leaves the answer open.

To add an elementary event: a class in `tree`, how it is read and written in `text`, its meaning in `_BINDERS` here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import tree
from raymaps.criterion.text import parse_criterion
from raymaps.errors import CriterionError, unknown_name
from raymaps.kinds import CRITERION_KINDS, ENDINGS, OFF_SURFACE, EventKind
from raymaps.names import Names
from raymaps.scene import Detector, FaceDetector, FarFieldDetector
from raymaps.store.signatures import NONE, SignatureTable

if TYPE_CHECKING:
    from raymaps.store import Portion

__all__ = ["Bound", "Verdicts", "bind", "inside_area", "matching_rays"]

Mask = NDArray[np.bool_]

#: Events that don't take place on a surface, whatever body they name.
_NOT_ON_A_SURFACE = (*OFF_SURFACE, EventKind.EMISSION, EventKind.CROSSING)


@dataclass(frozen=True)
class Verdicts:
    """What signatures alone say about a criterion.

    Attributes
    ----------
    always : (n_signatures,) bool
        Rays of the signature match.
    maybe : (n_signatures,) bool
        Rays of the signature match or may match; never those outside ``maybe``.
    """

    always: Mask
    maybe: Mask


class Bound:
    """A node of a criterion whose names have become indices of one map. Frozen; made by `bind`."""

    #: The criterion that was bound.
    criterion: tree.Criterion

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        """Verdict per signature."""
        raise NotImplementedError

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        """Verdict per ray, for those that signatures leave open; ``rays`` are numbers within the portion."""
        raise NotImplementedError

    def on_sources(self, n_sources: int) -> Verdicts:
        """Verdict per source: what is known of a ray from its source alone."""
        raise NotImplementedError


def bind(criterion: tree.Criterion | str, names: Names, detectors: Mapping[str, Detector] | None = None) -> Bound:
    """Check a criterion's names and replace them by indices.

    Parameters
    ----------
    criterion : Criterion or its text form
    names : Names
        Of the map that is asked.
    detectors : mapping of names to detectors, optional
        Those of the map's scene; a detector that is left out is a rectangle.

    Raises
    ------
    CriterionError
        If the text can't be read, or a name is unknown: the sentence lists the known ones.
    """
    if isinstance(criterion, str):
        criterion = parse_criterion(criterion)
    if not isinstance(criterion, tree.Criterion):
        raise CriterionError(f"A criterion is a text, got a value of type {type(criterion).__name__}.")
    return _bind(criterion, names, detectors or {})


def _bind(criterion: tree.Criterion, names: Names, detectors: Mapping[str, Detector]) -> Bound:
    if isinstance(criterion, tree.Not):
        return _Negation(criterion, _bind(criterion.operand, names, detectors))
    if isinstance(criterion, tree.And | tree.Or):
        return _Junction(criterion, tuple(_bind(operand, names, detectors) for operand in criterion.operands))
    if isinstance(criterion, tree.Crosses):
        return _bind_crosses(criterion, names, detectors.get(criterion.detector))
    return _BINDERS[type(criterion)](criterion, names)


def matching_rays(portion: Portion, bound: Bound) -> NDArray[np.int64]:
    """Rays of a portion that match, as ascending numbers within the portion.

    Returns
    -------
    (n_matching,) int64
    """
    verdicts = bound.on_signatures(portion.signatures)
    if not verdicts.maybe.any():
        return np.zeros(0, np.int64)
    if verdicts.always.all():
        return np.arange(portion.n_rays, dtype=np.int64)
    open_signatures = verdicts.maybe & ~verdicts.always
    if not open_signatures.any():
        return np.flatnonzero(verdicts.always[portion.ray_signature])
    candidates = np.flatnonzero(verdicts.maybe[portion.ray_signature])
    is_open = open_signatures[portion.ray_signature[candidates]]
    keep = ~is_open
    keep[is_open] = bound.on_rays(portion, candidates[is_open])
    return candidates[keep]


def inside_area(area: tree.Area, xy_mm: NDArray[np.floating]) -> Mask:
    """Which points lie in an area of a detector, borders included.

    Parameters
    ----------
    area : Rectangle or Ellipse
    xy_mm : (n, 2) float, local coordinates of the detector

    Returns
    -------
    (n,) bool
    """
    x_mm, y_mm = np.asarray(xy_mm, np.float64).T
    if isinstance(area, tree.Rectangle):
        return (x_mm >= area.x0_mm) & (x_mm <= area.x1_mm) & (y_mm >= area.y0_mm) & (y_mm <= area.y1_mm)
    with np.errstate(over="ignore"):  # a point far outside a tiny ellipse
        return ((x_mm - area.cx_mm) / area.rx_mm) ** 2 + ((y_mm - area.cy_mm) / area.ry_mm) ** 2 <= 1.0


# ---------------------------------------------------------------------------------------------------- logic


@dataclass(frozen=True)
class _Negation(Bound):
    criterion: tree.Criterion
    operand: Bound

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        return _negated(self.operand.on_signatures(table))

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        return ~self.operand.on_rays(portion, rays)

    def on_sources(self, n_sources: int) -> Verdicts:
        return _negated(self.operand.on_sources(n_sources))


@dataclass(frozen=True)
class _Junction(Bound):
    criterion: tree.Criterion
    operands: tuple[Bound, ...]

    @property
    def _combine(self) -> np.ufunc:
        return np.logical_and if isinstance(self.criterion, tree.And) else np.logical_or

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        verdicts = self.operands[0].on_signatures(table)
        for operand in self.operands[1:]:
            # Nothing can change any more: an "and" that never holds, an "or" that always does.
            if not verdicts.maybe.any() if isinstance(self.criterion, tree.And) else verdicts.always.all():
                break
            verdicts = _combined(self._combine, verdicts, operand.on_signatures(table))
        return verdicts

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        undecided = isinstance(self.criterion, tree.And)  # what an operand says that decides nothing
        result = np.full(len(rays), undecided)
        left = np.arange(len(rays))
        for operand in self.operands:
            answers = operand.on_rays(portion, rays[left])
            result[left] = answers
            left = left[answers == undecided]
            if not len(left):
                break
        return result

    def on_sources(self, n_sources: int) -> Verdicts:
        verdicts = self.operands[0].on_sources(n_sources)
        for operand in self.operands[1:]:
            verdicts = _combined(self._combine, verdicts, operand.on_sources(n_sources))
        return verdicts


def _negated(verdicts: Verdicts) -> Verdicts:
    return Verdicts(~verdicts.maybe, ~verdicts.always)


def _combined(combine: np.ufunc, a: Verdicts, b: Verdicts) -> Verdicts:
    return Verdicts(combine(a.always, b.always), combine(a.maybe, b.maybe))


# ---------------------------------------------------------------------------------------------------- elementary events


@dataclass(frozen=True)
class _BySignature(Bound):
    """An elementary event that signatures decide.

    ``select`` gives the verdict per signature. ``by_source`` holds it per source where the source decides alone.
    """

    criterion: tree.Criterion
    select: Callable[[SignatureTable], Mask]
    by_source: Callable[[int], Mask] | None = None

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        selected = self.select(table)
        return Verdicts(selected, selected)

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        return self.select(portion.signatures)[portion.ray_signature[rays]]

    def on_sources(self, n_sources: int) -> Verdicts:
        if self.by_source is None:
            return Verdicts(np.zeros(n_sources, bool), np.ones(n_sources, bool))
        known = self.by_source(n_sources)
        return Verdicts(known, known)


@dataclass(frozen=True)
class _InArea(Bound):
    """Registered by a detector inside an area, which needs numbers."""

    criterion: tree.Criterion
    detector: int
    area: tree.Area

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        return Verdicts(np.zeros(len(table), bool), _registered_by(table, self.detector))

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        rows = np.flatnonzero((portion.crossing_detector == self.detector) & portion.crossing_registered)
        rows = rows[inside_area(self.area, portion.crossing_xy_mm[rows])]
        hit = np.zeros(portion.n_rays, bool)
        hit[portion.crossing_ray[rows]] = True
        return hit[rays]

    def on_sources(self, n_sources: int) -> Verdicts:
        return Verdicts(np.zeros(n_sources, bool), np.ones(n_sources, bool))


@dataclass(frozen=True)
class _OfWavelength(Bound):
    """Narrowed to one wavelength in a range, which needs a number of each ray."""

    criterion: tree.Wavelength

    def on_signatures(self, table: SignatureTable) -> Verdicts:
        return Verdicts(np.zeros(len(table), bool), np.ones(len(table), bool))

    def on_rays(self, portion: Portion, rays: NDArray[np.int64]) -> Mask:
        wavelength_nm = portion.ray_wavelength_nm[rays]
        low_nm, high_nm = np.float32(self.criterion.low_nm), np.float32(self.criterion.high_nm)
        return np.asarray((wavelength_nm >= low_nm) & (wavelength_nm <= high_nm))  # 0 where the ray has no single one

    def on_sources(self, n_sources: int) -> Verdicts:
        return Verdicts(np.zeros(n_sources, bool), np.ones(n_sources, bool))


def _with_step(
    table: SignatureTable,
    wanted: Mask,
    code: NDArray[np.uint8],
    place: NDArray[np.integer] | None = None,
    index: int = NONE,
) -> Mask:
    """Which signatures have a step with a wanted code, at a given place if one is given."""
    from raymaps.criterion.steps_kernel import has_step, has_step_at

    if place is None:
        return np.asarray(has_step(table.offsets, code, wanted))
    return np.asarray(has_step_at(table.offsets, place, index, code, wanted))


def _registered_by(table: SignatureTable, detector: int) -> Mask:
    """Signatures with a crossing, which alone names a detector, that the detector registered."""
    registered = np.zeros(256, bool)
    registered[1] = True
    return _with_step(table, registered, table.registered.view(np.uint8), table.detector, detector)


def _kind_mask(kinds: tuple[EventKind, ...]) -> Mask:
    """Lookup from a kind's code to whether it is one of some kinds, (256,) bool."""
    mask = np.zeros(256, bool)
    mask[list(kinds)] = True
    return mask


def _on_a_surface(column: str, index: int, kind: str | None) -> Callable[[SignatureTable], Mask]:
    """Selects signatures with an event on a surface whose column holds an index and, if given, that has a kind."""
    kinds = tuple(EventKind) if kind is None else CRITERION_KINDS[kind]
    mask = _kind_mask(tuple(k for k in kinds if k not in _NOT_ON_A_SURFACE))

    return lambda table: _with_step(table, mask, table.kind, getattr(table, column), index)


def _in_medium(kind: str, medium: int) -> Callable[[SignatureTable], Mask]:
    """Selects signatures with an event inside a medium: the segment that ends at the event runs in the medium."""
    mask = _kind_mask(CRITERION_KINDS[kind])

    def select(table: SignatureTable) -> Mask:
        events = np.flatnonzero(table.kind != EventKind.CROSSING)
        here = np.flatnonzero(mask[table.kind[events]])  # never the first: a signature starts with its emission
        steps = events[here[table.medium[events[here - 1]] == medium]]
        owners = np.zeros(len(table), bool)
        owners[np.searchsorted(table.offsets, steps, side="right") - 1] = True
        return owners

    return select


def _known(what: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise CriterionError(unknown_name(what, name, names))
    return names.index(name)


def _bind_everything(event: Any, names: Names) -> Bound:
    return _BySignature(event, lambda table: np.ones(len(table), bool), lambda n_sources: np.ones(n_sources, bool))


def _bind_from(event: tree.From, names: Names) -> Bound:
    source = _known("source", event.source, names.sources)
    return _BySignature(event, lambda table: table.ray_source == source, lambda n: np.arange(n) == source)


def _bind_hit(event: tree.Hit, names: Names) -> Bound:
    body = _known("body", event.body, names.bodies)
    if event.face is None:
        return _BySignature(event, _on_a_surface("body", body, event.kind))
    faces = {name: index for index, (owner, name) in enumerate(names.faces) if owner == body}
    if event.face not in faces:
        raise CriterionError(unknown_name(f"face of body '{event.body}'", event.face, faces))
    return _BySignature(event, _on_a_surface("face", faces[event.face], event.kind))


def _bind_on_surface(event: tree.OnSurface, names: Names) -> Bound:
    surface = _known("surface property", event.surface, names.surfaces)
    return _BySignature(event, _on_a_surface("surface", surface, event.kind))


def _bind_happened(event: tree.Happened, names: Names) -> Bound:
    kinds = CRITERION_KINDS[event.kind]
    if kinds == (EventKind.EMISSION,):
        return _bind_everything(event, names)
    mask = _kind_mask(kinds)
    return _BySignature(event, lambda table: _with_step(table, mask, table.kind))


def _bind_in_medium(event: tree.InMedium, names: Names) -> Bound:
    medium = _known("medium", event.medium, names.media)
    return _BySignature(event, _in_medium(tree.MEDIUM_EVENTS[event.what], medium))


def _bind_crosses(event: tree.Crosses, names: Names, detector: Detector | None) -> Bound:
    index = _known("detector", event.detector, names.detectors)
    if isinstance(detector, FaceDetector | FarFieldDetector) and event.area is not None:
        what = "faces" if isinstance(detector, FaceDetector) else "the far field"
        raise CriterionError(
            f"Detector '{event.detector}' is one of {what}: {event.area.word}=(...) is an area of a rectangle; leave "
            "it out."
        )
    if isinstance(detector, FarFieldDetector):
        return _bind_ended(tree.Ended("left"), names, event)
    if isinstance(detector, FaceDetector):
        return _bind_faces(event, detector, names)
    if event.area is not None:
        return _InArea(event, index, event.area)
    return _BySignature(event, lambda table: _registered_by(table, index))


def _bind_faces(event: tree.Crosses, detector: FaceDetector, names: Names) -> Bound:
    """An event on a surface of one of the faces of a detector."""
    body = _known("body", detector.body, names.bodies)
    if detector.faces is None:
        return _BySignature(event, _on_a_surface("body", body, None))
    wanted = np.array([owner == body and name in detector.faces for owner, name in names.faces] + [False])
    kinds = _kind_mask(tuple(k for k in EventKind if k not in _NOT_ON_A_SURFACE))

    def select(table: SignatureTable) -> Mask:
        return _with_step(table, kinds, np.where(wanted[table.face], table.kind, EventKind.LEFT).astype(np.uint8))

    return _BySignature(event, select)


def _bind_ended(event: tree.Ended, names: Names, as_event: tree.Criterion | None = None) -> Bound:
    mask = _kind_mask(ENDINGS[event.how])
    return _BySignature(as_event or event, lambda table: mask[table.ending])


def _bind_wavelength(event: tree.Wavelength, names: Names) -> Bound:
    return _OfWavelength(event)


#: The meaning of each elementary event; what it is for a detector depends on the detector, see `_bind_crosses`.
_BINDERS: dict[type[tree.Criterion], Callable[[Any, Names], Bound]] = {
    tree.Everything: _bind_everything,
    tree.From: _bind_from,
    tree.Hit: _bind_hit,
    tree.OnSurface: _bind_on_surface,
    tree.Happened: _bind_happened,
    tree.InMedium: _bind_in_medium,
    tree.Ended: _bind_ended,
    tree.Wavelength: _bind_wavelength,
}
