"""The bench's figures as a table, in Markdown and in the terminal, and as a chart."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.contenders import CONTENDERS
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style, save
from pneumo.publish.text.markdown_tables import markdown_table

NOT_INSTALLED = "not installed: pip install .[bench]"


def rows(results: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Rows of the table: what, how much, and beside what."""
    ns, lines = results["ns_per_lane_evaluation"], []
    for name, contender in CONTENDERS.items():
        if name not in ns:
            lines.append((contender.label, NOT_INSTALLED, ""))
            continue
        gain = results["gain"][f"over_{name}"]
        aim = f", aim {results['least_gain'][name]}" if name in results["least_gain"] else ""
        beside = f"kernel {gain:.3g} times as fast{aim}" if name != "kernel" else "published signals"
        lines.append((contender.label, f"{ns[name]:.4g} ns per lane-evaluation", beside))
    exact = results["kernel_exact_transport_ns"]
    lines.append(("pneumo, fast kernel", f"{exact:.4g} ns per lane-evaluation", "exact signals"))
    for name, times in results["instruction_sets"].items():
        cycles = f"{times['bound']['cycles_per_8_lanes']:.0f} cycles per 8 lanes at"
        bound = f"{100 * times['fraction_of_bound']:.0f} % of a bound of {times['bound_ns']:.3g} ns, {cycles}"
        kernel = f"{times['ns_per_lane_evaluation']['kernel']:.4g} ns per lane-evaluation"
        lines.append((f"kernel with {name}", kernel, f"{bound} {times['bound']['clock_GHz']:.2f} GHz"))
    for name, seconds in results["wall_s"].items():
        lines.append((f"snakemake -j2, {name}", f"{seconds:.1f} s", ""))
    lines.append(("replays and statistics of the study", f"{results['replay_wall_s']:.1f} s", "aim 20 s"))
    lines.append(("start of jobs", f"{100 * results['job_overhead']:.0f} %", "of the time of all jobs"))
    lines.append(("biggest job", f"{results['peak_memory_gib']:.2f} GiB", "aim 1.5 GiB"))
    lines.append(("results/", f"{results['results_mb']:.0f} MB", "aim 400 MB"))
    return lines


def markdown(results: dict[str, Any]) -> str:
    """Return the table in Markdown, the processor above it."""
    table = markdown_table(["quantity", "measured", "beside"], rows(results))
    return f"Measured on {results['cpu']}.\n\n{table}\n"


def show(results: dict[str, Any]) -> None:
    """Print the table."""
    table = Table("quantity", "measured", "beside", title=f"Bench on {results['cpu']}")
    for row in rows(results):
        table.add_row(*map(escape, row))
    Console().print(table)


def chart(results: dict[str, Any], stem: Path) -> None:
    """Draw ns per lane-evaluation of every contender as bars on a logarithmic axis, the bound as a line."""
    ns = results["ns_per_lane_evaluation"]
    names = sorted(ns, key=lambda name: ns[name], reverse=True)
    with paper_style():
        fig = new_figure(DOUBLE_MM, 12 + 8 * len(names))
        ax = fig.add_subplot()
        color = [ACCENT if name in ("kernel", "scalar") else GREY for name in names]
        bars = ax.barh([CONTENDERS[name].label for name in names], [ns[name] for name in names], color=color)
        ax.bar_label(bars, [f"{ns[name]:.3g}" for name in names], padding=3)
        ax.axvline(results["bound_ns"], color=INK, linestyle="--", linewidth=0.8)
        ax.set_xscale("log")
        ax.set_xlim(results["bound_ns"] / 2, 2 * max(ns.values()))
        bound = f"dashed: {results['bound_ns']:.2g} ns, bound of the arithmetic"
        ax.set_xlabel(axis_label(f"time per lane-evaluation; {bound}", "ns"))
        ax.tick_params(axis="y", length=0)
        save(fig, stem)
