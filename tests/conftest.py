# SPDX-License-Identifier: LGPL-2.1-or-later
"""What every test may use."""

from collections.abc import Iterator
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


@pytest.fixture(scope="session", autouse=True)
def kernels_know_no_types_of_tests() -> Iterator[None]:
    """Kernels are kept compiled for the types they were given; see `tests.kernel_types`."""
    yield
    from raymaps.jit import kept_machine_code

    wrong = [file.name for file in kept_machine_code() if b"tests." in file.read_bytes()]
    assert not wrong, "a kernel was given a type of a test"
