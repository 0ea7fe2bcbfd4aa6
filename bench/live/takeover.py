#!/usr/bin/env python3
"""What viewers notice when a publisher is started again, when a hub reads its files again, and when another hub takes
over its port. Hubs, publisher and viewers share this machine; viewers follow the rule of all clients (docs/live.md,
section 2).

usage: takeover.py HTVM LIVE_WATCH [--viewers 200] [--event publisher|reload|hub]

For each event it prints how many viewers were back, the longest pause between two frames of any viewer (and of half of
them, and of 99 in 100), how many frames they were not sent though their numbers show that there were some (a publisher
that is started again begins with number 0, so what it would have sent meanwhile does not count), and how many were told
that the stream has ended.
"""
import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

import arrivals
import hub_process as hubs

JOINS_PER_SECOND, SETTLE_SECONDS, AFTER_SECONDS = 200, 3, 6
ENDED = 1000  # the code of a WebSocket whose stream has ended


class Scene:
    """A hub, its publisher, and what can happen to them."""

    def __init__(self, options, stack):
        self.options, self.stack = options, stack
        self.stream = hubs.stream_of(options.htvm, 1.6)
        self.port = hubs.free_port()
        self.hub = self.start_hub()
        self.publisher = self.start_publisher()

    def start_hub(self):
        process, _ = self.stack.enter_context(
            hubs.hub(self.options.htvm, "--port", self.port, "--reuse-port", "--connections", self.options.viewers + 64,
                     "--viewers-per-address", self.options.viewers + 1, "--access-log", os.devnull))
        return process

    def start_publisher(self):
        return self.stack.enter_context(hubs.started(
            [self.options.htvm, "publish", self.stream, f"ws://127.0.0.1:{self.port}/publish/person", "--loop", "--quiet"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def happens(self, event):
        if event == "publisher":
            self.publisher.send_signal(signal.SIGTERM)
            self.publisher.wait()
            self.publisher = self.start_publisher()
        elif event == "reload":
            self.hub.send_signal(signal.SIGHUP)
        else:
            before, self.hub = self.hub, self.start_hub()
            before.send_signal(signal.SIGTERM)
            before.wait()


def measure(options, event):
    with contextlib.ExitStack() as stack:
        noted = os.path.join(stack.enter_context(tempfile.TemporaryDirectory()), "arrivals")
        scene = Scene(options, stack)
        time.sleep(1)
        before = options.viewers / JOINS_PER_SECOND + SETTLE_SECONDS
        watch = stack.enter_context(hubs.started(
            [options.live_watch, "person", "-o", noted, "--port", scene.port, "--viewers", options.viewers, "--joins",
             JOINS_PER_SECOND, "--follow", "--seconds", before + AFTER_SECONDS]))
        time.sleep(before)
        since = hubs.now_us()
        scene.happens(event)
        watch.wait()
        return result_of(arrivals.read(noted), options.viewers, since)


def lost_by(own, since):
    """Frames that this viewer was not sent though the numbers of those it was sent show that there were some. Whoever
    connects again is sent first what the newest frame refers to: what it had before counts no more."""
    lost, last, joins = 0, None, False
    for kind, number, arrived in zip(own["kind"], own["frame"].astype(np.int64), own["arrived"]):
        if kind == arrivals.CONNECTING:
            joins = True
        elif kind in arrivals.FRAMES and not (joins and last is not None and number <= last):
            if last is not None and number > last + 1 and arrived > since - 1e6:
                lost += int(number - last - 1)
            last, joins = number, False
    return lost


def result_of(noted, viewers, since):
    shown = arrivals.frames(noted)
    pauses, back = [], 0
    for own in arrivals.of_each_viewer(shown).values():
        times = own["arrived"]
        back += bool(times[-1] > since + 1e6 * (AFTER_SECONDS - 2))
        around = times[(times > since - 1e6)]
        pauses.append(float(np.diff(around).max()) / 1e6 if len(around) > 1 else float("inf"))
    lost = [lost_by(own, since) for own in arrivals.of_each_viewer(noted).values()]
    later = noted[noted["arrived"] >= since]
    closed = later[later["kind"] == arrivals.CLOSED]
    return {"viewers": viewers, "back": back, "pause p50, s": round(arrivals.percentile(pauses, 50), 3),
            "pause p99, s": round(arrivals.percentile(pauses, 99), 3), "longest pause, s": round(max(pauses), 3),
            "frames lost": sum(lost), "by one viewer at most": max(lost),
            "connected again": int(sum(later["kind"] == arrivals.CONNECTING)),
            "told that it ended": int(sum(closed["frame"] == ENDED))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("htvm")
    parser.add_argument("live_watch")
    parser.add_argument("--viewers", type=int, default=200)
    parser.add_argument("--event", choices=["publisher", "reload", "hub"])
    options = parser.parse_args()
    well = True
    for event in [options.event] if options.event else ["publisher", "reload", "hub"]:
        one = measure(options, event)
        hubs.print_json({"event": event, **one})
        well &= one["back"] == options.viewers and one["longest pause, s"] <= 1 and one["told that it ended"] == 0
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
