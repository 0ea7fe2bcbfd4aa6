#!/usr/bin/env python3
"""Whether the dashboard and the alerts of examples/monitoring ask for what hubs count, and the manual names all that they
count. With promtool (Debian: prometheus) the rules are checked and tried, too.

usage: monitoring.py
"""
import json
import os
import re
import shutil
import subprocess
import sys

PROJECT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
MONITORING = os.path.join(PROJECT, "examples", "monitoring")


def text_of(*path):
    with open(os.path.join(PROJECT, *path), encoding="utf-8") as file:
        return file.read()


def counted():
    """The names that the source makes metrics of; a histogram is three."""
    source = text_of("src", "live", "server", "metrics.cpp")
    plain = re.findall(r'(?:counter|gauge|add|each)\(\s*"([a-z_]+)"', source)
    histograms = re.findall(r'histogram\(\s*"([a-z_]+)"', source)
    return set(plain) | {name + end for name in histograms for end in ("_bucket", "_sum", "_count")}, set(plain) | set(histograms)


def documented(manual):
    """The names of the manual, {a,b} in them written out."""
    text = manual[manual.index("## Many machines"):]
    names = set()
    for name in re.findall(r"`(?:htvm_)?([a-z_{},]+)`", text):
        name = re.sub(r"\{[a-z]+\}$", "", name)  # the label
        parts = re.match(r"^([a-z_]*)\{([a-z_,]+)\}([a-z_]*)$", name)
        names |= {parts[1] + one + parts[3] for one in parts[2].split(",")} if parts else {name}
    return names


def main():
    series, metrics = counted()
    faults = []
    asked = text_of("examples", "monitoring", "alerts.yml") + json.dumps(json.loads(text_of("examples", "monitoring", "dashboard.json")))
    for name in sorted(set(re.findall(r"\bhtvm_([a-z_]+)\b(?!\.)", asked)) - series):
        faults.append(f"examples/monitoring asks for htvm_{name}, which no hub counts")
    for name in sorted(metrics - documented(text_of("docs", "live.md"))):
        faults.append(f"docs/live.md does not tell of htvm_{name}")
    if len(series) < 40:
        faults.append(f"only {len(series)} metrics are found in the source")
    if shutil.which("promtool"):
        for arguments in (["check", "rules", "alerts.yml"], ["test", "rules", "alerts_test.yml"],
                          ["check", "config", "prometheus.yml"]):
            done = subprocess.run(["promtool", *arguments], cwd=MONITORING, capture_output=True, text=True, check=False)
            if done.returncode:
                faults.append(f"promtool {' '.join(arguments)}: {done.stdout}{done.stderr}")
    else:
        print("promtool is not installed: the rules are not tried")
    print("\n".join(faults) or f"{len(series)} metrics are asked for and told of as they are")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
