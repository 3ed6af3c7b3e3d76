"""Generates build/benchmarks.md from the files in bench/results."""
import math

BULLET_STAGES = ("integrate", "broadphase", "dispatch", "islands", "solve", "step")
NATIVE_STAGES = ("integrate", "detect", "resolve")


def number(value):
    """The value with three significant digits."""
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]) + "\n"


def parts(benchmarks):
    """Pairs of the parts of a benchmark's name, without the name of the program, and its values."""
    return [(name.split("/")[1:], b) for name, b in benchmarks.items()]


def crossover(rows):
    """The n at which the ratio of two curves reaches 1, by log-log interpolation of (n, first, second)
    rows. None if the first curve is always faster or always slower."""
    rows = sorted(rows)
    for (n0, a0, b0), (n1, a1, b1) in zip(rows, rows[1:]):
        low, high = math.log(a0 / b0), math.log(a1 / b1)
        if low < 0 <= high:
            return math.exp(math.log(n0) + (math.log(n1) - math.log(n0)) * -low / (high - low))
    return None


def exponent(points):
    """Slope of the least-squares line through (log n, log time)."""
    logs = [(math.log(n), math.log(t)) for n, t in points if n > 0 and t > 0]
    if len(logs) < 2:
        return None
    mean_n = sum(n for n, _ in logs) / len(logs)
    mean_t = sum(t for _, t in logs) / len(logs)
    spread = sum((n - mean_n) ** 2 for n, _ in logs)
    return sum((n - mean_n) * (t - mean_t) for n, t in logs) / spread if spread else None


def origin(machine, bench, precision="float"):
    context = machine.context(bench, precision)
    load = f", load {context['load_avg']:.1f}" if "load_avg" in context else ""
    version = f", jfpx {context['version']}" if context.get("version") else ""
    return (f"`{context['command']}`, {context['date'][:10]}{load}{version}; data: "
            f"[{bench}_{precision}.json](../bench/results/{machine.name}/{bench}_{precision}.json)\n")


def automatic(machine):
    rows = []
    benchmarks = machine.get("automatic")
    if not benchmarks:
        return ""
    for (scene, n), b in parts(benchmarks):
        fixed = {key.removesuffix("_us"): value for key, value in b.items()
                 if key.endswith("_us") and key != "automatic_us"}
        best = min(fixed, key=fixed.get)
        rows.append([scene, n, number(b["contacts"]) if b["contacts"] < 100 else int(b["contacts"]),
                     *[number(fixed[k] / fixed[best]) if k in fixed else "" for k in columns(benchmarks)],
                     best.replace("_", " "), b.get("label", ""), f"{b['ratio']:.2f}"])
    double = machine.get("automatic", "double")
    in_double = f" In double: {verdict(double)}." if double else ""
    head = ["scene", "N", "contacts", *[k.replace("_", " ") for k in columns(benchmarks)], "best fixed",
            "automatic chose last", "automatic / best"]
    return ("### The automatic choice\n\n" + origin(machine, "automatic") +
            f"\nThe columns of fixed choices are times divided by the best time of the row. `automatic`: "
            f"{verdict(benchmarks)}.{in_double}\n\n" + table(head, rows) + "\n")


def verdict(benchmarks):
    ratios = [b["ratio"] for b in benchmarks.values()]
    over = sum(ratio > 1.1 for ratio in ratios)
    return f"worst ratio {max(ratios):.2f}; {over} of {len(ratios)} rows exceed 1.10"


def columns(benchmarks):
    names = []
    for b in benchmarks.values():
        names += [k.removesuffix("_us") for k in b
                  if k.endswith("_us") and k != "automatic_us" and k.removesuffix("_us") not in names]
    return names


