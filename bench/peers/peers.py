#!/usr/bin/env python3
"""Steps of the same scenes by jfpx and by other rigid-body engines on the CPU, by turns in one run, as tables in
Markdown: time of a step, and quality after the last one.

    peers.py                                              all engines that are installed, all scenes
    peers.py --scenes pit,hulls --engines jfpx,box3d --repeat 5

Every run of an engine is a process of its own. With one thread, it runs on a single CPU, and the time is the
processor time of this process during the step: a busy machine does not add to it, though it shares caches.
With several threads, it runs on as many CPUs, and the time is that of a clock: nothing else may run, and
engines without threads are left out.
An engine that is not installed is left out, with the reason:

    jfpx     its Python module (docs/python.md)
    box3d    BOX3D_LIBRARY: path of a shared library of Box3D, single precision
    jolt     JOLTC_LIBRARY: path of a shared library of joltc, single precision
    rapier   package rapier3d of PyPI
    bullet   packages libbullet-dev and pkg-config, and a C++ compiler
    mujoco   package mujoco of PyPI

Quality is measured by the collision detection of jfpx, for all engines; without jfpx, the depths are missing.
"""

import argparse
import gc
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import engines
import quality
import scenes


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engines", default=",".join(engines.NAMES), help="[%(default)s]")
    parser.add_argument("--scenes", default=",".join(scenes.SCENES), help="[%(default)s]")
    parser.add_argument("--threads", type=int, default=1, help="number of threads of an engine [%(default)s]")
    parser.add_argument("--repeat", type=int, default=3, help="number of turns [%(default)s]")
    parser.add_argument("--steps", type=int, default=scenes.STEPS, help="of a run [%(default)s]")
    parser.add_argument("--limit", type=float, default=120, metavar="S",
                        help="time after which a run ends early, and is not repeated [%(default)s]")
    parser.add_argument("--label", action="append", default=[], metavar="ENGINE=TEXT",
                        help="text for the version of an engine, such as a commit")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write all results to this file")
    parser.add_argument("--child", nargs=2, metavar=("ENGINE", "FILE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    for chosen, known in ((options.engines, engines.NAMES), (options.scenes, scenes.SCENES)):
        for name in chosen.split(","):
            if name not in known:
                parser.error(f"{name} is unknown; known: {', '.join(known)}")
    cpus = len(os.sched_getaffinity(0))
    if not 1 <= options.threads <= cpus:
        parser.error(f"--threads must be 1 to {cpus}, the number of CPUs")
    return options


def run_here(engine, file, options):
    """Runs one scene with one engine, and writes times and last states."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-options.threads:])
    scene, make = scenes.SCENES[options.scenes][0](), engines.load(engine)
    world = make(scene, options.threads) if options.threads > 1 else make(scene)
    clock = time.process_time if options.threads == 1 else time.perf_counter
    gc.collect()
    gc.disable()
    times = []
    while len(times) < options.steps and sum(times) < options.limit:
        begin = clock()
        world.step()
        times.append(clock() - begin)
    np.savez(file, times=1e3 * np.array(times), **{f"s{i}": x for i, x in enumerate(world.states())})


def run(engine, name, options):
    with tempfile.TemporaryDirectory() as folder:
        file = f"{folder}/run.npz"
        command = [sys.executable, os.path.abspath(__file__), "--child", engine, file, "--scenes", name,
                   "--steps", str(options.steps), "--limit", str(options.limit), "--threads", str(options.threads)]
        environment = dict(os.environ, OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
        try:
            # A single step may exceed the limit.
            done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder,
                                  timeout=60 + 4 * options.limit)
        except subprocess.TimeoutExpired:
            return None
        if done.returncode != 0:
            print(f"{engine} fails in {name}: {done.stderr[-2000:]}", file=sys.stderr, flush=True)
            return None
        with np.load(file) as data:
            return {"times": data["times"], "states": [data[f"s{i}"] for i in range(4)]}


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def row(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def time_words(result, base):
    if result is None:
        return "fails"
    words = f"{statistics.median(result['means']):.3g}"
    if result["early"]:
        words += f" (first {result['steps']} steps)"
    elif base is not None and base is not result:
        ratio = statistics.median(a / b for a, b in zip(result["means"], base["means"]))
        words += f" ({ratio:.2f})"
    return words


def ended_early(result, options):
    return result is None or len(result["times"]) < options.steps


def measure(options, used):
    """A dict of the results by scene and engine: runs by turns, medians of the means."""
    means, last, made = {}, {}, {}
    chosen = options.scenes.split(",")
    for turn in range(options.repeat):
        for name in chosen:
            for engine in used:
                if turn > 0 and ended_early(last.get((name, engine)), options):
                    continue
                result = run(engine, name, options)
                print(f"turn {turn + 1}: {name}, {engine}: "
                      + (f"{result['times'].mean():.3f} ms" if result else "fails"), file=sys.stderr, flush=True)
                if result:
                    means.setdefault((name, engine), []).append(float(result["times"].mean()))
                    last[name, engine] = result
    for (name, engine), result in last.items():
        early = ended_early(result, options)
        made.setdefault(name, {})[engine] = {
            "means": means[name, engine], "steps": len(result["times"]), "early": early,
            "quality": None if early else quality.measures(name, scenes.SCENES[name][0](), result["states"])}
    return made


def main():
    options = parse()
    if options.child:
        run_here(*options.child, options)
        return
    labels = dict(label.split("=", 1) for label in options.label)
    used = {}
    for name in options.engines.split(","):
        world = engines.load(name)
        if options.threads > 1 and not world.threaded:
            print(f"{world.name} is left out: it has one thread", file=sys.stderr, flush=True)
            continue
        try:
            used[name] = (world.name, ", ".join(filter(None, (world.version(), labels.get(name)))))
        except engines.Unavailable as reason:
            print(f"{world.name} is left out: {reason} is missing", file=sys.stderr, flush=True)
    load = os.getloadavg()[1]
    results = measure(options, used)
    print(f"{processor()}, {os.cpu_count()} CPUs, load {load:.1f} to {os.getloadavg()[1]:.1f}, "
          f"{time.strftime('%Y-%m-%d')}, {options.steps} steps of 1/60 s, {options.repeat} turns, threads: {options.threads}\n")
    row("engine", "version", "settings")
    row(*["---"] * 3)
    for name, (title, version) in used.items():
        row(title, version, engines.load(name).settings)
    print("\nMean time of a step, ms: median of the turns (median of the ratios to jfpx in a turn):\n")
    titles = [title for title, _ in used.values()]
    row("scene", *titles)
    row(*["---"] * (len(titles) + 1))
    for name in results:
        base = results[name].get("jfpx")
        row(scenes.SCENES[name][1], *(time_words(results[name].get(engine), base) for engine in used))
    print("\nAfter the last step: deepest penetration, mm; root mean square of the speeds, mm/s; of the pyramid,"
          "\nlargest displacement, mm; of the figures and the net, largest error of a joint, mm:\n")
    row("scene", *titles)
    row(*["---"] * (len(titles) + 1))
    for name in results:
        cells = [results[name].get(engine) for engine in used]
        row(scenes.SCENES[name][1],
            *(quality.words(cell["quality"]) if cell and cell["quality"] else "" for cell in cells))
    if options.json:
        options.json.write_text(
            json.dumps({"processor": processor(), "engines": used, "results": results}, indent=1))


if __name__ == "__main__":
    main()
