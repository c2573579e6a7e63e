# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which effects a scene calls for: ``raymaps explain SCENE --json`` in a process of its own."""

from collections import namedtuple

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.command import TracerCommand

#: name, summary: text. needed: whether a run simulates it. because: tuple of reasons, also of what is switched off.
#: off: what takes its place if it is switched off, else empty. share: of the time that a map took; None if not known.
Effect = namedtuple("Effect", "name summary needed because off share", defaults=(None,))


class Explanation(TracerCommand):
    """Asks for the effects of one scene, or of one Ray Map.

    Signals: ``explained(list of Effect)``; ``failed(str)`` with one sentence.
    """

    explained = QtCore.Signal(object)
    failed = QtCore.Signal(str)

    def __init__(self, scene, parent=None):
        """Raises `TracerError` if there is no interpreter."""
        super().__init__(["explain", scene, "--json"], parent)
        self._answer = None

    def _hear(self, event, message):
        self._answer = message

    def _end(self, code, crashed):
        try:
            effects = effects_of(self._answer)
        except (ValueError, KeyError, TypeError):
            self.failed.emit(self._why(code, crashed, "told the effects"))
            return
        self.explained.emit(effects)


def effects_of(answer):
    """Effects as they stand in the answer of ``explain``."""
    return [
        Effect(
            str(effect["name"]),
            str(effect.get("summary", "")),
            bool(effect["needed"]),
            tuple(str(reason) for reason in effect.get("because", ())),
            str(effect.get("off") or ""),
            effect.get("share"),
        )
        for effect in answer["effects"]
    ]


def simulated(effects):
    """Effects that a run simulates."""
    return [effect for effect in effects if effect.needed and not effect.off]


def switched_off(effects):
    """Effects that the scene calls for and that are switched off."""
    return [effect for effect in effects if effect.off and effect.because]


def title_of(effect):
    """Name of an effect as people read it."""
    return effect.name.replace("_", " ")