def thesis(machine, published):
    ours = {}
    for (backend, n), b in parts(machine.get("thesis")):
        ours.setdefault(int(n), {})[backend] = b
    if not ours:
        return ""
    old = {row["spheres"]: row for row in published["rendering_off"]}
    rows = []
    for n in sorted(ours):
        cpu, cuda = ours[n].get("cpu"), ours[n].get("cuda")
        o = old.get(n)
        mark = " (1)" if o and "cpu_note" in o else ""
        rows.append([n, int(cpu["iterations"]), number(cpu["real_time"]), number(cpu["median_ms"]),
                     number(cpu["first_ms"]), number(cpu["contacts"]),
                     *([number(cuda[k]) for k in ("real_time", "median_ms", "first_ms")] +
                       [number(cpu["median_ms"] / cuda["median_ms"])] if cuda else [""] * 4),
                     *([number(o["cpu_mean_ms"]) + mark, number(o["cuda_mean_ms"]),
                        number(o["cpu_mean_ms"] / o["cuda_mean_ms"]) + mark] if o else [""] * 3)])
    text = ("### Detection in `boxes-and-balls` (figures 5.1 and 5.2 of the thesis)\n\n" +
            origin(machine, "thesis") + "\nTime of contact generation per frame [ms], measured as in the "
            "thesis, without rendering: mean over the frames, median, and the first frame separately. Ratios "
            "are ratios of medians. \"2010\" marks the published means.\n\n" +
            table(["N", "frames", "cpu mean", "median", "first", "contacts", "cuda mean", "median", "first",
                   "cpu / cuda", "2010 cpu", "2010 cuda", "2010 cpu / cuda"], rows) +
            "\n(1) The published CPU file for 32 spheres is that of 16, byte for byte.\n\n")
    with_cuda = [(n, b["cpu"]["median_ms"], b["cuda"]["median_ms"]) for n, b in ours.items() if "cuda" in b]
    here = crossover(with_cuda) if with_cuda else None
    there = crossover([(n, r["cpu_mean_ms"], r["cuda_mean_ms"]) for n, r in old.items()
                       if "cpu_note" not in r])
    text += f"CUDA is faster from N = {there:.0f} in the published data (without the doubtful point)"
    text += (f", from N = {here:.0f} here.\n\n" if here else ".\n\n")
    last = max(n for n in old if n in ours)
    return text + (f"At N = {last} the CPU backend takes 1 / "
                   f"{number(old[last]['cpu_mean_ms'] / ours[last]['cpu']['median_ms'])} of the published "
                   "time, on a different processor and in an optimised build.\n\n")


def stages(machine):
    benchmarks = parts(machine.get("stages"))
    if not benchmarks:
        return ""
    rows, series = [], {}
    for (scene, backend, n), b in benchmarks:
        for stage in NATIVE_STAGES:
            series.setdefault((scene, backend, stage), []).append((int(n), b[f"{stage}_ms"]))
        rows.append([scene, backend, n, number(b["contacts"]),
                     *[number(b[f"{s}_ms"]) for s in NATIVE_STAGES], number(b["real_time"]),
                     number(1e6 * b["detect_ms"] / int(n)), int(b["allocations"]), b.get("label", "")])
    fits = []
    for scene, backend in dict.fromkeys((s, b) for s, b, _ in series):
        slopes = [exponent(series[scene, backend, stage]) for stage in NATIVE_STAGES]
        fits.append([scene, backend, *[f"{x:.2f}" if x is not None else "" for x in slopes]])
    return ("### Stages of a native step with `worst_first`\n\n" + origin(machine, "stages") +
            "\nMedians in ms. Allocations are those of the median step.\n\n" +
            table(["scene", "backend", "N", "contacts", *NATIVE_STAGES, "step", "detect ns per sphere",
                   "allocations", "computed last by"], rows) +
            "\nExponent p of time ~ N^p:\n\n" + table(["scene", "backend", *NATIVE_STAGES], fits) + "\n" +
            floors(machine, benchmarks))


def floors(machine, benchmarks):
    """The minimum of memory traffic and operations of each stage, and the ratio of the time to it."""
    context = machine.context("stages")
    if "copied_gb_a_second" not in context:
        return ""
    gb, giga = float(context["copied_gb_a_second"]), float(context["giga_operations_a_second"])
    rows = []
    for (scene, backend, n), b in benchmarks:
        if backend == "auto":
            continue
        row = [scene, backend, n]
        for stage in NATIVE_STAGES:
            size, operations = b[f"{stage}_bytes"], b[f"{stage}_operations"]
            floor = 1e-6 * max(size / gb, operations / giga)
            row += [number(size / 1e3), number(operations / 1e3), number(b[f"{stage}_ms"] / floor)]
        rows.append(row)
    head = [f"{stage} {what}" for stage in NATIVE_STAGES for what in ("kB", "kop", "x floor")]
    return ("Minimum of memory traffic (kB) and operations (kop, thousands) of each stage, and the ratio of its time "
            "to the larger of both at the rates of one core measured in the same run: "
            f"{number(gb)} GB/s of copies, {number(giga)} billion operations/s in 128-bit vectors. The operations "
            "are counted in `bench/world/floor.hpp`: per contact, per update of a body, and per iteration of the "
            "resolver. A ratio below 1 means that a stage works in caches, in wider vectors, or on a GPU.\n\n" +
            table(["scene", "backend", "N", *head], rows) + "\n")


