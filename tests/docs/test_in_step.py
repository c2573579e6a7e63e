# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the documentation lists is what the program has: columns, kinds, fields, commands, links."""

from __future__ import annotations

import ast
import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, TypeAdapter
from typer.main import get_command

from raymaps import materials, scene
from raymaps.criterion import ELEMENTARY_EVENTS
from raymaps.criterion import text as criterion_text
from raymaps.effects import EFFECTS
from raymaps.kinds import CRITERION_KINDS, ENDINGS, KILL_REASONS, EventKind
from raymaps.materials.catalogue import catalogue
from raymaps.materials.dispersion import FORMULAS
from raymaps.materials.medium import MediumOrCatalogue, PhaseFunction
from raymaps.scene.emission import EmissionSpectrum, FaceEmission
from raymaps.store.columns import COLUMNS, MOST_BANDS
from tests.docs.blocks import find_blocks

REPOSITORY = Path(__file__).resolve().parents[2]
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]


#: Columns that pages tell of by "...".
MORE_BANDS = {f"band_{band}" for band in range(2, MOST_BANDS)}


def page(name: str) -> str:
    return (REPOSITORY / "docs" / name).read_text(encoding="utf-8")


def section(text: str, heading: str) -> str:
    """A section of a page, up to the next heading of its own or a higher level."""
    level = heading.split(" ", 1)[0]
    found = re.search(rf"^{re.escape(heading)}$(.*?)(?=^#{{1,{len(level)}}} |\Z)", text, re.M | re.S)
    assert found, f"no section '{heading}'"
    return found[1]


def rows(text: str) -> list[list[str]]:
    """Cells of the first table of a text, without its head."""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("|---"))
    table = []
    for line in lines[first + 1 :]:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]])
    return table


