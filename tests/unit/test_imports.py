# SPDX-License-Identifier: LGPL-2.1-or-later
"""Imports point one way, heavy packages are imported only where they are needed, and the workbench needs none."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from raymaps.effects import EFFECTS
from tests.store.small_scenes import lamp_in_a_room, write_scene

#: The flow. A module imports from its own stage or from earlier ones, never from a later one.
ORDER: tuple[tuple[str, ...], ...] = (
    ("errors", "units", "kinds", "jit", "version"),
    ("formats",),
    ("materials",),
    ("scene",),
    ("names", "geometry", "traced", "frame", "spectral_data", "ray_numbers"),
    ("exact",),
    ("solids",),
    ("boundary",),
    ("bands",),
    ("store",),
    ("effects",),
    ("on_the_way",),
    ("ray_sets",),
    ("compile",),
    ("sources", "intersect", "kernels"),
    ("wave",),
    ("slow_search",),
    ("trace",),
    ("criterion",),
    ("results",),
    ("runner",),
    ("target",),
    ("run", "check"),
    ("progress", "target_options"),
    ("cli", "serve"),
)
STAGE = {name: i for i, stage in enumerate(ORDER) for name in stage}
#: They show the library to Python and to the shell, so they import from everywhere.
FACES = ("__init__", "__main__")

TRACER = ("effects", "compile", "sources", "intersect", "kernels", "wave", "slow_search", "trace")
COMPILED_PACKAGES = (
    "numpy", "numba", "embreex", "trimesh", "pyarrow", "pydantic", "scipy", "pyvista", "vtk", "matplotlib", "duckdb",
    "polars", "pandas", "PIL", "shapely",
)  # fmt: skip

CORE = Path(__file__).resolve().parents[2] / "core"
PACKAGE = CORE / "raymaps"
WORKBENCH = CORE.parent / "raymaps_wb"


def python_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*.py") if "__pycache__" not in p.parts)


def module_name(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path, root: Path) -> Iterator[tuple[int, str]]:
    """(line, dotted module) of all that a file imports anywhere in it, under TYPE_CHECKING and by name too."""
    package = module_name(path, root).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            whole = ".".join(part for part in (base, node.module) if part)
            for alias in node.names:  # a name may be a module
                yield node.lineno, f"{whole}.{alias.name}"
        elif isinstance(node, ast.Call) and _is_import_by_name(node):
            first = node.args[0]
            text = first.values[0] if isinstance(first, ast.JoinedStr) else first
            if isinstance(text, ast.Constant):
                yield node.lineno, str(text.value)


def _is_import_by_name(node: ast.Call) -> bool:
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return called in ("import_module", "__import__") and bool(node.args)


def part_of_raymaps(dotted: str) -> str | None:
    """``raymaps.store.portion.Portion`` is of the part ``store``; the package's own face is ``__init__``."""
    first, _, rest = dotted.partition(".")
    if first != "raymaps":
        return None
    part = rest.partition(".")[0]
    is_part = bool(part) and ((PACKAGE / part).is_dir() or (PACKAGE / f"{part}.py").is_file())
    return part if is_part else "__init__"


def core_modules() -> list[Path]:
    return [p for p in python_files(PACKAGE) if not (p.parent == PACKAGE and p.stem in FACES)]


def part_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def backward_imports(paths: list[Path]) -> list[str]:
    wrong = []
    for path in paths:
        for line, dotted in imports(path, CORE):
            part = part_of_raymaps(dotted)
            if part is not None and STAGE.get(part, len(ORDER)) > STAGE[part_of(path)]:
                wrong.append(f"{path.relative_to(CORE)}:{line} imports {dotted}")
    return wrong


def test_every_module_has_its_stage():
    assert sorted({part_of(p) for p in core_modules()}) == sorted(STAGE)


def test_imports_point_one_way():
    assert backward_imports(core_modules()) == []