def rendering(machine, published):
    ours = {}
    for (mode, backend, n), b in parts(machine.get("rendering")):
        ours.setdefault((backend, int(n)), {})[mode] = b
    ours = {key: modes for key, modes in ours.items() if "on" in modes}
    if not ours:
        return ""
    off, on = ({row["spheres"]: row for row in published[f"rendering_{mode}"]} for mode in ("off", "on"))
    rows = []
    for (backend, n), modes in sorted(ours.items(), key=lambda item: (item[0][0] != "cpu", item[0][1])):
        mark = " (1)" if f"{backend}_note" in off[n] else ""
        before, after = off[n][f"{backend}_mean_ms"], on[n][f"{backend}_mean_ms"]
        rows.append([backend, n, *[number(modes[m][k]) for m in ("off", "on")
                                   for k in ("real_time", "median_ms", "first_ms")],
                     f"{modes['on']['median_ms'] / modes['off']['median_ms']:.2f}",
                     number(modes["on"]["picture_ms"]), number(before) + mark, number(after),
                     f"{after / before:.2f}{mark}"])
    frames = int(next(iter(ours.values()))["on"]["iterations"])
    return ("### With rendering (figure 5.3)\n\n" + origin(machine, "rendering") +
            f"\nTime of contact generation per frame [ms] over {frames} frames, without and with rendering of each "
            f"frame: {machine.context('rendering')['pictures']}, without a screen. \"picture\" is the median time "
            "of drawing. Ratios are ratios of medians; \"2010\" marks the published means.\n\n" +
            table(["backend", "N", "off mean", "median", "first", "on mean", "median", "first", "on / off", "picture",
                   "2010 off", "2010 on", "2010 on / off"], rows) +
            "\n(1) The published CPU file for 32 spheres without rendering is that of 16, byte for byte.\n\n" +
            "Drawing between two detections evicts data from the caches of the processor, and a GPU switches from "
            "drawing to computing with a delay.\n\n")


def bullet(machine):
    benchmarks = parts(machine.get("bullet_step"))
    if not benchmarks:
        return ""
    shares, ratios = [], []
    for (scene, n), b in benchmarks:
        shares.append([scene, n, number(b["step_stock_ms"]),
                       *[f"{100 * b[f'{s}_stock_ms'] / b['step_stock_ms']:.0f} %" for s in BULLET_STAGES[:-1]]])
        gain = b["step_ratio"]
        ratios.append([scene, n, *[f"{b[f'{s}_ratio']:.2f}" for s in BULLET_STAGES],
                       "yes" if gain > 1.03 else "no" if gain > 0.97 else "slower"])
    return ("### Bullet's step in its parts\n\n" + origin(machine, "bullet_step") +
            "\nStock Bullet: ms per step, and the share of each stage.\n\n" +
            table(["scene", "N", "step", *BULLET_STAGES[:-1]], shares) +
            "\nStock / jfpx, medians of the ratios of single steps on one thread: above 1, jfpx is faster. All parts "
            "are jfpx's except Bullet's AABB tree, in which the broad phase of jfpx searches for several pairs at a "
            "time. Both worlds end with equal hashes.\n\n" +
            table(["scene", "N", *BULLET_STAGES, "gain"], ratios) + "\n")


def precisions(machine):
    rows = []
    for bench, key in (("thesis", "median_ms"), ("stages", "detect_ms"), ("stages", "integrate_ms"),
                       ("stages", "resolve_ms")):
        single, double = machine.get(bench), machine.get(bench, "double")
        for name in single:
            if name not in double or "/auto/" in name or not single[name][key]:
                continue
            *what, n = name.split("/")
            if bench == "thesis" and int(n) not in (16, 448, 16384, 1000000):
                continue
            stage = "detect" if key == "median_ms" else key.removesuffix("_ms")
            rows.append(["/".join(what[1:]) if bench == "stages" else "tower/" + what[1], stage, n,
                         f"{double[name][key] / single[name][key]:.2f}"])
    if not rows:
        return ""
    ratios = sorted(float(r[-1]) for r in rows if r[1] == "detect")
    return ("### Double against float\n\n" + origin(machine, "stages", "double") +
            f"\nTime in double divided by time in float. The median for detection is "
            f"{ratios[len(ratios) // 2]:.2f}: vectors contain half as many spheres, and the memory traffic doubles. "
            "The thesis uses float only and leaves the comparison open (6.2).\n\n" +
            table(["scene", "stage", "N", "double / float"], rows) + "\n")


def document(found):
    machines, published = found
    text = ("# Benchmarks\n\nGenerated by `bench/report.py tables` from the files in `bench/results`; do not edit. "
            "`scripts/bench` measures this machine and regenerates this page. Worlds, solvers and Bullet at length are in the "
            "pages of [bench/results](../bench/results) that the [README](../README.md) cites.\n\nThe processors were shared with other "
            "work during the measurements: compare numbers within a table, not across machines or days. Times of a "
            "GPU are absolute.\n\n")
    for machine in machines:
        first = next(iter(machine.files.values()))["context"]
        text += f"## {first['machine']}\n\n"
        for section in (automatic(machine), thesis(machine, published), rendering(machine, published),
                        stages(machine), bullet(machine),
                        precisions(machine)):
            text += section
    return text.rstrip("\n") + "\n"