def all_rows(text: str) -> list[list[str]]:
    """Cells of all tables of a text."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


def kinds_of(union: Any) -> set[str]:
    """What ``kind`` may be in a union of models."""
    defs = TypeAdapter(union).json_schema()
    return set(defs["discriminator"]["mapping"])


def quoted(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


# ---------------------------------------------------------------------------------------------------- file format


@pytest.mark.parametrize("table", COLUMNS)
def test_columns_are_those_of_the_store(table: str) -> None:
    text = section(page("file-format.md"), "## The columns")
    told = rows(text.partition(f"`{table}.parquet`, a row")[2])
    listed = [(name, cells[1], cells[2]) for cells in told for name in quoted(cells[0])]
    assert [name for name, _, _ in listed] == [name for name in COLUMNS[table] if name not in MORE_BANDS]
    for name, dtype, unit in listed:
        column = COLUMNS[table][name]
        assert dtype == ("float32 or float64" if column.dtype is None else np.dtype(column.dtype).name), name
        assert unit == next((u for u in ("mm", "nm", "rad") if name.endswith(f"_{u}")), ""), name


def test_kinds_are_those_of_the_program() -> None:
    told = rows(section(page("file-format.md"), "## Kinds of events"))
    assert [(int(code), quoted(name)[0]) for code, name, _ in told] == [(kind.value, kind.label) for kind in EventKind]


def test_keys_of_the_manifest_and_of_portions(maps: Path) -> None:
    folder = maps / "led.raymap"
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    told = rows(section(page("file-format.md"), "## manifest.json"))
    assert [quoted(cells[0])[0] for cells in told] == list(manifest)
    of_names = next(cells[1] for cells in told if "`names`" in cells[0])
    assert set(quoted(of_names)) >= set(manifest["names"])
    summary = json.loads((folder / "portions" / "000000000000" / "portion.json").read_text(encoding="utf-8"))
    told = rows(section(page("file-format.md"), "## portion.json"))
    assert [name for cells in told for name in quoted(cells[0])] == list(summary)
    told = rows(section(page("file-format.md"), "## The energy ledger"))
    assert [quoted(cells[0])[0] for cells in told] == list(summary["ledger"][0])


def test_files_of_a_map_are_those_that_are_told(maps: Path) -> None:
    told = section(page("file-format.md"), "## The folder")
    for path in (maps / "led.raymap").rglob("*"):
        name = path.name if path.suffix in (".json", ".parquet") or path.is_dir() else "0000.ply"
        assert name in told or name.isdigit(), path


def test_examples_of_reading_a_map_agree_with_the_program(maps: Path) -> None:
    import raymaps

    raymap = raymaps.open_map(maps / "led.raymap")
    target = raymaps.evaluate_detector(raymap, "Target")
    hits = raymaps.query(raymap, "hit(Diffuser.Face5)")
    shown = [block.text for block in find_blocks(page("file-format.md")) if block.mark == "output"]
    fluxes = [re.search(r"Target: ([\d.]+) ± ([\d.]+) W", text) for text in shown]
    flux, error = next((float(m[1]), float(m[2])) for m in fluxes if m)
    assert abs(flux - target.flux_w.value) <= 5 * target.flux_w.stderr
    assert error == pytest.approx(target.flux_w.stderr, rel=0.1)
    counts = [int(m[1]) for text in shown if (m := re.match(r"(\d+) rays, the first", text))]
    counts += [int(m[1]) for text in shown if (m := re.match(r"rays(?:,emitted_w)?\n(\d+)", text))]
    assert len(counts) == 3
    assert counts == pytest.approx([hits.rays] * 3, abs=5 * hits.rays**0.5)


def test_all_fields_of_the_paper_are_told() -> None:
    told = rows(section(page("file-format.md"), "## What is stored and what is derived"))
    assert [int(cells[0]) for cells in told] == list(range(1, 12))


# ---------------------------------------------------------------------------------------------------- scene format


def models() -> list[type[BaseModel]]:
    found = [value for module in (scene, materials) for value in vars(module).values() if isinstance(value, type)]
    return list({model for model in found if issubclass(model, BaseModel) and model.__name__[0] != "_"})


def test_every_field_of_a_scene_is_told() -> None:
    told = set(quoted(re.sub(r"^```.*?^```", "", page("scene-format.md"), flags=re.M | re.S)))
    fields = {field for model in models() for field in model.model_fields}
    assert fields - told == set()
    kinds = {str(field.default) for model in models() for name, field in model.model_fields.items() if name == "kind"}
    assert {f'"{kind}"' for kind in kinds} - told == set()


def test_settings_have_the_defaults_that_are_told() -> None:
    told = section(page("scene-format.md"), "### Settings")
    settings = {quoted(cells[0])[0]: cells[1] for cells in rows(told)}
    assert settings.pop("spectrum") == ""  # in a table of its own
    bands = {quoted(cells[0])[0]: cells[1] for cells in rows(told.partition("**`spectrum`**")[2])}
    for defaults, model in ((settings, scene.Settings), (bands, scene.SpectralBands)):
        fields = {name: field.default for name, field in model.model_fields.items() if name != "spectrum"}
        assert {name: json.loads(text.strip("`")) for name, text in defaults.items()} == {
            name: list(value) if isinstance(value, tuple) else value for name, value in fields.items()
        }


def test_the_catalogue_is_told() -> None:
    told = {name for cells in all_rows(page("scene-format.md")) if len(cells) == 2 for name in quoted(cells[1])}
    assert set(catalogue()) <= told


#: Kinds of parts of a scene, and endings of files that its examples speak of but do not have.
PARTS: dict[str, Any] = {
    "media": MediumOrCatalogue, "surfaces": materials.SurfaceProperty, "bodies": scene.Body, "sources": scene.Source,
    "detectors": scene.Detector,
}  # fmt: skip
MISSING = (".agf", ".xml", ".ies")


@pytest.mark.parametrize("section_name", PARTS)
def test_pieces_of_scenes_are_valid(section_name: str, tmp_path: Path) -> None:
    for name in ("green", "red"):
        (tmp_path / f"{name}.csv").write_text("400;0,9\n700;0,1\n")
    blocks = re.findall(r"^```json\n(\"\w+\": .*?)^```", page("scene-format.md"), re.M | re.S)
    pieces = [piece for block in blocks for piece in json.loads(f"{{{block}}}").get(section_name, {}).values()]
    checked = [piece for piece in pieces if not any(ending in json.dumps(piece) for ending in MISSING)]
    assert len(checked) > len(pieces) / 2
    for piece in checked:
        TypeAdapter(PARTS[section_name]).validate_python(piece, context={"folder": tmp_path})


def test_the_published_schema_is_that_of_the_program() -> None:
    stored = json.loads((REPOSITORY / "docs" / "scene.schema.json").read_text(encoding="utf-8"))
    assert stored == scene.scene_json_schema()


# ---------------------------------------------------------------------------------------------------- criteria


def test_every_elementary_event_and_kind_is_told() -> None:
    text = page("criterion.md")
    events = {
        re.split(r"\W", name)[0] for cells in rows(section(text, "## Elementary events")) for name in quoted(cells[0])
    }
    assert events == set(ELEMENTARY_EVENTS)
    kinds = [name for cells in rows(section(text, "## Kinds")) for name in quoted(cells[0])]
    assert sorted(kinds) == sorted(CRITERION_KINDS)
    endings = re.findall(r"`ended\((\w+)\)`", section(text, "## Elementary events"))
    assert set(endings) == set(ENDINGS)


def test_the_grammar_is_that_of_the_parser() -> None:
    def words(text: str) -> str:
        return "".join(re.sub(r"\s|`", "", line) for line in text.splitlines())

    grammar = re.search(r"^    criterion   = .*?\n\n", criterion_text.__doc__ or "", re.M | re.S)
    assert grammar is not None
    assert words(grammar[0]) in words(section(page("criterion.md"), "## Grammar and limits"))


# ---------------------------------------------------------------------------------------------------- optics


def test_every_effect_and_what_takes_its_place_is_told() -> None:
    told = {quoted(cells[0])[0]: cells[1:] for cells in rows(section(page("optics.md"), "## Effects at a glance"))}
    assert list(told) == [effect.name for effect in EFFECTS]
    for effect in EFFECTS:
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", told[effect.name][0])
        assert plain.startswith(effect.summary.partition(",")[0]) or effect.name in ("fresnel", "abg", "gaussian"), (
            plain
        )
        assert told[effect.name][1] == effect.if_off


def test_every_kind_of_source_spectrum_phase_and_surface_has_its_formula() -> None:
    text = page("optics.md")
    listed = {name for cells in all_rows(text) for name in quoted(cells[0])}
    for union in (scene.Source, EmissionSpectrum, FaceEmission, PhaseFunction):
        assert kinds_of(union) - listed <= {"luminaire", "rays", "crossings"}, union
    headings = {anchor for line in text.splitlines() if line.startswith("#") for anchor in anchors(line)}
    assert {"luminaires", "rays-of-files-and-of-other-maps", "rectangle", "faces", "far-field"} <= headings
    surfaces = {"fresnel": "fresnel-interface", "thin_film": "thin-film"}
    assert {surfaces.get(kind, kind) for kind in kinds_of(materials.SurfaceProperty)} <= headings


def test_every_formula_of_an_index_is_told_with_its_equation() -> None:
    told = {
        quoted(cells[0])[0]: cells[1]
        for cells in all_rows(page("scene-format.md"))
        if len(cells) == 2 and quoted(cells[0])
    }
    assert {name: told.get(name) for name in FORMULAS} == {name: each.equation for name, each in FORMULAS.items()}


def test_reasons_of_killed_rays_are_told() -> None:
    told = rows(section(page("optics.md"), "## The energy ledger"))
    assert [quoted(cells[0])[0] for cells in told] == list(KILL_REASONS.values())


# ---------------------------------------------------------------------------------------------------- commands


def test_every_command_and_option_is_told() -> None:
    from raymaps.cli import app

    text = section(page("user-guide.md"), "## On the command line")
    listed = {quoted(cells[0])[0] for cells in rows(text)}
    commands = get_command(app).commands  # type: ignore[attr-defined]
    assert listed == set(commands)
    for name, command in commands.items():
        if name != "serve":
            section(page("user-guide.md"), f"### {name}")
        for parameter in command.params:
            for option in parameter.opts:
                if option.startswith("--") and option not in ("--help", "--output"):
                    assert option in text, f"raymaps {name} {option}"


def test_every_method_of_the_server_is_told() -> None:
    from raymaps.serve import METHODS

    told = rows(section(page("user-guide.md"), "## From other programs: the server"))
    assert {quoted(cells[0])[0] for cells in told} == {*METHODS, "shutdown"}


def test_every_command_of_the_workbench_is_told() -> None:
    tree = ast.parse((REPOSITORY / "raymaps_wb" / "gui" / "commands.py").read_text(encoding="utf-8"))
    titles = []
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Tuple)
            and isinstance(node.value, ast.Tuple)
        ):
            values = dict(zip([name.id for name in node.targets[0].elts], node.value.elts, strict=True))  # type: ignore
            text = values.get("TEXT")
            if isinstance(text, ast.Constant) and text.value:
                titles.append(text.value)
    told = [cells[0].strip("*") for cells in rows(section(page("user-guide.md"), "### Tag a model"))]
    assert titles
    assert told == titles


# ---------------------------------------------------------------------------------------------------- links and words

_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as code forges make them."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", title).lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    for link in _LINK.findall(text):
        if "://" in link:
            continue
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        assert target.exists(), f"{path.name}: {link}"
        if anchor:
            assert anchor in anchors(target.read_text(encoding="utf-8")), f"{path.name}: {link}"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_no_addresses_of_registries_nor_of_somebodys_machine(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    hosts = set(re.findall(r"https?://([\w.-]+)", text))
    assert hosts <= {"keepachangelog.com", "parquet.apache.org", "semver.org", "json-schema.org"}
    assert not re.search(r"(?<![\w.~$])/(?:home|root|work|tmp|usr|opt|Users)/", text)


def test_pictures_are_small_and_shown() -> None:
    shown = {link for path in PAGES for link in _LINK.findall(path.read_text(encoding="utf-8"))}
    for picture in (REPOSITORY / "docs" / "pictures").iterdir():
        largest = 150_000 if picture.name.startswith("optics_") else 300_000
        assert picture.stat().st_size < largest, f"{picture.name} is too large for a clone"
        assert any(link.endswith(picture.name) for link in shown), f"{picture.name} is in no page"


def test_the_readme_opens_with_a_picture_and_two_commands() -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    blocks = [block.strip() for block in re.split(r"\n\s*\n", text)]
    assert blocks[0].startswith("# ")
    assert blocks[1].startswith("![")
    assert text.index("make demo\nmake test") < text.index("## Filtered rays")


def test_tables_have_as_many_cells_in_each_row() -> None:
    for path in PAGES:
        text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
        for a, b in pairwise(text.splitlines()):
            if a.startswith("|") and b.startswith("|"):
                cells = [len(re.split(r"(?<!\\)\|", line)) for line in (a, b)]
                assert cells[0] == cells[1], f"{path.name}: {b}"
