# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ray Maps on disk: portions are written while the tracer runs, and read column by column. Knows no optics."""

from raymaps.names import Names
from raymaps.store.ledger import ledger_of
from raymaps.store.lights import Lights, Stored
from raymaps.store.portion import Portion
from raymaps.store.raymap import MAP_VERSION, Manifest, MapWriter, RayMap
from raymaps.store.signatures import NONE, SignatureTable
from raymaps.store.summary import LedgerEntry, PortionSummary

__all__ = [
    "MAP_VERSION",
    "NONE",
    "LedgerEntry",
    "Lights",
    "Manifest",
    "MapWriter",
    "Names",
    "Portion",
    "PortionSummary",
    "RayMap",
    "SignatureTable",
    "Stored",
    "ledger_of",
]
