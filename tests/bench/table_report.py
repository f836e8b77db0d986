# SPDX-License-Identifier: Apache-2.0
"""Tables of figures as Markdown, JSON and a picture: statistics over seeds, the published numbers
beside, and where the figures come from.

A table has columns and rows; each row names a variant (table_runs.py), and for each column where
its figure is in the report of dsg-eval. A cell without figures says why.
"""

import dataclasses
import datetime
import json
import os
import pathlib
import statistics
import subprocess
import sys

from table_runs import wanted

ROOT = pathlib.Path(__file__).resolve().parents[2]


@dataclasses.dataclass(frozen=True)
class Column:
    """A figure with its unit; `why` is the reason if dsg-eval has none. `paper` says that the
    published number stands beside it."""

    title: str
    digits: int
    scale: float = 1.0
    paper: bool = False
    why: str = "dsg-eval gives none"


@dataclasses.dataclass(frozen=True)
class Row:
    """`cells`: per column a path into the report ("mesh.rmse_m"), a function of the report, or None
    where the figure has no meaning. `paper`: by people, per column with a published number."""

    label: str
    variant: object
    cells: tuple
    paper: dict = dataclasses.field(default_factory=dict)
    is_small: bool = True


@dataclasses.dataclass(frozen=True)
class Table:
    name: str
    title: str
    row_title: str
    columns: tuple
    rows: tuple
    notes: tuple = ()
    paper_why: str = "not in the paper"
    # Of the picture: whether the first column's axis is logarithmic; otherwise it is per cent.
    is_log: bool = True


def narrowed(table, names):
    """The table with the rows alone whose variant has one of the names in its own."""
    return dataclasses.replace(table, rows=tuple(
        row for row in table.rows if any(name in row.variant.name for name in names)))


def value_of(report, cell):
    """A figure of a report, or None."""
    if callable(cell):
        return cell(report)
    for part in cell.split("."):
        report = report.get(part) if report is not None else None
    return report


def statistic(values, wanted):
    """Mean, standard deviation (of a sample; None for one), median and count of what is known."""
    known = [value for value in values if value is not None]
    if not known:
        return {"mean": None, "sd": None, "median": None, "count": 0, "wanted": wanted}
    return {"mean": statistics.fmean(known),
            "sd": statistics.stdev(known) if len(known) > 1 else None,
            "median": statistics.median(known), "count": len(known), "wanted": wanted}


def fill(table, logs, runner, is_small=False):
    """The lines of a table: for each crowd and row the statistics of each column over the seeds."""
    crowds = list(dict.fromkeys(log.people for log in logs))
    lines = []
    for people in crowds:
        of_crowd = [log for log in logs if log.people == people]
        for row in table.rows:
            if (is_small and not row.is_small) or not row.variant.says_something_of(of_crowd[0]):
                continue
            known = {log.seed: runner.known(log, row.variant) for log in of_crowd}
            lines.append({"people": people, "label": row.label,
                          "cells": [cell_of(column, path, known)
                                    for column, path in zip(table.columns, row.cells)],
                          "paper": list(row.paper.get(people, ()))})
    return lines


def cell_of(column, path, known):
    if path is None:
        return {**statistic([], 0), "why": None, "by_seed": {}}
    by_seed = {}
    reasons = []
    for seed, (report, why) in known.items():
        value = None if report is None else value_of(report, path)
        by_seed[seed] = value if value is None or column.scale == 1.0 else value * column.scale
        if value is None:
            reasons.append(why if report is None else column.why)
    return {**statistic(by_seed.values(), len(known)),
            "why": "; ".join(dict.fromkeys(reasons)) or None, "by_seed": by_seed}


class Reasons:
    """Numbers the reasons of empty cells below a table."""

    def __init__(self):
        self.of = {}

    def mark(self, reason):
        return f"[{self.of.setdefault(reason, len(self.of) + 1)}]"

    def lines(self):
        return [f"[{number}] {reason}" for reason, number in self.of.items()]


