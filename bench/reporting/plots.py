"""The figures of chapter 5 of the thesis, with present and published curves, as reproducible SVG files."""
import pathlib

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "jfpx"
import matplotlib.pyplot as plt  # noqa: E402

from .tables import crossover, parts  # noqa: E402


def curves(machine):
    """{backend: [(n, ms)]} of the thesis bench."""
    found = {}
    for (backend, n), b in parts(machine.get("thesis")):
        if backend != "auto":
            found.setdefault(backend, []).append((int(n), b["median_ms"]))
    return {backend: sorted(points) for backend, points in found.items()}


def drawn_curves(machine):
    """{backend: [(n, ms)]} of the rendering bench, with rendering."""
    found = {}
    for (mode, backend, n), b in parts(machine.get("rendering")):
        if mode == "on":
            found.setdefault(backend, []).append((int(n), b["median_ms"]))
    return {backend: sorted(points) for backend, points in found.items()}


def figure(title, limit=None):
    fig, axes = plt.subplots(figsize=(7, 4.5))
    axes.set(xscale="log", yscale="log", xlabel="spheres", ylabel="ms per frame", title=title)
    axes.grid(True, which="both", linewidth=0.3)
    if limit:
        axes.set_xlim(1.7, limit)
    return fig, axes


def draw_published(axes, rows, label):
    for backend, style in (("cpu", "C7o--"), ("cuda", "C8s--")):
        axes.plot([r["spheres"] for r in rows], [r[f"{backend}_mean_ms"] for r in rows], style,
                  markersize=3, label=f"2010 {label}{backend}")
    for r in rows:
        if "cpu_note" in r:
            axes.annotate("file of N = 16", (r["spheres"], r["cpu_mean_ms"]), textcoords="offset points",
                          xytext=(4, -12), fontsize=7)
            axes.plot([r["spheres"]], [r["cpu_mean_ms"]], "rx")


def save(fig, axes, path):
    axes.legend(fontsize=7)
    fig.tight_layout()
    fig.savefig(path, metadata={"Date": None})
    plt.close(fig)


def draw(found, folder):
    machines, published = found
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, title, limit in (("figure_5_1", "Detection, rendering off (thesis figure 5.1)", 2e6),
                               ("figure_5_2", "The same for small numbers (figure 5.2)", 600)):
        fig, axes = figure(title, limit)
        draw_published(axes, published["rendering_off"], "")
        for machine in machines:
            mine = curves(machine)
            for backend, points in mine.items():
                shown = [(n, ms) for n, ms in points if n <= limit]
                axes.plot(*zip(*shown), marker=".", label=f"{machine.name} {backend}")
            if "cuda" in mine:
                cuda = dict(mine["cuda"])
                n = crossover([(n, ms, cuda[n]) for n, ms in mine["cpu"] if n in cuda])
                if n and n <= limit:
                    axes.axvline(n, color="C3", linewidth=0.6)
        save(fig, axes, folder / f"{name}.svg")
    fig, axes = figure("Detection while every frame is drawn (thesis figure 5.3)", 600)
    draw_published(axes, published["rendering_on"], "")
    for machine in machines:
        for backend, points in drawn_curves(machine).items():
            axes.plot(*zip(*points), marker=".", label=f"{machine.name} {backend}")
    save(fig, axes, folder / "figure_5_3.svg")
