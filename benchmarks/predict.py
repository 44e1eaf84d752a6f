"""How long r2art takes for a photo of 640 × 480, where the time goes, and how large it is.

python benchmarks/predict.py                              prints Markdown
python benchmarks/predict.py --install                    measures a clean base install too
python benchmarks/predict.py --results docs/results.md    writes the page's section on speed
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnxruntime as ort
from PIL import Image

from r2art.core.image import crop_square, letterbox, read_image
from r2art.learn.results import write_section
from r2art.run.predictor import SHIPPED_MODEL, Predictor, choose_camera, load

ROOT = Path(__file__).resolve().parent.parent
PHOTO = ROOT / "examples" / "laptop.png"
WARM_UP = 10


def median_ms(work: Callable[[], object], runs: int) -> float:
    """Median time (ms) of a call, after some that do not count."""
    times = []
    for k in range(WARM_UP + runs):
        start = time.perf_counter()
        work()
        if k >= WARM_UP:
            times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


def small_photo(source: Path, folder: Path) -> Path:
    """The photo as a JPEG of 640 × 480, as a camera would write it."""
    path = folder / "photo.jpg"
    with Image.open(source) as image:
        image.convert("RGB").resize((640, 480)).save(path, quality=90)
    return path


def warm_times(predictor: Predictor, model: Path, path: Path, runs: int) -> dict[str, float]:
    """Median ms of a whole `predict`, of its steps, and of the bare network."""
    network = predictor.model
    photo = read_image(path)
    camera, _ = choose_camera(photo, None)
    seen = predictor.predict(photo)
    category = network.categories[predictor.categories.index(seen.category)]
    size, margin = network.input_size, network.crop_margin
    whole = letterbox(photo.pixels, camera, size)
    crop = crop_square(photo.pixels, camera, seen.box, size, margin)
    box = crop.from_photo(seen.box)

    options = ort.SessionOptions()
    options.intra_op_num_threads = min(cores(), 4)
    session = ort.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    inputs = {
        "image": crop.pixels[None],
        "K": crop.camera.K[None].astype(np.float32),
        "box": np.asarray([box], np.float32),
    }
    return {
        "decode the JPEG": median_ms(lambda: read_image(path), runs),
        "letterbox": median_ms(lambda: letterbox(photo.pixels, camera, size), runs),
        "network: box and category": median_ms(lambda: network.find(whole), runs),
        "crop": median_ms(lambda: crop_square(photo.pixels, camera, seen.box, size, margin), runs),
        "network: poses, once": median_ms(lambda: network.pose(crop, box, category), runs),
        "whole `predict`": median_ms(lambda: predictor.predict(path), runs),
        "whole `predict` without refinement": median_ms(
            lambda: predictor.predict(path, refine=0), runs
        ),
        "whole `predict`, box and category given": median_ms(
            lambda: predictor.predict(path, category=seen.category, box=seen.box), runs
        ),
        "bare network in ONNX Runtime, once": median_ms(lambda: session.run(None, inputs), runs),
    }


def start_to_result(path: Path, model: Path, runs: int) -> float:
    """Median seconds of a new process that predicts one photo and writes its JSON."""
    command = [str(Path(sys.executable).with_name("r2art")), "predict", str(path), "--json"]
    command += ["--model", str(model)]
    times = []
    for _ in range(runs + 1):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    return statistics.median(times[1:])


def install_sizes(folder: Path) -> tuple[float, float]:
    """MB that `pip install .` adds to an empty environment, all dependencies included.

    Before Python has compiled it, which is what is downloaded and unpacked, and after.
    """
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv" / "bin" / "python"
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = subprocess.run([python, "-c", ask], check=True, capture_output=True, text=True)
    site = Path(packages.stdout.strip())
    compile_all = [python, "-m", "compileall", "-q", str(site)]
    subprocess.run(compile_all, check=False, stdout=subprocess.DEVNULL)
    empty = folder_mb(site)
    install = [python, "-m", "pip", "install", "--quiet", "--no-compile", str(ROOT)]
    subprocess.run(install, check=True)
    if (site / "torch").exists():
        raise SystemExit("the base install pulls in torch")
    installed = folder_mb(site)
    subprocess.run(compile_all, check=False, stdout=subprocess.DEVNULL)
    return installed - empty, folder_mb(site) - empty


def folder_mb(folder: Path) -> float:
    """Size (MB) of all files in a folder."""
    return sum(p.lstat().st_size for p in folder.rglob("*") if not p.is_dir()) / 1e6


def cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor() -> str:
    """Name of the CPU, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def report(times: dict[str, float], model: Path, others: dict[str, str], flags: str) -> str:
    """The section of docs/results.md."""
    whole = times["whole `predict` without refinement"]
    bare = times["bare network in ONNX Runtime, once"]
    size = model.stat().st_size / 1e6
    rows = [f"| {name} | {ms:.2f} ms |" for name, ms in times.items()]
    runs = 3  # at the photo, at the crop, and at the tightened crop through all guessed cameras
    share = whole / bare / runs
    rows.append(f"| that without refinement over its {runs} runs of the network | {share:.2f} |")
    rows += [f"| {name} | {value} |" for name, value in others.items()]
    facts = (
        f"A JPEG of 640 × 480, `{model.name}` ({size:.1f} MB), ONNX Runtime {ort.__version__}, "
        f"Python {platform.python_version()}, {cores()} cores of {processor()}; medians, warm "
        f"unless said. Measured by `python benchmarks/predict.py{flags}`."
    )
    return "\n".join(["## Speed and size", "", facts, "", "| | |", "| --- | ---: |", *rows])


def main() -> None:
    parser = argparse.ArgumentParser(description="Time r2art on one photo.")
    parser.add_argument("--photo", type=Path, default=PHOTO, help="any photo; it is resized")
    parser.add_argument("--model", type=Path, default=Path(str(SHIPPED_MODEL)))
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--install", action="store_true", help="also measure a clean install")
    parser.add_argument("--results", type=Path, help="write the section on speed of this page")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        photo = small_photo(args.photo, folder)
        times = warm_times(load(args.model), args.model, photo, args.runs)
        others = {
            "process start to JSON, files cached": f"{start_to_result(photo, args.model, 5):.2f} s"
        }
        if args.install:
            plain, compiled = install_sizes(folder)
            others["base install with all dependencies"] = f"{plain:.0f} MB"
            others["the same with Python's compiled bytecode"] = f"{compiled:.0f} MB"
    flags = " --install" if args.install else ""
    flags += " --results docs/results.md" if args.results else ""
    section = report(times, args.model, others, flags)
    print(section)
    if args.results:
        write_section(args.results, "speed", section)


if __name__ == "__main__":
    main()
