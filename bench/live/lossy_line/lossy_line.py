#!/usr/bin/env python3
"""Live streams over worse lines: a hub in one network namespace, viewers in another, and between them router.py,
through which each viewer has a line of its own that delays, limits and drops packets. As root.

First the lines themselves are measured by pings. Delays are from the publisher to a viewer; a stall is a pause of more
than a second without a frame; missing frames are those that the hub did not send to a viewer who could not take them.
"""
import argparse
import contextlib
import dataclasses
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import arrivals  # noqa: E402
import datagrams  # noqa: E402
import hub_process as hubs  # noqa: E402
from router import Settings  # noqa: E402

HUB_ADDRESS = "10.9.0.1"
NAMES = "htvm-line-"
AGAIN_SECONDS = 5  # after which who joins to measure joining leaves
SETTLE_SECONDS = 3  # before and after what is measured


@dataclasses.dataclass
class Kind:
    """A kind of line with the stream and the congestion control that are tried on it."""
    megabits: float
    control: str
    loss: float  # percent
    addresses: list = dataclasses.field(default_factory=list)


def remove_abandoned():
    """Namespaces of runs that were killed."""
    for name in hubs.run("ip", "netns", "list").split():
        if name.startswith(NAMES) and not os.path.exists("/proc/" + name.split("-")[2]):
            hubs.run("ip", "netns", "delete", name)


class Lines:
    """Two namespaces and the router between them; gone with the block, and their processes with them."""

    def __init__(self, lines, controls):
        self.settings, self.controls = lines, controls
        self.hub, self.viewers = f"{NAMES}{os.getpid()}-hub", f"{NAMES}{os.getpid()}-view"
        self.router = None

    def inside(self, namespace):
        return ["ip", "netns", "exec", namespace]

    def __enter__(self):
        remove_abandoned()
        try:
            self.build()
        except BaseException:
            self.remove()
            raise
        return self

    def __exit__(self, *_):
        self.remove()

    def build(self):
        router = os.path.join(os.path.dirname(os.path.abspath(__file__)), "router.py")
        devices = {self.hub: f"htvmh{os.getpid()}", self.viewers: f"htvmv{os.getpid()}"}
        self.router = subprocess.Popen([sys.executable, router], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                       text=True)
        self.router.stdin.write(json.dumps({
            "hub": devices[self.hub], "viewers": devices[self.viewers],
            "lines": {address: dataclasses.asdict(line) for address, line in self.settings.items()}}) + "\n")
        self.router.stdin.flush()
        if self.router.stdout.readline() != "ready\n":
            sys.exit("the router has not started; it needs root and /dev/net/tun")
        for namespace, device in devices.items():
            hubs.run("ip", "netns", "add", namespace)
            hubs.run("ip", "link", "set", device, "netns", namespace)
        commands = {self.hub: [f"addr add {HUB_ADDRESS}/32 dev {devices[self.hub]}"],
                    self.viewers: [f"addr add {address}/32 dev {devices[self.viewers]}" for address in self.settings]}
        for namespace, words in commands.items():
            words += ["link set lo up", f"link set {devices[namespace]} up"]
        # What the hub has learned of a line is forgotten, so that each viewer who joins is a new one.
        hubs.run(*self.inside(self.hub), "sysctl", "-qw", "net.ipv4.tcp_no_metrics_save=1")
        commands[self.hub] += [f"route add {address}/32 dev {devices[self.hub]} congctl {self.controls[address]}"
                               for address in self.settings]
        commands[self.viewers].append(f"route add {HUB_ADDRESS}/32 dev {devices[self.viewers]}")
        for namespace, words in commands.items():
            subprocess.run([*self.inside(namespace), "ip", "-batch", "-"], input="\n".join(words) + "\n", text=True,
                           check=True)

    def report(self):
        """What passed; the lines are of no use after it."""
        self.router.stdin.close()
        return json.loads(self.router.stdout.read())

    def remove(self):
        if self.router:
            self.router.terminate()
            self.router.wait()
        names = hubs.run("ip", "netns", "list").split()
        for namespace in (self.hub, self.viewers):
            if namespace in names:
                hubs.run("ip", "netns", "delete", namespace)


def ping(lines, address, count):
    """Percent lost (there or back) and the milliseconds of a round trip, of so many pings."""
    told = subprocess.run([*lines.inside(lines.viewers), "ping", "-q", "-i", "0.002", "-c", str(count), "-I", address,
                           HUB_ADDRESS], capture_output=True, text=True, check=False).stdout
    received = int(re.search(r"(\d+) received", told).group(1))
    times = re.search(r"= ([\d.]+)/([\d.]+)/([\d.]+)/", told)
    return 100 * (1 - received / count), tuple(map(float, times.groups()))


