"""Figures of silhouettes as Markdown: the sections of docs/results.md."""

from importlib.util import find_spec
from typing import Any

from silhouette_gpu import least
from silhouette_ways import FLOOR, MESH, OURS, PLAIN, POINTS


def section(found: dict[str, Any], command: str) -> str:
    """The section of docs/results.md."""
    on_gpu = found["device"] == "cuda"
    lines = gpu_facts(found) if on_gpu else cpu_facts(found)
    lines[-1] += f" Gradients are those in pose and points. Written by `{command}`."
    lines.append("")
    if on_gpu:
        lines += gpu_correctness(found)
    for table in found["tables"]:
        lines += table_lines(table)
    if on_gpu:
        lines += ceiling_lines(found)
    if "losses" in found:
        lines += losses_lines(found["losses"])
    if "step" in found:
        lines += [step_line(found["step"]), ""]
    if failed := found.get("failures"):
        lines += ["What failed:", "", *(f"- {what}" for what in failed), ""]
    return "\n".join(lines)


def cpu_facts(found: dict[str, Any]) -> list[str]:
    absent = "" if find_spec("pytorch3d") else " PyTorch3D cannot be imported here (no wheel)."
    return [
        "## Silhouettes",
        "",
        f"Medians of {found['rounds']} rounds in turns (one CPU thread, CPU time).{absent}",
    ]


def gpu_facts(found: dict[str, Any]) -> list[str]:
    settings = "; ".join(f"{name} {t['best']}" for name, t in found.get("tune", {}).items())
    settings = f" The best of these settings, found before: {settings}." if settings else ""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    return [
        "## Silhouettes on a GPU",
        "",
        f"{found['name']}; {versions}. Medians of {found['rounds']} rounds of many runs between "
        "two events, on sets of inputs that take turns; graph: replays of a CUDA graph."
        f"{settings}",
    ]


def gpu_correctness(found: dict[str, Any]) -> list[str]:
    lines = []
    if "differences" in found:
        ours, plain = (found["differences"][way] for way in (OURS, PLAIN))
        lines += [f"| greatest difference to double precision | {OURS} | {PLAIN} |"]
        lines += ["| --- | ---: | ---: |"]
        lines += [f"| {name} | {by:.1e} | {plain[name]:.1e} |" for name, by in ours.items()]
        lines += ["", "Of coverage; gradients as a share of the greatest one.", ""]
    if "replay" in found:
        lines += [f"A replayed graph with new inputs differs by {found['replay']:.1e}.", ""]
    return lines


def table_lines(table: dict[str, Any]) -> list[str]:
    """Milliseconds of every way, and how many times the floor the last column is."""
    rows = table["rows"]
    columns = list(rows[FLOOR])
    title = f"batch {table['batch']}, {POINTS} points, {table['pixels']}²"
    lines = [f"| {title} | " + " | ".join(f"{c} ms" for c in columns) + " | × floor |"]
    lines.append("| --- |" + " ---: |" * (len(columns) + 1))
    for name, times in rows.items():
        cells = [f"{times[c]:{digits(times[c])}}" if c in times else "failed" for c in columns]
        if name == MESH:
            cells = [cell.replace("failed", "–") if "graph" in c else cell
                     for c, cell in zip(columns, cells, strict=True)]  # fmt: skip
        last = columns[-1] if columns else ""
        ratio = f"{times[last] / rows[FLOOR][last]:.1f}" if last in times else ""
        lines.append(f"| {name} | " + " | ".join([*cells, ratio]) + " |")
    return [*lines, ""]


def digits(ms: float) -> str:
    return ".2f" if ms >= 1 else ".3f"


def ceiling_lines(found: dict[str, Any]) -> list[str]:
    """What our way achieves of the least that must be moved and done, beside the ceilings."""
    top = found.get("ceilings")
    if top is None:
        return []
    tera = {name: f"{rate / 1e12:.1f}" for name, rate in top.items()}
    lines = [
        f"Ceilings in the same run: a copy of 1 GiB {top['copy'] / 1e9:.0f} GB/s (read and "
        f"written); products of 8192²: bfloat16 {tera['bfloat16']}, TF32 {tera['TF32']}, float32 "
        f"{tera['float32']} TFLOP/s. Beside them r2art's graphs, by the fewest "
        "bytes and operations that any way needs:",
        "",
        "| r2art, graph | ms | least MB | GB/s | of the copy | least MFLOP | GFLOP/s "
        "| of float32 | floor ms |",
        "| --- |" + " ---: |" * 8,
    ]
    for table in found["tables"]:
        for column, back in (("fwd", False), ("fwd + bwd", True)):
            ms = table["rows"][OURS].get(f"{column}, graph")
            if ms is None:
                continue
            moved, done = least(table["batch"], table["pixels"], back=back)
            rate, work = 1e3 * moved / ms, 1e3 * done / ms
            bound = 1e3 * max(moved / top["copy"], done / top["float32"])
            lines.append(
                f"| batch {table['batch']}, {table['pixels']}², {column} | {ms:.3f} "
                f"| {moved / 1e6:.1f} | {rate / 1e9:.0f} | {100 * rate / top['copy']:.1f} % "
                f"| {done / 1e6:.0f} | {work / 1e9:.0f} | {100 * work / top['float32']:.1f} % "
                f"| {bound:.4f} |"
            )
    return [*lines, ""]


def losses_lines(losses: list[dict[str, Any]]) -> list[str]:
    lines = ["| pixel loss and gradient, 2 parts | plain ms | r2art ms | × faster |"]
    lines.append("| --- | ---: | ---: | ---: |")
    for t in losses:
        lines.append(
            f"| batch {t['batch']}, {t['pixels']}² | {t['plain']:{digits(t['plain'])}} "
            f"| {t['ours']:{digits(t['ours'])}} | {t['plain'] / t['ours']:.1f} |"
        )
    return [*lines, ""]


def step_line(t: dict[str, float]) -> str:
    share = t["cascade"] / (t["cascade"] + t["trunk"])
    return (
        f"In a step of the recipe `tiny` the cascade (two renderings, all losses, gradients) takes "
        f"{t['cascade']:.1f} ms and the trunk {t['trunk']:.0f} ms: {100 * share:.1f} %."
    )
