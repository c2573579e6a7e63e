# SPDX-License-Identifier: LGPL-2.1-or-later
"""The command ``raymaps``: a thin face over the library. Heavy packages are imported by the command that needs them.

Exit codes: 0 done; 2 wrong usage; 3 bad scene, map or criterion (one sentence on standard error); 4 interrupted, can be
resumed.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raymaps.errors import Interrupted, RayMapsError
from raymaps.progress import ProgressStyle, choice_tellers, teller_of
from raymaps.target_options import (
    TargetDetector,
    TargetEllipse,
    TargetError,
    TargetRect,
    TargetWhere,
    TimeLimit,
    duration_s,
    flux_asked,
    four,
    target_asked,
)
from raymaps.units import format_bytes, format_duration, format_estimate, format_quantity

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["app", "main"]

app = typer.Typer(
    name="raymaps",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Trace light through a scene, keep every ray, and ask about them afterwards.\n\n"
    "Example: `raymaps trace lens.scene.json -o lens.raymap`, then "
    '`raymaps query lens.raymap "hit(Barrel) & detector(Sensor)"`.',
)


class StoredLight(str, Enum):
    """How light is stored."""

    rgb = "rgb"
    spectral = "spectral"


#: Faults that ``check`` tells in words.
MAX_FAULTS = 10

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, NAME.scene.json.", show_default=False)]
MapFolder = Annotated[Path, typer.Argument(metavar="MAP", help="Ray Map, NAME.raymap.", show_default=False)]
SceneOrMap = Annotated[Path, typer.Argument(metavar="SCENE|MAP", help="Scene file or Ray Map.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Where = Annotated[str | None, typer.Option("--where", metavar="CRITERION", help="Only rays that match.")]


def main() -> None:
    """Run the command; ends the process with its exit code."""
    try:
        code = _run()
        sys.stdout.flush()
    except (_ReaderGone, BrokenPipeError):
        _close_stdout()
        code = 0
    except OSError as error:
        _close_stdout()
        code = _tell(f"The output can't be written: {(error.strerror or str(error)).lower()}.", 3)
    sys.exit(code)


def _run() -> int:
    try:
        app()
    except SystemExit as done:  # how typer ends, also after wrong usage
        return done.code if isinstance(done.code, int) else 0
    except RayMapsError as error:
        return _tell(str(error), 3)
    except Interrupted as error:
        return _tell(str(error), 4)
    except MemoryError:
        return _tell("There is not enough memory for this; ask about fewer rays, or trace with fewer threads.", 3)
    return 0


class _ReaderGone(Exception):  # noqa: N818  not an error
    """Whoever read our output has enough, for instance ``head``."""


def _say(text: str) -> None:
    """Print a result on standard output."""
    try:
        print(text)
    except BrokenPipeError:
        raise _ReaderGone from None


def _close_stdout() -> None:
    """Let what can't be written any more go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _tell(sentence: str, code: int) -> int:
    print(f"raymaps: {sentence}", file=sys.stderr)
    return code


def _print_json(data: dict[str, Any]) -> None:
    _say(json.dumps(data, ensure_ascii=False))


