# SPDX-License-Identifier: LGPL-2.1-or-later
"""``raymaps accuracy``: a table, JSON, a plot; of scenes and of maps; sentences for what can't be."""

from __future__ import annotations

import json

import pytest
from PIL import Image

from tests.cli.run_cli import raymaps