def check_router(options):
    """Loss and delay of each kind of line, by pings, and what they should be."""
    addresses = {f"10.9.1.{1 + i}": loss for i, loss in enumerate(options.loss)}
    settings = {address: line_settings(options, loss, address) for address, loss in addresses.items()}
    checked = []
    with Lines(settings, dict.fromkeys(addresses, "cubic")) as lines:
        for address, loss in addresses.items():
            lost, times = ping(lines, address, options.pings)
            checked.append({"loss": loss, "expected_percent": 100 * (1 - (1 - loss / 100) ** 2), "lost_percent": lost,
                            "least_ms": times[0], "mean_ms": times[1], "most_ms": times[2]})
    return checked


def line_settings(options, loss, address):
    return Settings(megabits=options.line, queue_ms=options.queue, delay_ms=options.round_trip / 2, loss=loss / 100,
                    seed=int(address.split(".")[-1]) + 1000 * options.seed)


def kinds_of_lines(options):
    """With a viewer's address for each viewer."""
    kinds = []
    for third, megabits in enumerate(options.rate):
        numbers = itertools.count(1)
        for control, loss in itertools.product(options.control, options.loss):
            addresses = [f"10.9.{10 + third}.{next(numbers)}" for _ in range(options.viewers)]
            kinds.append(Kind(megabits, control, loss, addresses))
    return kinds


def watch(options, kinds, again):
    """What the viewers of each kind noted, from when to when, and the router's report. again: they leave and join."""
    settings = {address: line_settings(options, kind.loss, address) for kind in kinds for address in kind.addresses}
    controls = {address: kind.control for kind in kinds for address in kind.addresses}
    noted = []
    with tempfile.TemporaryDirectory() as folder, Lines(settings, controls) as lines, contextlib.ExitStack() as stack:
        inside = lines.inside(lines.hub)
        _, port = stack.enter_context(hubs.hub(options.htvm, "--address", "0.0.0.0", inside=inside))
        for megabits in options.rate:
            stream = hubs.stream_of(options.htvm, megabits)
            stack.enter_context(hubs.publisher(stream, f"person-{megabits}", port, inside))
        time.sleep(1.5)
        begin = hubs.now_us() + SETTLE_SECONDS * 10**6
        end = begin + int(options.seconds * 1e6)
        watchers = []
        for megabits in options.rate:
            addresses = [address for kind in kinds if kind.megabits == megabits for address in kind.addresses]
            watchers.append(stack.enter_context(hubs.started(
                [*lines.inside(lines.viewers), options.live_watch, f"person-{megabits}", "-o",
                 os.path.join(folder, str(megabits)), "--host", HUB_ADDRESS, "--port", port, "--source", addresses[0],
                 "--per-source", 1, "--viewers", len(addresses), "--joins", 16,
                 "--seconds", options.seconds + 2 * SETTLE_SECONDS, *(["--again", AGAIN_SECONDS] if again else [])])))
        for watcher in watchers:
            watcher.wait()
        for megabits in options.rate:
            of_stream = arrivals.read(os.path.join(folder, str(megabits)))
            for index, kind in enumerate(kind for kind in kinds if kind.megabits == megabits):
                first = index * options.viewers
                noted.append((kind, of_stream[(of_stream["viewer"] >= first) &
                                              (of_stream["viewer"] < first + options.viewers)]))
        return noted, begin, end, lines.report()


def result_of(kind, noted, begin, end):
    shown = arrivals.frames(arrivals.sent_within(noted, begin, end))
    delays = arrivals.delays_ms(shown)
    lacking, gaps = arrivals.missing(shown)
    pauses = arrivals.stalls(shown, end)
    return {"megabits": kind.megabits, "control": kind.control, "loss": kind.loss, "frames": len(shown),
            "p50_ms": arrivals.percentile(delays, 50), "p99_ms": arrivals.percentile(delays, 99),
            "worst_ms": arrivals.percentile(delays, 100), "stalls": len(pauses),
            "longest_stall_s": float(max(pauses, default=0)),
            "missing_percent": 100 * lacking / max(1, lacking + len(shown)), "fallen_behind": gaps,
            "viewer_minutes": len(kind.addresses) * (end - begin) / 60e6,
            "closed": int(sum(noted["kind"] == arrivals.CLOSED))}


def joined_of(kind, noted, end):
    whole_visits = end - (AGAIN_SECONDS - SETTLE_SECONDS) * 10**6
    pictures, lives, in_vain = arrivals.joins(noted, whole_visits)
    return {"megabits": kind.megabits, "control": kind.control, "loss": kind.loss, "joins": len(pictures) + in_vain,
            "in_vain": in_vain,
            **{f"{name}_{percent}_s": arrivals.percentile(values, percent)
               for name, values in (("picture", pictures), ("live", lives)) for percent in (50, 95, 100)}}