@app.command(
    epilog="Examples: `raymaps trace lamp.scene.json -o lamp.raymap --rays 1000000`; to know what the detector Screen "
    "registers to 1 %, with 10 million rays and in 5 minutes at most: `raymaps trace lamp.scene.json -o lamp.raymap "
    "--target Screen --target-error 1% --rays 10000000 --time-limit 5min`."
)
def trace(
    scene: SceneFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="MAP", help="Ray Map to make.")],
    rays: Annotated[
        int | None,
        typer.Option(min=1, help="Number of rays; by default the scene's. With a target the most, then 100 times it."),
    ] = None,
    target_error: TargetError = None,
    target: TargetDetector = None,
    target_rect: TargetRect = None,
    target_ellipse: TargetEllipse = None,
    target_where: TargetWhere = None,
    time_limit: TimeLimit = None,
    seed: Annotated[int | None, typer.Option(min=0, max=2**64 - 1, help="Seed; by default the scene's.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, max=1024, help="By default one a processor.")] = None,
    store: Annotated[
        StoredLight | None, typer.Option(help="What is kept of spectral light; by default as the scene says.")
    ] = None,
    portion: Annotated[int | None, typer.Option(min=1, max=10_000_000, help="Rays of a portion.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a map, or add rays to it.")] = False,
    progress: Annotated[ProgressStyle | None, typer.Option(help="By default a bar on a terminal.")] = None,
) -> None:
    """Simulate a scene and store every ray.

    Ctrl-C stops after the portions that are being traced; the map is valid and `--resume` goes on with it.
    """
    aim = target_asked(target_error, target, four(target_rect, "--target-rect"),
                       four(target_ellipse, "--target-ellipse"), target_where)  # fmt: skip
    time_limit_s = duration_s(time_limit)
    from raymaps.results.info import target_line
    from raymaps.results.ledger import energy_ledger
    from raymaps.run import simulate

    stop = threading.Event()
    _stop_on_signals(stop)
    style = progress or (ProgressStyle.bar if sys.stderr.isatty() else ProgressStyle.none)
    with teller_of(style, output, _print_json) as teller:
        raymap = simulate(
            scene, output, rays=rays, seed=seed, threads=threads, resume=resume, portion_rays=portion,
            store=store.value if store else None, on_progress=teller.progress, on_note=teller.note, stop=stop,
            target=aim, time_limit_s=time_limit_s,
        )  # fmt: skip
    ledger = energy_ledger(raymap)
    if style is ProgressStyle.json:
        fluxes = {key: getattr(ledger, key) for key in ("emitted_w", "absorbed_w", "escaped_w", "killed_w")}
        done = {"event": "done", "map": str(output), "rays": raymap.n_rays, "events": raymap.n_events}
        aimed = {"target": raymap.manifest.target} if raymap.manifest.target else {}
        _print_json({**done, "elapsed_s": round(teller.elapsed_s, 3), **fluxes, **aimed})
        return
    _say(
        f"{output}: {raymap.n_rays} rays, {raymap.n_events} events, {format_bytes(raymap.n_bytes)}, "
        f"{format_duration(teller.elapsed_s)}"
    )
    _say(_ledger_line(ledger))
    if raymap.manifest.target:
        _say(target_line(raymap.manifest.target))
    _say_switched_off(raymap)


def _ledger_line(ledger: Any) -> str:
    parts = {"absorbed": ledger.absorbed_w, "left the scene": ledger.escaped_w, "killed": ledger.killed_w}
    shares = ", ".join(f"{name} {100 * flux / (ledger.emitted_w or 1):.4g} %" for name, flux in parts.items())
    return f"emitted {format_quantity(ledger.emitted_w, 'W')}: {shares}"


def _stop_on_signals(stop: threading.Event) -> None:
    """Ctrl-C and terminate set ``stop``; a second one ends the process at once (the map stays valid)."""

    def handle(number: int, frame: Any) -> None:
        if stop.is_set():
            os._exit(4)
        stop.set()

    for name in ("SIGINT", "SIGTERM"):
        signal.signal(getattr(signal, name), handle)


@app.command()
def info(map_: MapFolder, as_json: AsJson = False) -> None:
    """What a map holds, and where its light went."""
    from raymaps.results.info import map_info
    from raymaps.store import RayMap

    facts = map_info(RayMap.open(map_))
    _print_json(facts.to_dict()) if as_json else _say(facts.to_text())


@app.command()
def query(
    map_: MapFolder,
    criterion: Annotated[str, typer.Argument(metavar="CRITERION", help="For instance hit(Lens) & ~detector(Sensor).")],
    limit: Annotated[int | None, typer.Option(min=0, help="Stop once so many rays are found.")] = None,
    as_json: AsJson = False,
) -> None:
    """Which rays match a criterion, and how much light they carry."""
    from raymaps.criterion import query as ask
    from raymaps.store import RayMap

    raymap = RayMap.open(map_)
    found = ask(raymap, criterion, limit)
    if as_json:
        _print_json({**found.to_dict(), **_switched_off(raymap)})
        return
    if found.flux_w is not None and found.flux_stderr_w is not None and found.interval_w is not None:
        flux = format_estimate(found.flux_w, found.flux_stderr_w, found.interval_w)
        _say(f"{found.rays} of {found.scanned} rays match: {flux}")
    else:
        _say(f"{found.rays} of the first {found.scanned} rays match; without --limit all are counted and the flux told")
    if found.rays:
        shown = found.ids[: 10 if limit is None else limit]
        _say("rays " + ", ".join(map(str, shown)) + (" ..." if len(shown) < found.rays else ""))
    _say_switched_off(raymap)


def _switched_off(raymap: RayMap) -> dict[str, list[str]]:
    """Effects that were switched off, if any."""
    off = list(raymap.scene.settings.without)
    return {"without": off} if off else {}


def _say_switched_off(raymap: RayMap) -> None:
    for off in _switched_off(raymap).values():
        _say(f"without {', '.join(off)} (switched off)")


@app.command()
def paths(
    map_: MapFolder,
    where: Where = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the largest so many.")] = None,
    as_json: AsJson = False,
) -> None:
    """Distinct paths with their flux, largest first."""
    from raymaps.results.paths import distinct_paths
    from raymaps.store import RayMap

    shown = limit if as_json or limit else 30
    raymap = RayMap.open(map_)
    table = distinct_paths(raymap, where, shown)
    if as_json:
        _print_json({**table.to_dict(), **_switched_off(raymap)})
        return
    _say(table.to_text())
    _say_switched_off(raymap)


@app.command()
def report(
    map_: MapFolder,
    where: Where = None,
    limit: Annotated[int, typer.Option(min=1, help="How many rays.")] = 20,
    output: Annotated[Path | None, typer.Option("--output", "-o", help=".html, .csv or .txt file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Histories of rays: where they were, what happened, on which property, how much light was left."""
    from raymaps.results.report import report as tell
    from raymaps.store import RayMap

    histories = tell(RayMap.open(map_), where, limit)
    if output is not None:
        histories.write(output)
        _say(f"{output}: {len(histories.rays)} rays")
    elif as_json:
        _print_json(histories.to_dict())
    else:
        _say(histories.to_text())


def _pair(text: str | None, option: str, separator: str = "x") -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.lower().split(separator)
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise typer.BadParameter(f"two whole numbers as in 100x80 are wanted, got '{text}'", param_hint=option)
    return int(parts[0]), int(parts[1])


@app.command()
def detector(
    map_: MapFolder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Detector.")],
    resolution: Annotated[
        str | None,
        typer.Option(metavar="NXxNY", help="Cells; of a far field half planes C and steps in gamma."),
    ] = None,
    max_angle: Annotated[
        float | None,
        typer.Option(metavar="DEG", min=0, max=180, help="Acceptance angle; of a far field the largest gamma."),
    ] = None,
    source: Annotated[str | None, typer.Option(metavar="NAME", help="Light of this source only.")] = None,
    where: Where = None,
    rect: Annotated[str | None, typer.Option(metavar="X0,Y0,X1,Y1", help="Region in mm.")] = None,
    ellipse: Annotated[str | None, typer.Option(metavar="CX,CY,RX,RY", help="Region in mm.")] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help=".png, .csv or .npz file; of a far field also .ies or .ldt."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Light on a detector, with other parameters if wanted, without simulating again."""
    from raymaps.results.detector import evaluate_detector
    from raymaps.store import RayMap

    if rect and ellipse:
        raise typer.BadParameter("a region is a rectangle or an ellipse, not both", param_hint="--ellipse")
    evaluated = evaluate_detector(
        RayMap.open(map_), name, resolution=_pair(resolution, "--resolution"), max_angle_deg=max_angle, source=source,
        where=where, rect=four(rect, "--rect"), ellipse=four(ellipse, "--ellipse"),
    )  # fmt: skip
    if output is not None:
        evaluated.write(output)
    _print_json(evaluated.to_dict()) if as_json else _say(evaluated.to_text())


@app.command()
def explain(what: SceneOrMap, as_json: AsJson = False) -> None:
    """Which effects a scene calls for, and by what; of a map also the share of the time that each took."""
    from raymaps.results.explanation import explain as explained

    explanation = explained(what)
    _print_json(explanation.to_dict()) if as_json else _say(explanation.to_text())


@app.command(
    epilog="Example: `raymaps accuracy lamp.scene.json --target Screen -o lamp.png` traces for some seconds and tells "
    "how long it takes until what Screen registers is known to 10 %, 1 % and 0.1 %, with each choice that there is."
)
def accuracy(
    what: SceneOrMap,
    target: TargetDetector = None,
    target_rect: TargetRect = None,
    target_ellipse: TargetEllipse = None,
    target_where: TargetWhere = None,
    seconds: Annotated[float, typer.Option(min=1, max=3600, help="How long to try, about.")] = 8.0,
    threads: Annotated[int | None, typer.Option(min=1, max=1024, help="By default one a processor.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help=".png file with time against error.")] = None,
    progress: Annotated[ProgressStyle | None, typer.Option(help="json: a line for each choice, then all.")] = None,
    as_json: AsJson = False,
) -> None:
    """What accuracy costs in time: by sampling, surfaces and bands, from short runs that are thrown away."""
    aim = flux_asked(target, four(target_rect, "--target-rect"), four(target_ellipse, "--target-ellipse"),
                       target_where)  # fmt: skip
    from raymaps.accuracy import check_plot, forecast, plot

    if output is not None:
        check_plot(output)
    stop = threading.Event()
    _stop_on_signals(stop)
    style = progress or (ProgressStyle.bar if sys.stderr.isatty() else ProgressStyle.none)
    tell_choice, tell_note = choice_tellers(style, _print_json)
    found = forecast(
        what, aim, seconds=seconds, threads=threads, on_choice=tell_choice, on_note=tell_note, stop=stop
    )  # fmt: skip
    if output is not None:
        plot(found, output)
    is_lines = style is ProgressStyle.json
    event = {"event": "done"} if is_lines else {}
    _print_json({**event, **found.to_dict()}) if as_json or is_lines else _say(found.to_text())
    if output is not None and not (as_json or is_lines):
        _say(str(output))


@app.command()
def view(
    what: SceneOrMap,
    output: Annotated[Path, typer.Option("--output", "-o", help=".png or .html file.")],
    where: Where = None,
    rays: Annotated[int, typer.Option(min=0, help="At most so many rays.")] = 300,
) -> None:
    """Picture of a scene, or of a map with the rays that match a criterion."""
    from raymaps.results.pictures import view as draw

    draw(what, output, where, rays)
    _say(str(output))


@app.command()
def check(what: SceneOrMap, as_json: AsJson = False) -> None:
    """Everything that is wrong with a scene or a map, in words; a map is read whole and its checksums verified."""
    from raymaps.check import check as examine

    findings = examine(what)
    faults = [finding.text for finding in findings if finding.is_fault]
    if as_json:
        _print_json({"sound": not faults, "findings": [finding.to_dict() for finding in findings]})
    else:
        for finding in findings:
            if not finding.is_fault:
                _say(f"note: {finding.text}")
        if not faults:
            _say(f"{what}: sound")
    for text in faults[:MAX_FAULTS]:
        print(f"raymaps: {text}", file=sys.stderr)
    if len(faults) > MAX_FAULTS:
        print(f"raymaps: and {len(faults) - MAX_FAULTS} more faults, all in --json.", file=sys.stderr)
    if faults:
        raise typer.Exit(3)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scene files."""
    from raymaps.scene import scene_json_schema

    _say(json.dumps(scene_json_schema(), indent=1))


@app.command()
def serve(map_: MapFolder) -> None:
    """Answer requests about a map: JSON-RPC 2.0, one object a line, on standard input and output."""
    from raymaps.serve import serve as answer

    answer(map_)
