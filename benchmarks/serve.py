"""How `r2art serve` bears many clients at once: what they get, how fast, and what it costs.

python benchmarks/serve.py                            prints Markdown
python benchmarks/serve.py --results docs/serve.md    writes the page's section on it

The server is a process of its own, started for this on a free port of 127.0.0.1, and nothing
else is ever asked. Every client is a thread with one connection, which asks again as soon as it
has its answer; told 503, it waits as long as it is told to.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import httpx
import numpy as np
from PIL import Image

from r2art.learn.results import write_section

ROOT = Path(__file__).resolve().parent.parent
PHOTO = ROOT / "examples" / "laptop.png"
ALLOWED = {200, 429, 503}
MOST_DRIFT = 0.1  # of the memory after warming up
WARM_UP = 5.0  # s


@dataclass
class Tally:
    """What one client got: each answer's status, and the ms it took."""

    statuses: Counter[int] = field(default_factory=Counter)
    times: dict[int, list[float]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)


def client(url: str, photo: bytes, until: float, tally: Tally) -> None:
    """Ask until the time is over."""
    headers = {"Content-Type": "image/jpeg"}
    with httpx.Client(timeout=60) as session:
        while time.monotonic() < until:
            start = time.perf_counter()
            try:
                answer = session.post(f"{url}/predict", content=photo, headers=headers)
            except httpx.HTTPError as error:
                tally.failures.append(repr(error))
                continue
            tally.statuses[answer.status_code] += 1
            ms = 1e3 * (time.perf_counter() - start)
            tally.times.setdefault(answer.status_code, []).append(ms)
            if answer.status_code in (429, 503):
                wait = float(answer.headers["retry-after"])
                time.sleep(max(0.0, min(wait, until - time.monotonic())))


def load(url: str, photo: bytes, clients: int, seconds: float) -> Tally:
    """What so many clients got in so many seconds, all together."""
    until = time.monotonic() + seconds
    tallies = [Tally() for _ in range(clients)]
    threads = [threading.Thread(target=client, args=(url, photo, until, t)) for t in tallies]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    total = Tally()
    for tally in tallies:
        total.statuses += tally.statuses
        total.failures += tally.failures
        for status, times in tally.times.items():
            total.times.setdefault(status, []).extend(times)
    return total


def memory_mb(pid: int) -> float:
    """What a process holds in memory (MB), as the kernel tells."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise SystemExit(f"process {pid} has no memory")


def small_photo(source: Path) -> bytes:
    """The photo as a JPEG of 640 × 480."""
    with tempfile.TemporaryFile() as file, Image.open(source) as image:
        image.convert("RGB").resize((640, 480)).save(file, "JPEG", quality=90)
        file.seek(0)
        return file.read()


def measured(
    options: list[str], photo: bytes, clients: int, seconds: float
) -> tuple[Tally, float, float]:
    """What the clients got, and the server's memory (MB) before and after."""
    command = [sys.executable, "-m", "r2art", "serve", "--port", "0", *options]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stderr=log)
        try:
            url = listening(process, log)
            load(url, photo, clients, WARM_UP)
            before = memory_mb(process.pid)
            tally = load(url, photo, clients, seconds)
            after = memory_mb(process.pid)
        finally:
            process.terminate()
            process.wait(60)
    return tally, before, after


def listening(process: subprocess.Popen[bytes], log: IO[str]) -> str:
    """The server's address, as soon as it answers there."""
    for _ in range(600):
        log.seek(0)
        line = log.readline()
        if line.endswith("\n"):
            return json.loads(line)["url"]
        if process.poll() is not None:
            raise SystemExit(f"the server has ended: {line}")
        time.sleep(0.1)
    raise SystemExit("the server does not start")


def row(name: str, times: list[float]) -> str:
    """Percentiles of times (ms) as a row of a table."""
    p = np.percentile(times, [50, 90, 99, 100])
    return f"| {name} | {len(times)} | " + " | ".join(f"{v:.0f} ms" for v in p) + " |"


def cores() -> str:
    """How many cores this process, and what it starts, may use."""
    count = len(os.sched_getaffinity(0))
    return "one core" if count == 1 else f"{count} cores"


def report(tally: Tally, before: float, after: float, args: argparse.Namespace) -> str:
    """The section of docs/serve.md."""
    names = {200: "200, answered", 429: "429", 503: "503, told to come back"}
    rows = [row(names.get(s, str(s)), tally.times[s]) for s in sorted(tally.times)]
    rows.append(f"| connections that failed | {len(tally.failures)} | | | | |")
    rate = tally.statuses[200] / args.seconds
    flags = " --results docs/serve.md" if args.results else ""
    facts = (
        f"{args.clients} clients for {args.seconds:g} s on loopback, each with a JPEG of 640 × 480 "
        f"and asking again at once, or after the time a 503 names; `r2art serve "
        f"{' '.join(args.options) or '(default options)'}`, Python {platform.python_version()}, "
        f"clients and server together on {cores()}. Measured by "
        f"`python benchmarks/serve.py{flags}`."
    )
    drift = (
        f"{rate:.1f} predictions per second. Memory of the server after {WARM_UP:g} s of the same "
        f"load {before:.0f} MB, at the end {after:.0f} MB ({100 * (after / before - 1):+.1f} %)."
    )
    head = ["| status | answers | median | 90 % | 99 % | slowest |", "| --- |" + " ---: |" * 5]
    return "\n".join(["## Many clients at once", "", facts, "", *head, *rows, "", drift])


def main() -> int:
    parser = argparse.ArgumentParser(description="Load `r2art serve` on this machine.")
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--results", type=Path, help="write this page's section on it")
    parser.add_argument("options", nargs="*", help="for r2art serve, after --")
    args = parser.parse_args()
    tally, before, after = measured(args.options, small_photo(PHOTO), args.clients, args.seconds)
    section = report(tally, before, after, args)
    print(section)
    faults = [f"status {s}" for s in tally.statuses if s not in ALLOWED] + tally.failures[:5]
    if not tally.statuses[200]:
        faults.append("nobody was answered")
    if after > (1 + MOST_DRIFT) * before:
        faults.append(f"memory grew from {before:.0f} to {after:.0f} MB")
    if faults:
        print("\nnot as it should be: " + "; ".join(faults), file=sys.stderr)
        return 1
    if args.results:
        write_section(args.results, "serve", section)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