def test_a_backward_import_would_be_found():
    """The check sees plain, renamed, relative, TYPE_CHECKING and run-time imports."""
    made = {
        "import raymaps.store.raymap": "raymaps.store.raymap",
        "from raymaps import trace": "raymaps.trace",
        "from . import trace": "raymaps.trace",
        "from .store import RayMap as R": "raymaps.store.RayMap",
        "if TYPE_CHECKING:\n    from raymaps.cli import app": "raymaps.cli.app",
        "def f():\n    import raymaps.run": "raymaps.run",
        "importlib.import_module(f'raymaps.kernels.{name}')": "raymaps.kernels.",
    }
    for text, expected in made.items():
        path = _Text(PACKAGE / "scene.py", text)
        found = [dotted for _, dotted in imports(path, CORE)]
        assert expected in found, text
        assert part_of_raymaps(expected) in STAGE, text
        assert STAGE[part_of_raymaps(expected)] > STAGE["scene"], text


class _Text(type(Path())):
    """A path whose text is given."""

    def __init__(self, path: Path, text: str):
        if sys.version_info >= (3, 12):
            super().__init__(path)
        self.text = text

    def __new__(cls, path: Path, text: str):
        return super().__new__(cls, path)

    def read_text(self, *args: object, **kwargs: object) -> str:
        return self.text


def test_kernels_import_only_numpy_numba_math_and_kinds():
    allowed = {"numpy", "numba", "math", "cmath", "__future__", "typing", "collections"}
    wrong = []
    for path in python_files(PACKAGE / "kernels"):
        for line, dotted in imports(path, CORE):
            first = dotted.partition(".")[0]
            fine = first in allowed or dotted.startswith(("raymaps.kernels.", "raymaps.kinds.", "raymaps.jit."))
            if not fine:
                wrong.append(f"{path.name}:{line} imports {dotted}")
    assert wrong == []


def test_kernels_import_no_kernel_of_an_effect():
    """So that none is imported because another effect shares its code."""
    effects = {f"raymaps.kernels.{effect.name}" for effect in EFFECTS}
    wrong = [
        f"{path.name}:{line} imports {dotted}"
        for path in python_files(PACKAGE / "kernels")
        for line, dotted in imports(path, CORE)
        if effects & {dotted, dotted.rpartition(".")[0]}
    ]
    assert wrong == []


def test_store_imports_nothing_of_the_tracer():
    found = {part_of_raymaps(dotted) for path in python_files(PACKAGE / "store") for _, dotted in imports(path, CORE)}
    assert found.isdisjoint(TRACER)
    assert "scene" in found  # the check reads something


def test_only_intersect_imports_embree():
    users = {part_of(p) for p in python_files(PACKAGE) for _, dotted in imports(p, CORE) if "embree" in dotted.lower()}
    assert users == {"intersect"}


def test_workbench_imports_no_raymaps_and_nothing_compiled():
    files = python_files(WORKBENCH)
    assert len(files) > 10
    wrong = [
        f"{path.relative_to(WORKBENCH.parent)}:{line} imports {dotted}"
        for path in [*files, WORKBENCH.parent / "Init.py", WORKBENCH.parent / "InitGui.py"]
        for line, dotted in imports(path, WORKBENCH.parent)
        if dotted.partition(".")[0] in (*COMPILED_PACKAGES, "raymaps")
    ]
    assert wrong == []


def test_workbench_imports_only_the_standard_library_freecad_and_qt():
    allowed = {
        *sys.stdlib_module_names, "raymaps_wb", "FreeCAD", "FreeCADGui", "Part", "PartDesign", "Mesh", "MeshPart",
        "Import", "ImportGui", "App", "Gui", "PySide", "PySide2", "PySide6", "pivy", "freecad", "Draft", "Sketcher",
    }  # fmt: skip
    used = {
        dotted.partition(".")[0] for path in python_files(WORKBENCH) for _, dotted in imports(path, WORKBENCH.parent)
    }
    assert used - allowed == set()


# ---------------------------------------------------------------------------------------------------------------------
# What is imported in fact, seen from a fresh process.


