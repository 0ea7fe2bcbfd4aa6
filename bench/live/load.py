#!/usr/bin/env python3
"""How many viewers a hub serves: htvm serve, a publisher and all viewers share this machine, over its loopback address.

They watch one stream at 30 frames a second. The delay of a packet is from just before the publisher sends it until a
viewer has read all of it.
"""
import argparse
import os
import sys
import tempfile
import threading
import time

import numpy as np

import arrivals
import hub_lost
import hub_process as hubs

JOINS_PER_SECOND = 400
SETTLE_SECONDS = 2
SEARCH = (250, 500, 750, 1000, 1250, 1500, 2000, 2500, 3000, 3500, 4000)


class Watched(threading.Thread):
    """The hub's memory every 10 s."""

    def __init__(self, pid, told):
        super().__init__(daemon=True)
        self.pid, self.told, self.bytes, self.done = pid, told, [], threading.Event()

    def run(self):
        while True:
            self.bytes.append(hubs.memory_bytes(self.pid))
            if self.told:
                print(f"{10 * len(self.bytes) - 10:5} s: {self.bytes[-1] / 1e6:.1f} MB", file=sys.stderr)
            if self.done.wait(10):
                return


def measure(options, viewers):
    stream = hubs.stream_of(options.htvm, options.rate)
    slow = round(viewers * options.slow / 100)
    with tempfile.TemporaryDirectory() as folder, \
            hubs.hub(options.htvm, "--connections", viewers + 16,
                     *(["--threads", options.threads] if options.threads else []),
                     *(hubs.certificate(folder) if options.tls else [])) as (hub, port), \
            hubs.publisher(stream, "person", port, tls=options.tls) as publisher:
        time.sleep(1.5)
        memory, sockets = hubs.memory_bytes(hub.pid), hubs.socket_bytes()
        noted = os.path.join(folder, "arrivals")
        joined = viewers / JOINS_PER_SECOND + SETTLE_SECONDS
        with hubs.started([options.live_watch, "person", "-o", noted, "--port", port, "--viewers", viewers,
                           "--slow", slow, "--slow-bits", options.rate * 1e6 / 3, "--joins", JOINS_PER_SECOND,
                           "--seconds", joined + options.seconds + 2, *(["--tls"] if options.tls else [])]) as watch:
            time.sleep(joined)
            begin = hubs.now_us()
            used, watched_used = hubs.processor_seconds(hub.pid), hubs.processor_seconds(watch.pid)
            growth = Watched(hub.pid, options.minutes)
            growth.start()
            time.sleep(options.seconds)
            end = hubs.now_us()
            used, watched_used = (hubs.processor_seconds(hub.pid) - used,
                                  hubs.processor_seconds(watch.pid) - watched_used)
            growth.done.set()
            sockets = hubs.socket_bytes() - sockets
            watch.wait()
        if publisher.poll() is not None:
            sys.exit("the publisher has ended")
        all_ = arrivals.read(noted)
    measured = arrivals.sent_within(all_, begin, end)
    quick = arrivals.frames(measured[measured["viewer"] >= slow])
    behind = arrivals.frames(measured[measured["viewer"] < slow])
    delays, intra = arrivals.delays_ms(quick), quick["kind"] == arrivals.INTRA
    lacking, _ = arrivals.missing(quick)
    published = len(np.unique(quick["frame"]))
    seconds = (end - begin) / 1e6
    return {
        "viewers": viewers, "slow": slow, "seconds": round(seconds, 1), "watched": len(arrivals.of_each_viewer(quick)),
        "closed": int(sum(all_["kind"] == arrivals.CLOSED)), "frames": len(quick), "missing": lacking,
        "slow_percent": 100 * len(behind) / max(1, slow * published),
        "megabits_each": round(float(quick["bytes"].sum()) * 8e-6 / seconds / max(1, viewers - slow), 2),
        "p50_ms": arrivals.percentile(delays, 50), "p99_ms": arrivals.percentile(delays, 99),
        "intra_p50_ms": arrivals.percentile(delays[intra], 50), "intra_p99_ms": arrivals.percentile(delays[intra], 99),
        "worst_ms": arrivals.percentile(delays, 100),
        "hub_percent": 100 * used / seconds, "viewers_percent": 100 * watched_used / seconds,
        "kilobytes_a_viewer": (growth.bytes[-1] - memory) / 1e3 / viewers,
        "kernel_kilobytes_a_viewer": sockets / 1e3 / viewers, "memory": growth.bytes,
    }


