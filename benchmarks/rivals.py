# SPDX-License-Identifier: LGPL-2.1-or-later
"""DuckDB and Polars answering the same questions from the same Parquet files, as well as they can.

Rays meet signatures by the portion that both belong to and the number of the signature there, packed into one integer
(the fastest key of those tried: strings and pairs of columns are slower). Each question is written in several forms;
`best_form` tries all and keeps the fastest of each contestant. They count the matching rays and need not name them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import duckdb
import polars as pl

from benchmarks.questions import AreaQuestion, Step
from raymaps.store import RayMap

__all__ = ["DuckDb", "PolarsFrames", "best_form"]

Form = Callable[[], int]


def best_form(forms: dict[str, Form], trials: int = 3) -> tuple[str, Form]:
    """The fastest of several ways to the same answer; raises `AssertionError` if answers differ."""
    answers, seconds = {}, dict.fromkeys(forms, float("inf"))
    for _ in range(trials):
        for name, form in forms.items():
            started = time.perf_counter()
            answers[name] = form()
            seconds[name] = min(seconds[name], time.perf_counter() - started)
    if len(set(answers.values())) != 1:
        raise AssertionError(f"The forms of a question differ: {answers}")
    name = min(seconds, key=lambda name: seconds[name])
    return name, forms[name]


def _files(raymap: RayMap, table: str) -> list[str]:
    return [str(portion.folder / f"{table}.parquet") for portion in raymap.portions]


class DuckDb:
    """One connection; views on the files, and tables in memory once `load` was called."""

    def __init__(self, raymap: RayMap, threads: int):
        self._connection = duckdb.connect(config={"threads": threads})
        self._connection.execute("SET parquet_metadata_cache = true")
        key = "(file_index << 32) | signature AS path"
        columns = {"rays": f"ray, {key}", "signatures": f"{key}, * EXCLUDE signature", "crossings": "*"}
        for name, select in columns.items():
            files = _files(raymap, name)
            self._connection.execute(f"CREATE VIEW {name}_files AS SELECT {select} FROM read_parquet({files!r})")

    def load(self) -> None:
        for name in ("rays", "signatures", "crossings"):
            self._connection.execute(f"CREATE TABLE {name}_memory AS SELECT * FROM {name}_files")

    def steps(self, steps: tuple[Step, ...], where: str) -> dict[str, Form]:
        """Ways to count the rays whose signature owns all steps and none of the negated."""
        rays, table = f"rays_{where}", f"signatures_{where}"
        conditions = [_sql(step) for step in steps]
        either = " OR ".join(f"({c})" for c in conditions)
        having = " AND ".join(
            f"{'NOT ' if s.negated else ''}bool_or({c})" for s, c in zip(steps, conditions, strict=True)
        )
        marked = f"SELECT path FROM {table} WHERE {either} GROUP BY path HAVING {having}"
        combined = " ".join(
            f"{'' if i == 0 else 'EXCEPT' if step.negated else 'INTERSECT'} SELECT path FROM {table} WHERE {c}"
            for i, (step, c) in enumerate(zip(steps, conditions, strict=True))
        )
        counted = f"(SELECT path, count(*) AS n FROM {rays} GROUP BY path)"
        return {
            "marks": self._form(f"SELECT count(*) FROM {rays} SEMI JOIN ({marked}) USING (path)"),
            "sets": self._form(f"SELECT count(*) FROM {rays} SEMI JOIN ({combined}) USING (path)"),
            "counted first": self._form(f"SELECT sum(n) FROM {counted} SEMI JOIN ({marked}) USING (path)"),
        }

    def area(self, area: AreaQuestion, where: str) -> dict[str, Form]:
        """Ways to count the rays that cross a detector in an area."""
        inside = (
            f"detector = {area.detector} AND x_mm BETWEEN {area.x_mm[0]} AND {area.x_mm[1]} AND "
            f"y_mm BETWEEN {area.y_mm[0]} AND {area.y_mm[1]} AND "
            f"angle_rad >= {area.angle_rad[0]} AND angle_rad < {area.angle_rad[1]}"
        )
        rays = f"SELECT ray FROM crossings_{where} WHERE {inside}"
        return {
            "distinct": self._form(f"SELECT count(DISTINCT ray) FROM ({rays})"),
            "semi join": self._form(f"SELECT count(*) FROM rays_{where} SEMI JOIN ({rays}) USING (ray)"),
        }

    def _form(self, sql: str) -> Form:
        def count() -> int:
            row = self._connection.execute(sql).fetchone()
            assert row is not None
            return int(row[0])

        return count


def _sql(step: Step) -> str:
    return " AND ".join(
        f"{column} = {values[0]}" if len(values) == 1 else f"{column} IN {values}" for column, values in step.columns
    )


class PolarsFrames:
    """Lazy frames over the files, and over frames in memory once `load` was called.

    Polars uses as many threads as ``POLARS_MAX_THREADS`` said when it was imported.
    """

    def __init__(self, raymap: RayMap):
        self._frames = {"files": {name: _scan(raymap, name) for name in ("rays", "signatures", "crossings")}}

    def load(self) -> None:
        frames = pl.collect_all(list(self._frames["files"].values()))
        self._frames["memory"] = {
            name: frame.rechunk().lazy() for name, frame in zip(self._frames["files"], frames, strict=True)
        }

    def steps(self, steps: tuple[Step, ...], where: str) -> dict[str, Form]:
        """Ways to count the rays whose signature owns all steps and none of the negated."""
        frames = self._frames[where]
        conditions = [_expression(step) for step in steps]
        names = [f"step{i}" for i in range(len(steps))]
        paths = frames["signatures"].filter(pl.any_horizontal(conditions)).group_by("path")
        marked = paths.agg([c.any().alias(name) for c, name in zip(conditions, names, strict=True)]).filter(
            [~pl.col(name) if step.negated else pl.col(name) for step, name in zip(steps, names, strict=True)]
        )
        joined: pl.LazyFrame | None = None
        for step, condition in zip(steps, conditions, strict=True):
            selected = frames["signatures"].filter(condition).select("path")
            kind: Any = "anti" if step.negated else "semi"
            joined = selected.unique() if joined is None else joined.join(selected, on="path", how=kind)
        assert joined is not None
        forms: dict[str, Form] = {}
        for name, found in (("marks", marked.select("path")), ("joins", joined)):
            forms |= _both_engines(name, frames["rays"].join(found, on="path", how="semi").select(pl.len()))
        return forms

    def area(self, area: AreaQuestion, where: str) -> dict[str, Form]:
        """Ways to count the rays that cross a detector in an area."""
        rows = self._frames[where]["crossings"].filter(
            pl.col("detector") == area.detector,
            pl.col("x_mm").is_between(*area.x_mm),
            pl.col("y_mm").is_between(*area.y_mm),
            pl.col("angle_rad").is_between(*area.angle_rad, closed="left"),
        )
        sorted_ray = pl.col("ray").set_sorted()
        return _both_engines("distinct", rows.select(pl.col("ray").n_unique())) | _both_engines(
            "distinct of sorted", rows.select(sorted_ray.n_unique())
        )


def _scan(raymap: RayMap, table: str) -> pl.LazyFrame:
    if table == "crossings":
        return pl.scan_parquet(_files(raymap, table))
    parts = []
    for index, file in enumerate(_files(raymap, table)):
        path = (pl.lit(index << 32, pl.Int64) + pl.col("signature").cast(pl.Int64)).alias("path")
        parts.append(pl.scan_parquet(file).with_columns(path).drop("signature"))
    return pl.concat(parts)


def _expression(step: Step) -> pl.Expr:
    return pl.all_horizontal([pl.col(c) == v[0] if len(v) == 1 else pl.col(c).is_in(list(v)) for c, v in step.columns])


def _both_engines(name: str, frame: pl.LazyFrame) -> dict[str, Form]:
    return {
        name: lambda: int(frame.collect().item()),
        f"{name}, streaming": lambda: int(frame.collect(engine="streaming").item()),
    }
