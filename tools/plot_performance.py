#!/usr/bin/env python3
"""Plots and tables of docs/performance.md from the files that tools/performance.sh writes."""
import argparse
import json
import pathlib
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot, ticker  # noqa: E402

OURS = "#c2410c"
STYLE = {
    "svg.fonttype": "none", "svg.hashsalt": "swarmfit", "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "axes.grid.which": "major", "grid.color": "#e5e5e5", "axes.axisbelow": True, "legend.frameon": False,
}
PLANE_FMA = 3
BEGIN, END = "<!-- figures: tools/performance.sh writes from here -->", "<!-- to here -->"


def read(folder, name):
    file = folder / name
    return json.loads(file.read_text()) if file.exists() else None


def save(figure, file):
    figure.savefig(file, metadata={"Date": None}, bbox_inches="tight")
    pyplot.close(figure)
    # matplotlib ends some lines with a blank
    file.write_text("".join(line.rstrip() + "\n" for line in file.read_text().splitlines()))
    print(f"wrote {file}")


def plot_growth(reports, axis, title, file):
    """Evaluations a second over points or particles; brute force, pruned and the limit, for each count of threads."""
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6))
    greys = ["#9ca3af", "#374151"]
    for index, report in enumerate(reports):
        threads = report["limit"]["threads"]
        width = 1 + 0.8 * index
        for pruning, colour, name in ((False, greys[-1], "brute force"), (True, OURS, "pruned")):
            rows = sorted((r for r in report["results"] if r["pruning"] == pruning), key=lambda r: r[axis])
            axes.plot([r[axis] for r in rows], [r["evaluations_per_s"] / 1e9 for r in rows], marker="o", markersize=3, linewidth=width,
                      color=colour, alpha=0.55 if index == 0 and len(reports) > 1 else 1,
                      label=f"{name}, {threads} thread{'s' * (threads > 1)}")
        axes.axhline(report["limit"]["fma_per_s"] / PLANE_FMA / 1e9, linestyle="--", linewidth=width, color="#2563eb",
                     alpha=0.55 if index == 0 and len(reports) > 1 else 1, label=f"multiply-add limit, {threads} thread{'s' * (threads > 1)}")
    axes.set(xscale="log", yscale="log", xlabel=title, ylabel="effective evaluations, 10⁹ a second")
    axes.yaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    save(figure, file)


def plot_peers(report, file):
    """Median and quartiles of the whole job, a panel a cloud."""
    scenes = report["scenes"]
    columns = 2
    lines = -(-len(scenes) // columns)
    tallest = max(len(s["contenders"]) for s in scenes)
    figure, panels = pyplot.subplots(lines, columns, figsize=(9, lines * (0.7 + 0.21 * tallest)), squeeze=False, sharex=True)
    names = [c["name"] for c in scenes[0]["contenders"]][::-1]
    for panel, scene in zip(panels.flat, scenes):
        for row in scene["contenders"]:
            y = names.index(row["name"])
            colour = OURS if row["name"].startswith("Swarmfit") else "#374151"
            if "ms" not in row:
                panel.text(0.02, y, "not for this cloud", transform=panel.get_yaxis_transform(), va="center", fontsize=7, color="#9ca3af")
                continue
            ms = row["ms"]
            panel.plot([ms["low_quartile"], ms["high_quartile"]], [y, y], color=colour, linewidth=2, solid_capstyle="butt")
            panel.plot(ms["median"], y, "o", color=colour, markersize=4)
        panel.set(xscale="log", yticks=range(len(names)), yticklabels=names, ylim=(-0.6, len(names) - 0.4))
        panel.set_title(f"{scene['name']}, {scene['finite']} points", fontsize=9, loc="left")
        panel.tick_params(axis="y", labelsize=7)
        panel.xaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
        panel.tick_params(axis="x", labelbottom=True)
    for panel in panels.flat[len(scenes):]:
        panel.set_visible(False)
    figure.supxlabel("ms, median and quartiles", fontsize=9)
    figure.tight_layout()
    save(figure, file)


def markdown(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(r) + " |" for r in rows]) + "\n"


def machine_text(machine):
    return (f"{machine['processor']}, {machine['cores']} cores, {machine['system']}; {machine['compiler']}; "
            f"Vulkan: {machine['vulkan']}; commit {machine['commit']}; load average {machine['load']} before the first measurement.\n")


def kinds_table(report):
    limit = report["limit"]
    head = ["back end", "model", "points", "particles", "pruning", "10⁹ evaluations/s", "of the limit", "largest error"]
    rows = [[r["backend"], r["model"], f"{r['points']}", f"{r['particles']}", "on" if r["pruning"] else "off",
             f"{r['evaluations_per_s'] / 1e9:.2f}", f"{100 * r['fraction_of_limit']:.0f} %", f"{r['max_relative_error']:.1e}"]
            for r in report["results"]]
    return (f"The limit in this run: {limit['fma_per_s'] / 1e9:.1f}·10⁹ multiply-adds a second on {limit['threads']} threads, "
            f"{limit['fma_per_s'] / PLANE_FMA / 1e9:.1f}·10⁹ plane residuals.\n\n" + markdown(head, rows))