COLUMNS = [  # heading, unit, key of the result, digits behind the point
    ("viewers", "", "viewers", 0), ("frames", "", "frames", 0), ("missing", "", "missing", 0),
    ("slow get", "%", "slow_percent", 0), ("p50", "ms", "p50_ms", 1), ("p99", "ms", "p99_ms", 1),
    ("I p50", "ms", "intra_p50_ms", 1), ("I p99", "ms", "intra_p99_ms", 1), ("worst", "ms", "worst_ms", 0),
    ("hub CPU", "%", "hub_percent", 0), ("viewers' CPU", "%", "viewers_percent", 0),
    ("memory", "KB each", "kilobytes_a_viewer", 1), ("kernel's", "KB each", "kernel_kilobytes_a_viewer", 1)]


def heading():
    return "\n".join("  ".join(f"{column[row]:>{width_of(column)}}" for column in COLUMNS) for row in (0, 1))


def width_of(column):
    return max(7, len(column[0]))


def line_of(one):
    return "  ".join(f"{one[column[2]]:{width_of(column)}.{column[3]}f}" for column in COLUMNS)


def main():
    parser = argparse.ArgumentParser(prog="./dev live-load", description=__doc__)
    parser.add_argument("htvm", help=argparse.SUPPRESS)
    parser.add_argument("live_watch", help=argparse.SUPPRESS)
    parser.add_argument("viewers", nargs="?", help="how many, or several numbers divided by commas (default: more and "
                        "more until the 99th percentile of the delay passes --most)")
    parser.add_argument("seconds", type=float, nargs="?", default=20, help="of each measurement (default 20)")
    parser.add_argument("--minutes", type=float, help="instead of seconds; the hub's memory is told every 10 s")
    parser.add_argument("--rate", type=float, default=1.6, help="of the stream, Mbit/s (default 1.6)")
    parser.add_argument("--slow", type=float, default=5, help="percent of the viewers that read at a third of the "
                        "rate; they do not count in the delays (default 5)")
    parser.add_argument("--most", type=float, default=50, help="milliseconds (default 50)")
    parser.add_argument("--tls", action="store_true", help="publisher and viewers connect by TLS")
    parser.add_argument("--threads", type=int, default=0, help="of the hub, beside its own (default 0)")
    parser.add_argument("--lost", choices=[*hub_lost.CASES, "each"], help="instead, what these viewers (default 1000) "
                        "watch through is lost, one of three hubs that NATS joins, or NATS itself: how soon they are "
                        "back. " + "; ".join(f"{name}: {case.what}" for name, case in hub_lost.CASES.items()))
    parser.add_argument("--json", action="store_true", help="the results for machines")
    options = parser.parse_args()
    if options.minutes:
        options.seconds = options.minutes * 60
    if options.lost and (options.tls or (options.viewers and not options.viewers.isdigit())):
        parser.error("--lost takes one number of viewers, and no --tls")
    if options.lost:
        sys.exit(0 if hub_lost.main(options) else 1)
    results, held = [], 0
    if not options.json:
        print(heading(), flush=True)
    for viewers in map(int, options.viewers.split(",")) if options.viewers else SEARCH:
        one = measure(options, viewers)
        results.append(one)
        if not options.json:
            print(line_of(one), flush=True)
        if one["watched"] < viewers - one["slow"] or one["closed"]:
            print(f"only {one['watched']} of {viewers - one['slow']} watched, {one['closed']} were closed",
                  file=sys.stderr)
        if one["p99_ms"] <= options.most and not one["missing"]:
            held = max(held, viewers)
        elif not options.viewers:
            break
    if options.json:
        hubs.print_json(results)
    else:
        print(f"{held} viewers at most within {options.most:g} ms (99th percentile), none of whose frames was missing")


if __name__ == "__main__":
    main()
