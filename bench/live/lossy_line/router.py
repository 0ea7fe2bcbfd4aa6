#!/usr/bin/env python3
"""A router between two TUN devices that delays, limits and drops IP packets, each viewer's line by itself.

usage: router.py < SETTINGS     (JSON: see Settings; as root)

What it drops follows from a seed and from the order of a line's packets alone. Prints "ready" once the devices are
there, and, when standard input ends, what passed, as JSON. netem does the same in kernels that have it.
"""
import dataclasses
import fcntl
import heapq
import json
import os
import random
import select
import socket
import struct
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
MTU = 1500
SOURCE, DESTINATION = slice(12, 16), slice(16, 20)  # in an IPv4 header


@dataclasses.dataclass
class Settings:
    """Of a line, in each of its two directions."""
    megabits: float = 10  # a second
    queue_ms: float = 100  # what may wait to be sent; beyond it, packets are dropped
    delay_ms: float = 25  # one way
    loss: float = 0  # part of the packets
    seed: int = 1


class Line:
    """One direction of a line. It only says when a packet arrives."""

    def __init__(self, settings, direction):
        self.settings = settings
        self.random = random.Random(f"{settings.seed} {direction}")
        self.free = 0.0  # when all that waits will have been sent
        self.packets = self.lost = self.overflowed = self.bytes = 0

    def arrival(self, now, size):
        """When a packet of this size arrives that is sent now, in seconds; None: it is dropped."""
        lost = self.random.random() < self.settings.loss
        self.packets += 1
        if self.free - now > self.settings.queue_ms / 1000:
            self.overflowed += 1
            return None
        self.free = max(self.free, now) + size * 8 / (self.settings.megabits * 1e6)
        if lost:  # behind the queue: it took its time
            self.lost += 1
            return None
        self.bytes += size
        return self.free + self.settings.delay_ms / 1000

    def counters(self):
        return {"packets": self.packets, "lost": self.lost, "overflowed": self.overflowed, "bytes": self.bytes}


def open_device(name):
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TUN | IFF_NO_PI))
    return device


class Router:
    """Packets to a viewer's address, and from it, take the two lines of that address."""

    def __init__(self, hub, viewers, lines):
        self.devices = {hub: (viewers, DESTINATION, 0), viewers: (hub, SOURCE, 1)}
        self.lines = {socket.inet_aton(address): (Line(settings, "down"), Line(settings, "up"))
                      for address, settings in lines.items()}
        self.travelling, self.number = [], 0
        self.late = []  # seconds by which packets were handed over too late, some of them

    def take(self, device):
        other, field, direction = self.devices[device]
        for _ in range(64):
            try:
                packet = os.read(device, MTU + 64)
            except BlockingIOError:
                return
            lines = self.lines.get(packet[field])
            if packet[0] >> 4 != 4 or lines is None:
                continue
            arrival = lines[direction].arrival(time.monotonic(), len(packet))
            if arrival is not None:
                self.number += 1
                heapq.heappush(self.travelling, (arrival, self.number, other, packet))

    def deliver(self):
        """Hands over what has arrived; returns the seconds until more does."""
        while self.travelling:
            now = time.monotonic()
            arrival, number, device, packet = self.travelling[0]
            if arrival > now:
                return arrival - now
            heapq.heappop(self.travelling)
            if number % 64 == 0:
                self.late.append(now - arrival)
            try:
                os.write(device, packet)
            except BlockingIOError:
                pass
        return 1.0

    def run(self, ends):
        """Until there is something to read from `ends`."""
        while True:
            ready, _, _ = select.select([*self.devices, ends], [], [], self.deliver())
            if ends in ready:
                return
            for device in ready:
                self.take(device)

    def report(self):
        late = sorted(self.late) or [0.0]
        return {"late_ms_p99": 1000 * late[int(0.99 * (len(late) - 1))],
                "lines": {socket.inet_ntoa(address): {"down": down.counters(), "up": up.counters()}
                          for address, (down, up) in self.lines.items()}}


def main():
    settings = json.loads(sys.stdin.readline())
    lines = {address: Settings(**line) for address, line in settings["lines"].items()}
    router = Router(open_device(settings["hub"]), open_device(settings["viewers"]), lines)
    print("ready", flush=True)
    router.run(sys.stdin)
    print(json.dumps(router.report()))


if __name__ == "__main__":
    main()