def row(one, *cells):
    return f"{one['megabits']:8g} {one['control']:>7} {one['loss']:5g}% " + " ".join(cells)


def main():
    parser = argparse.ArgumentParser(prog="./dev lossy-line", description=__doc__)
    parser.add_argument("htvm", help=argparse.SUPPRESS)
    parser.add_argument("live_watch", help=argparse.SUPPRESS)

    def numbers(text):
        return [float(word) for word in text.split(",")]

    parser.add_argument("--seconds", type=float, default=60, help="that each viewer watches, and for which others join "
                        "again and again (default 60)")
    parser.add_argument("--viewers", type=int, default=4, help="at each kind of line (default 4)")
    parser.add_argument("--loss", default=[0.0, 1.0, 3.0, 5.0], type=numbers, help="percent of packets lost, both ways "
                        "(default 0,1,3,5)")
    parser.add_argument("--control", default=["cubic", "bbr"], type=lambda text: text.split(","),
                        help="TCP's congestion control at the hub (default cubic,bbr)")
    parser.add_argument("--rate", default=[0.5, 1.6], type=numbers, help="of the streams, Mbit/s (default 0.5,1.6)")
    parser.add_argument("--line", type=float, default=10, help="Mbit/s of each viewer's line (default 10)")
    parser.add_argument("--queue", type=float, default=100, help="milliseconds that packets may wait before it "
                        "(default 100)")
    parser.add_argument("--round-trip", type=float, default=50, help="milliseconds (default 50)")
    parser.add_argument("--pings", type=int, default=5000, help="for each kind of line (default 5000)")
    parser.add_argument("--seed", type=int, default=1, help="of what is lost")
    parser.add_argument("--json", action="store_true", help="the results for machines")
    options = parser.parse_args()
    if os.geteuid() != 0:
        sys.exit("network namespaces need root")
    for number in (signal.SIGTERM, signal.SIGHUP):  # so that the namespaces go, too
        signal.signal(number, lambda *_: sys.exit(1))
    for megabits in options.rate:
        hubs.stream_of(options.htvm, megabits)
    say = (lambda *_: None) if options.json else (lambda text: print(text, flush=True))

    checked = check_router(options)
    say(f"The router, by {options.pings} pings:")
    for one in checked:
        say(f"  {one['loss']:g} % each way: {one['lost_percent']:.1f} % lost of {one['expected_percent']:.1f} % "
            f"expected, {one['least_ms']:.1f} / {one['mean_ms']:.1f} / {one['most_ms']:.1f} ms")

    kinds = kinds_of_lines(options)
    noted, begin, end, report = watch(options, kinds, again=False)
    watched = [result_of(kind, noted, begin, end) for kind, noted in noted]
    say(f"\nWatching, {options.round_trip:g} ms, {options.line:g} Mbit/s (packets late in the router by "
        f"{report['late_ms_p99']:.1f} ms at p99):")
    say("  Mbit/s control   loss   p50 ms p99 ms worst ms  stalls a minute  longest s  missing  fallen behind a minute")
    for one in watched:
        say(row(one, f"{one['p50_ms']:8.0f} {one['p99_ms']:6.0f} {one['worst_ms']:8.0f} "
                f"{one['stalls'] / one['viewer_minutes']:16.1f} {one['longest_stall_s']:10.1f} "
                f"{one['missing_percent']:7.1f}% {one['fallen_behind'] / one['viewer_minutes']:12.1f}"))

    noted, _, end, _ = watch(options, kinds, again=True)
    joined = [joined_of(kind, noted, end) for kind, noted in noted]
    say(f"\nJoining late, {options.round_trip:g} ms, {options.line:g} Mbit/s: seconds until the first picture, "
        f"and until one comes within {1000 * arrivals.LIVE_SECONDS:.0f} ms")
    say(f"  Mbit/s control   loss   joins  picture p50   p95 worst     live p50   p95 worst  "
        f"not within {AGAIN_SECONDS} s")
    for one in joined:
        say(row(one, f"{one['joins']:7} {one['picture_50_s']:12.2f} {one['picture_95_s']:5.2f} "
                f"{one['picture_100_s']:5.2f} {one['live_50_s']:12.2f} {one['live_95_s']:5.2f} "
                f"{one['live_100_s']:5.2f} {one['in_vain']:15}"))
    for megabits in options.rate:
        with open(hubs.stream_of(options.htvm, megabits), "rb") as file:
            say(f"\nIf the packets of {megabits:g} Mbit/s were datagrams of {datagrams.DATAGRAM_BYTES} bytes:")
            datagrams.report(file.read(), [loss for loss in options.loss if loss > 0], say)
    if options.json:
        hubs.print_json({"router": checked, "late_ms_p99": report["late_ms_p99"], "watched": watched, "joined": joined})


if __name__ == "__main__":
    main()
