#!/usr/bin/env python3
"""Reads campaign/TARGET.log. With a target: one line about it. Without: the table of all targets,
coverage over time as campaign/coverage.csv and as campaign/coverage.svg."""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).parent
EVENT = re.compile(r"^(\d+) #(\d+)\s+(\w+)\s+cov: (\d+) ft: (\d+)")
COLOURS = ["#4e79a7", "#f28e2b", "#e15759", "#76b7b2", "#59a14f", "#edc948", "#b07aa1", "#9c755f", "#333333", "#bab0ac", "#d37295"]


class Target:
    """Runs of one target, one after the other; time counts while it ran."""

    def __init__(self, name):
        self.name = name
        self.curve = []  # (seconds, executions, edges, features)
        self.seconds = self.executions = self.edges = self.findings = 0
        self.cpu = 0.0  # seconds of a core
        self.last_new = 0
        start = runs = ran = 0
        for line in (HERE / "campaign" / f"{name}.log").read_text(errors="replace").splitlines():
            if line.startswith("=== start"):
                start, runs, ran = int(line.split()[2]), self.executions, self.seconds
            if " === cpu " in line:
                self.cpu += float(line.split()[-1])
            if "SUMMARY: " in line:
                self.findings += 1
            found = EVENT.match(line)
            if not found:
                continue
            now, count, kind, edges, features = found.groups()
            self.seconds = ran + int(now) - start
            self.executions = runs + int(count)
            if int(edges) > self.edges:
                self.edges = int(edges)
                if kind != "INITED":
                    self.last_new = self.seconds
            self.curve.append((self.seconds, self.executions, self.edges, int(features)))

    def row(self):
        rate = self.executions / max(self.cpu, 1)
        return (f"| `{self.name}` | {self.seconds / 60:.1f} | {self.cpu / 60:.1f} | {self.executions:,} | {rate:,.0f} "
                f"| {self.edges:,} | {self.last_new / 60:.1f} | {self.findings} |")


HEAD = ("| target | minutes | core minutes | executions | a core second | edges | last new edge at minute | findings |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |")


LOWEST = 90  # percent; the seeds alone give as much, but for a target that starts from nothing


def svg(targets):
    """Edges over time, each target as a share of its own last value."""
    width, height, left, low, top = 900, 420, 60, 380, 40
    longest = max(t.seconds for t in targets) or 1

    def y(percent):
        return low - (low - top) * (max(percent, LOWEST) - LOWEST) / (100 - LOWEST)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for percent in range(LOWEST, 101, 2):
        out.append(f'<path d="M{left} {y(percent):.1f}H700" stroke="#ddd"/><text x="{left - 8}" y="{y(percent) + 4:.1f}" text-anchor="end">{percent} %</text>')
    for part in range(5):
        x = left + 640 * part / 4
        out.append(f'<text x="{x}" y="{low + 18}" text-anchor="middle">{longest * part / 240:.1f} min</text>')
    for i, t in enumerate(targets):
        # A point where the number of edges changes, and the last.
        curve = [here for here, before in zip(t.curve, [None, *t.curve]) if not before or here[2] != before[2]]
        points, last = "", None
        for seconds, _, edges, _ in [*curve, t.curve[-1]]:
            x, percent = left + 640 * seconds / longest, 100 * edges / max(t.edges, 1)
            points += f"{x:.1f},{y(percent if last is None else last):.1f} {x:.1f},{y(percent):.1f} "
            last = percent
        colour = COLOURS[i % len(COLOURS)]
        out.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                   f'<text x="715" y="{60 + 22 * i}" fill="{colour}">{t.name}: {t.edges:,} edges</text>')
    out.append("</svg>")
    return "\n".join(out) + "\n"


def main():
    if len(sys.argv) > 1:
        print(Target(sys.argv[1]).row())
        return
    logs = sorted((HERE / "campaign").glob("*.log"))
    targets = [t for t in (Target(log.stem) for log in logs) if t.curve]
    print(HEAD, *(t.row() for t in targets), sep="\n")
    total = sum(t.cpu for t in targets)
    print(f"\n{total / 3600:.2f} hours of a core, {sum(t.executions for t in targets):,} executions, "
          f"{sum(t.findings for t in targets)} findings")
    rows = [f"{t.name},{s},{n},{e},{f}" for t in targets for s, n, e, f in t.curve]
    (HERE / "campaign" / "coverage.csv").write_text("\n".join(["target,seconds,executions,edges,features", *rows]) + "\n")
    if targets:
        (HERE / "campaign" / "coverage.svg").write_text(svg(targets))


main()
