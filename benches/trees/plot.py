"""Draw what a tree costs as spheres grow: plot.py TABLE.csv PICTURE.svg, both of `cargo xtask bench scale`."""

import csv
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

# Text stays text; the same table gives the same file.
plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "scale", "font.family": "sans-serif", "font.size": 10})
INK = "#1f5fa8"


def main():
    """Read the table and write the picture."""
    table, picture = sys.argv[1:]
    with open(table, encoding="utf-8", newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]

    def column(name):
        return [row[name] for row in rows]

    counts = column("spheres")
    figure, (cost, build, size) = plt.subplots(1, 3, figsize=(10, 3.2), layout="constrained")
    best = rows[0]["rate"]
    spread = [[best / row["rate"] - best / row["high"] for row in rows], [best / row["low"] - best / row["rate"] for row in rows]]
    cost.errorbar(counts, [best / rate for rate in column("rate")], yerr=spread, fmt="o-", color=INK, capsize=3)
    cost.set_title("cost of a path, 1 at 100 spheres")
    cost.set_ylim(bottom=0)
    build.plot(counts, column("placed"), "s--", color="#9a5b00", label="placement")
    build.plot(counts, column("built"), "o-", color=INK, label="tree")
    build.set_title("seconds before the first dispatch")
    build.set_yscale("log")
    build.legend(frameon=False)
    size.plot(counts, column("bytes"), "o-", color=INK)
    size.set_title("bytes a sphere on the device")
    size.set_ylim(0, 70)
    size.axhline(64, color="#888888", linestyle=":")
    for axes in (cost, build, size):
        axes.set_xscale("log")
        axes.set_xlabel("spheres")
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    figure.savefig(picture, metadata={"Date": None})


if __name__ == "__main__":
    main()
