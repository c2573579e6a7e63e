# SPDX-License-Identifier: LGPL-2.1-or-later
"""What every test may use."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the source tree."""
    return Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def example_scenes(repository: Path) -> list[Path]:
    """Every scene file that is shipped."""
    return sorted((repository / "examples").rglob("*.scene.json"))