def imported(statement: str, *arguments: object, refuse: tuple[str, ...] = ()) -> set[str]:
    """Modules in sys.modules at the end of a process that runs a statement; ``refuse`` are packages made absent."""
    script = (
        "import sys, json\n"
        f"for name in {list(refuse)!r}: sys.modules[name] = None\n"
        f"sys.argv = ['raymaps', *{[str(a) for a in arguments]!r}]\n"
        f"try:\n    {statement}\n"
        "except SystemExit as end:\n    assert not end.code, end.code\n"
        "print('\\n@' + json.dumps([name for name, module in sys.modules.items() if module is not None]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True, text=True, timeout=120, check=False, cwd=CORE.parent,
        env={**os.environ, "PYTHONPATH": f"{CORE}{os.pathsep}{CORE.parent}"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.rpartition("@")[2]))


HEAVY = ("numpy", "numba", "pydantic", "trimesh", "pyarrow", "pyvista", "matplotlib", "scipy", "embreex")


def test_help_imports_nothing_heavy():
    modules = imported("from raymaps.cli import main; main()", "--help")
    assert modules.isdisjoint(HEAVY)
    assert "raymaps.cli" in modules


@pytest.mark.parametrize("command", ["trace", "detector", "serve"])
def test_help_of_a_command_imports_nothing_heavy(command):
    """But for pydantic, which typer itself may import."""
    modules = imported("from raymaps.cli import main; main()", command, "--help")
    assert modules.isdisjoint(set(HEAVY) - {"pydantic"})
    assert modules.isdisjoint({"raymaps.scene", "raymaps.run", "raymaps.store"})


def test_importing_raymaps_imports_nothing_heavy():
    modules = imported("import raymaps; raymaps.__version__; dir(raymaps)")
    assert modules.isdisjoint(HEAVY)


@pytest.fixture(scope="module")
def modules_of_a_plain_trace(tmp_path_factory) -> set[str]:
    folder = tmp_path_factory.mktemp("plain")
    scene = write_scene(folder, lamp_in_a_room(folder))
    return imported("from raymaps.cli import main; main()", "trace", scene, "-o", folder / "m.raymap", "--rays", 50)


def test_tracing_imports_no_package_for_pictures(modules_of_a_plain_trace):
    assert modules_of_a_plain_trace.isdisjoint(
        {"pyvista", "vtk", "vtkmodules", "matplotlib", "scipy", "colour", "trimesh", "duckdb"}
    )
    assert "numba" in modules_of_a_plain_trace


def test_kernels_of_effects_that_are_not_needed_are_not_imported(modules_of_a_plain_trace):
    """A grey room calls for Lambertian reflection and its detector for crossings; for nothing else."""
    effects = {effect.name for effect in EFFECTS}
    kernels = {name.removeprefix("raymaps.kernels.") for name in modules_of_a_plain_trace if "raymaps.kernels." in name}
    assert kernels & effects == {"lambertian", "crossings"}


def test_kernel_of_crossings_is_not_imported_without_a_detector(tmp_path):
    data = lamp_in_a_room(tmp_path)
    del data["detectors"]
    scene = write_scene(tmp_path, data)
    modules = imported(
        "from raymaps.cli import main; main()", "trace", scene, "-o", tmp_path / "m.raymap", "--rays", 50
    )
    assert "raymaps.kernels.crossings" not in modules
    assert "raymaps.kernels.lambertian" in modules


def test_workbench_imports_where_no_compiled_package_is_present():
    """Everything of the workbench that needs neither FreeCAD nor Qt."""
    plain = [p for p in python_files(WORKBENCH) if not _needs_freecad(p)]
    names = [module_name(p, WORKBENCH.parent) for p in plain]
    assert "raymaps_wb" in names
    modules = imported(f"import {', '.join(names)}", refuse=(*COMPILED_PACKAGES, "raymaps"))
    assert modules.isdisjoint((*COMPILED_PACKAGES, "raymaps"))


def _needs_freecad(path: Path, _seen: frozenset[Path] = frozenset()) -> bool:
    if path in _seen:
        return False
    for _, dotted in imports(path, WORKBENCH.parent):
        first = dotted.partition(".")[0]
        if first not in sys.stdlib_module_names and first != "raymaps_wb":
            return True
        if first == "raymaps_wb":
            for candidate in (dotted, dotted.rpartition(".")[0]):
                base = WORKBENCH.parent.joinpath(*candidate.split("."))
                for file in (base.with_suffix(".py"), base / "__init__.py"):
                    if file.is_file() and _needs_freecad(file, _seen | {path}):
                        return True
    return False
