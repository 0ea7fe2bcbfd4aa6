"""How soon viewers are back who have lost what they watch through (./dev live-load --lost): the hub, one of three that
NATS joins, or NATS. Hubs, nats-server, publisher and viewers share this machine. The viewers follow the rule of all
clients (docs/live.md, section 2): after a random pause to the next of the hubs that theirs has told of.

A viewer is back with the first frame that was sent after the loss, or after NATS was started again, and that can be
decoded from what came over the same connection.
"""
import contextlib
import os
import signal
import sys
import tempfile
import time
from typing import NamedTuple

import arrivals
import hub_process as hubs

VIEWERS = 1000
JOINS_PER_SECOND = 400
SETTLE_SECONDS = 5  # longer than a connection must stand to count as one: 3 s
AWAY_SECONDS = 3  # of NATS
BACK_SECONDS = 15  # that are waited for
AIM_SECONDS = 10


class Case(NamedTuple):
    what: str
    signal: int | None  # to the hub; none: NATS is killed


CASES = {
    "killed": Case("their hub is killed", signal.SIGKILL),
    "silent": Case("their hub stops without a word, so that each waits for three seconds", signal.SIGSTOP),
    "nats": Case(f"nats-server is killed and comes back {AWAY_SECONDS} s later", None),
}


def lose_hub(hub, how, stack):
    hub.send_signal(how)
    if how == signal.SIGSTOP:
        stack.callback(hub.send_signal, signal.SIGCONT)
    return hubs.now_us()


def lose_nats(nats, port, stack):
    nats.kill()
    nats.wait()
    time.sleep(AWAY_SECONDS)
    stack.enter_context(hubs.nats_server(port))
    return hubs.now_us()


def knows_the_stream(port):
    with contextlib.suppress(OSError):
        return "person" in hubs.streams(port)
    return False


def measure(options, case, viewers):
    stream, nats_port = hubs.stream_of(options.htvm, options.rate), hubs.free_port()
    with contextlib.ExitStack() as stack:
        noted = os.path.join(stack.enter_context(tempfile.TemporaryDirectory()), "arrivals")
        nats = stack.enter_context(hubs.nats_server(nats_port))
        first, _, last = stack.enter_context(
            hubs.joined_hubs(options.htvm, 3, nats_port, "--connections", viewers + 16))
        publisher = stack.enter_context(hubs.publisher(stream, "person", last[1]))
        while not knows_the_stream(first[1]):
            time.sleep(0.1)
        before = viewers / JOINS_PER_SECOND + SETTLE_SECONDS
        watch = stack.enter_context(hubs.started(
            [options.live_watch, "person", "-o", noted, "--port", first[1], "--viewers", viewers, "--joins",
             JOINS_PER_SECOND, "--follow", "--seconds", before + BACK_SECONDS + (0 if case.signal else AWAY_SECONDS)]))
        time.sleep(before)
        since = lose_hub(first[0], case.signal, stack) if case.signal else lose_nats(nats, nats_port, stack)
        watch.wait()
        if publisher.poll() is not None:
            sys.exit("the publisher has ended")
        return result_of(arrivals.read(noted), viewers, since)


def result_of(noted, viewers, since):
    shown = arrivals.frames(noted)
    again = arrivals.of_each_viewer(shown[(shown["sent"] >= since) & (shown["lacking"] == 0)])
    seconds = [(own["arrived"][0] - since) / 1e6 for own in again.values()]
    later = noted[noted["arrived"] >= since]
    connecting = later[later["kind"] == arrivals.CONNECTING]
    at = [int(own["frame"][-1]) for own in arrivals.of_each_viewer(connecting).values()]
    return {"viewers": viewers, "watched_before": len(arrivals.of_each_viewer(shown[shown["arrived"] < since])),
            "back": len(again), "p50_s": arrivals.percentile(seconds, 50), "p99_s": arrivals.percentile(seconds, 99),
            "last_s": arrivals.percentile(seconds, 100), "attempts": len(connecting),
            "turned_away": int(sum((later["kind"] == arrivals.CLOSED) & (later["frame"] != 0))),
            "viewers_at_others": sorted(at.count(port) for port in set(at)), "lacking": int(shown["lacking"].sum())}


def line_of(name, one):
    where = f", now at other hubs: {' + '.join(map(str, one['viewers_at_others']))}" if one["viewers_at_others"] else ""
    return (f"{name:6}  {one['back']} of {one['viewers']} back: p50 {one['p50_s']:.2f}, p99 {one['p99_s']:.2f}, "
            f"last {one['last_s']:.2f} s; connected {one['attempts']} times, turned away {one['turned_away']}{where}; "
            f"frames that lacked something {one['lacking']}")


def main(options):
    names = list(CASES) if options.lost == "each" else [options.lost]
    viewers = int(options.viewers or VIEWERS)
    results = {}
    for name in names:
        one = results[name] = measure(options, CASES[name], viewers)
        if one["watched_before"] < viewers:
            sys.exit(f"only {one['watched_before']} of {viewers} watched before the loss")
        if not options.json:
            print(line_of(name, one), flush=True)
    if options.json:
        hubs.print_json(results)
    return all(one["back"] == viewers and one["last_s"] <= AIM_SECONDS for one in results.values())