def cell_text(cell, digits, reasons):
    """`mean ± standard deviation (median)`; the figure alone if there is one; else a mark."""
    if not cell["wanted"]:
        return ""
    if not cell["count"]:
        return "- " + reasons.mark(cell["why"])
    known = [value for value in cell["by_seed"].values() if value is not None]
    # A single count is a whole number.
    text = str(known[0]) if len(known) == 1 and isinstance(known[0], int) else \
        f"{cell['mean']:.{digits}f}"
    if cell["sd"] is not None:
        text += f" ± {cell['sd']:.{digits}f} ({cell['median']:.{digits}f})"
    if cell["count"] < cell["wanted"]:
        text += f", {cell['count']} of {cell['wanted']} {reasons.mark(cell['why'])}"
    return text


def crowd(people):
    """What a line is of: so many people, or a recorded log by its name."""
    return f"{people} people" if isinstance(people, int) else people


def markdown_row(cells):
    return "| " + " | ".join(cells) + " |"


def markdown_of(table, lines):
    """The table, what its marks mean, and its notes."""
    is_crowd = all(isinstance(line["people"], int) for line in lines)
    head = ["people" if is_crowd else "log", table.row_title]
    for column in table.columns:
        if column.paper:
            head.append(f"paper, {column.title.rsplit(', ', 1)[-1]}")
        head.append(column.title)
    reasons = Reasons()
    out = [f"## {table.title}", "", markdown_row(head), "|" + "---|" * len(head)]
    for line in lines:
        paper = iter(line["paper"])
        cells = [str(line["people"]), line["label"]]
        for column, cell in zip(table.columns, line["cells"]):
            if column.paper:
                number = next(paper, None)
                # What is not a figure of ours has no published one either.
                cells.append(f"{number:g}" if number is not None else
                             "- " + reasons.mark(table.paper_why) if cell["wanted"] else "")
            cells.append(cell_text(cell, column.digits, reasons))
        out.append(markdown_row(cells))
    for text in [*reasons.lines(), *table.notes]:
        out += ["", text]
    return "\n".join(out) + "\n"


def git(*arguments):
    try:
        return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True,
                              check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def processor():
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return "unknown processor"


def provenance(command, logs, runner, variants, is_built):
    """Where figures come from: commit, programs (built from it or given), seeds, machine, command,
    dates."""
    rows = [runner.scores.known[key] for log in logs for variant in variants
            if (key := runner.key(log, variant)) in runner.scores.known]
    dates = sorted(row["date"] for row in rows)
    commit = git("rev-parse", "--short=10", "HEAD") or "unknown"
    # Of the commit are the programs; how the tables are printed changes no figure.
    changed = git("status", "--porcelain", "--untracked-files=no", "--", "schema", "ingest")
    return {"command": command, "commit": commit + (", changed since" if changed else ""),
            "programs": "built" if is_built else "given (--bin)",
            "programs_sha256": runner.build,
            "seeds": {crowd(people): [log.seed for log in logs if log.people == people]
                      for people in dict.fromkeys(log.people for log in logs)},
            "runs": len(rows), "runs_missing": wanted(logs, variants) - len(rows),
            "machine": f"{processor()}, {os.cpu_count()} cores",
            "runs_from": dates[0] if dates else None, "runs_to": dates[-1] if dates else None,
            "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")}


def provenance_text(origin):
    def text_of(seeds):
        return ", ".join("recorded" if seed is None else str(seed) for seed in seeds)

    seeds = "; ".join(f"{of}: {text_of(its)}" for of, its in origin["seeds"].items())
    missing = f", {origin['runs_missing']} are missing" if origin["runs_missing"] else ""
    rows = [("command", f"`{origin['command']}`"), ("commit", origin["commit"]),
            ("programs", f"{origin['programs']}, SHA-256 of dsg-ingest and dsg-eval "
                         f"`{origin['programs_sha256']}`"),
            ("seeds", seeds), ("runs", f"{origin['runs']}{missing}"),
            ("machine", origin["machine"]), ("written", origin["date"]),
            ("runs ended", f"{origin['runs_from']} to {origin['runs_to']}")]
    return "\n".join([markdown_row(["", ""]), "|---|---|", *[markdown_row(row) for row in rows]])