def peers_table(report):
    text = []
    for scene in report["scenes"]:
        head = ["", "ms", "quartiles", "CPU ms", "runs", "normals, ms", "found", "count", "inliers", "beyond", "lacking"]
        rows = []
        for row in scene["contenders"]:
            if "ms" not in row:
                rows.append([row["name"], row.get("failure", "not run")] + [""] * 9)
                continue
            ms = row["ms"]
            beyond = row["beyond_ours"]["mean"] if row["name"] != "Swarmfit" else None
            lacking = row["lacking_of_ours"]["mean"] if row["name"] != "Swarmfit" else None
            rows.append([row["name"], f"{ms['median']:.1f}", f"{ms['low_quartile']:.1f}–{ms['high_quartile']:.1f}", f"{row['cpu_ms']['median']:.1f}",
                         f"{row['runs']}",
                         f"{row['normals_ms']['median']:.1f}" if row["normals_ms"]["median"] else "", f"{row['planes']['median']:g}",
                         f"{row['planes_that_count']['median']:g}", f"{100 * row['inliers']['median'] / scene['finite']:.1f} %",
                         "" if beyond is None else f"{beyond:.1f}", "" if lacking is None else f"{lacking:.1f}"])
        text.append(f"**{scene['name']}**, {scene['finite']} finite points of {scene['points']}, τ = {scene['threshold']:g}, "
                    f"a plane holds {scene['min_inliers']} at least.\n\n" + markdown(head, rows))
    load = report["load"]
    text.append(f"Load average {load['before']:.1f} before these runs, {load['after']:.1f} after (their own work included); "
                f"{report['threads']} threads.\n")
    for missing in report["missing"]:
        text.append(f"{missing['name']}: not in this run, {missing['reason']}.\n")
    return "\n".join(text)


def lacking_table(report):
    """Planes that count and that ours has in fewer than nine runs in ten."""
    rows = []
    for scene in report["scenes"]:
        runs = {c["name"]: c["runs"] for c in scene["contenders"]}
        for surface in scene["surfaces"]:
            if surface["runs"].get("Swarmfit", 0) >= 0.9 * runs["Swarmfit"]:
                continue
            others = ", ".join(f"{name} {count}/{runs[name]}" for name, count in surface["runs"].items() if count and name != "Swarmfit")
            normal = ", ".join(f"{v:.2f}" for v in surface["normal"])
            rows.append([scene["name"], f"({normal}), {surface['offset']:.3f}", f"{surface['points']}", f"{100 * surface['level']:.0f} %",
                         f"{surface['runs'].get('Swarmfit', 0)}/{runs['Swarmfit']}", others])
    if not rows:
        return "No contender found a plane that counts and that Swarmfit has in fewer than nine runs in ten.\n"
    return markdown(["cloud", "plane: normal, offset", "points", "level", "Swarmfit", "who else"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=pathlib.Path, help="the folder that tools/performance.sh wrote")
    parser.add_argument("--docs", type=pathlib.Path, required=True, help="folder of performance.md; plots go to images/ in it")
    arguments = parser.parse_args()
    images = arguments.docs / "images"
    images.mkdir(exist_ok=True)
    pyplot.rcParams.update(STYLE)
    folder, text = arguments.results, []
    machine = read(folder, "machine.json")
    if machine:
        text += ["**Machine.** " + machine_text(machine)]
    kinds = read(folder, "kinds.json")
    if kinds:
        text += ["### Throughput\n", kinds_table(kinds)]
    for name, axis, title, fixed in (("points", "points", "points", "256 particles"), ("particles", "particles", "particles", "100 000 points")):
        reports = [r for r in (read(folder, f"{name}-{t}.json") for t in ("one", "all")) if r]
        if reports:
            plot_growth(reports, axis, f"{title} ({fixed})", images / f"growth-{name}.svg")
            text += [f"![Effective evaluations a second over {title}](images/growth-{name}.svg)\n"]
    peers = read(folder, "peers.json")
    if peers:
        plot_peers(peers, images / "peers.svg")
        text += ["### Peers\n", "![Time of the whole job, every contender on every cloud](images/peers.svg)\n", peers_table(peers),
                 "### What others find\n", lacking_table(peers)]
    page = arguments.docs / "performance.md"
    whole = page.read_text()
    if BEGIN not in whole or END not in whole:
        sys.exit(f"{page}: no place for the figures, must hold {BEGIN} and {END}")
    page.write_text(whole[:whole.index(BEGIN) + len(BEGIN)] + "\n\n" + "\n".join(text) + "\n" + whole[whole.index(END):])
    print(f"wrote {page}")


if __name__ == "__main__":
    main()