def link_to(page, folder):
    """A Markdown link from a folder of the repository; the name alone from elsewhere."""
    folder = folder.resolve()
    if not folder.is_relative_to(ROOT):
        return page
    return f"[{page}]({os.path.relpath(ROOT / page, folder)})"


def publish(path, title, preface, origin, tables):
    """Writes PATH.md, PATH.json and, if it can be drawn, PATH.png; `tables`: pairs of table and
    lines. "{evaluation}" in the preface becomes a link to that page."""
    path.parent.mkdir(parents=True, exist_ok=True)
    parts = [f"# {title}",
             preface.format(evaluation=link_to("docs/evaluation.md", path.parent)),
             provenance_text(origin)]
    picture = path.with_suffix(".png")
    if draw(tables, picture):
        parts.append(f"![The first figure of each table beside the paper's]({picture.name})")
    parts += [markdown_of(table, lines).rstrip("\n") for table, lines in tables]
    path.with_suffix(".md").write_text("\n\n".join(parts) + "\n")
    content = {**origin, "tables": [
        {"name": table.name, "title": table.title,
         "columns": [{"title": column.title, "paper": column.paper} for column in table.columns],
         "lines": lines} for table, lines in tables]}
    path.with_suffix(".json").write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def draw(tables, png):
    """Each table's first figure and the paper's, as points; False if there is nothing to draw,
    or nothing to draw with."""
    try:
        import matplotlib
    except ImportError:
        print("no picture: it needs python3-matplotlib", file=sys.stderr)
        return False
    matplotlib.use("Agg")
    from matplotlib import pyplot

    panels = [(table, [line for line in lines if line["cells"][0]["count"]])
              for table, lines in tables if table.columns[0].paper]
    panels = [(table, lines) for table, lines in panels if lines]
    if not panels:
        return False
    heights = [len(lines) + 3 for _, lines in panels]
    figure, axes = pyplot.subplots(len(panels), 1, figsize=(9, 0.24 * sum(heights)), squeeze=False,
                                   gridspec_kw={"height_ratios": heights})
    for axis, (table, lines) in zip(axes[:, 0], panels):
        draw_panel(axis, table, lines)
    axes[0, 0].legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.tight_layout()
    figure.savefig(png, dpi=100)
    pyplot.close(figure)
    return True


def draw_panel(axis, table, lines):
    from matplotlib import ticker

    at = range(len(lines))
    cells = [line["cells"][0] for line in lines]
    axis.errorbar([cell["mean"] for cell in cells], at, xerr=[cell["sd"] or 0.0 for cell in cells],
                  fmt="o", color="#1f5fa8", markersize=5, capsize=2, label="dsgdb (mean, sd)")
    with_paper = [(line["paper"][0], y) for y, line in zip(at, lines) if line["paper"]]
    if with_paper:
        axis.plot(*zip(*with_paper), "D", markersize=5, markerfacecolor="none",
                  markeredgecolor="#b3541e", label="paper")
    if table.is_log:
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
        axis.xaxis.set_minor_formatter(ticker.NullFormatter())
    else:
        axis.set_xlim(min(0.9 * axis.dataLim.x0, 90.0), 101.0)
    axis.set_yticks(at)
    axis.set_yticklabels([f"{crowd(line['people'])}, {line['label']}" for line in lines],
                         fontsize=8)
    axis.set_ylim(len(lines) - 0.4, -0.6)
    axis.grid(axis="x", color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.tick_params(axis="y", length=0)
    axis.set_title(f"{table.title}: {table.columns[0].title}", fontsize=9, loc="left")
