"""What viewers noted (watch.cpp), and what follows from it."""
import numpy as np

ARRIVAL = np.dtype([("arrived", "<i8"), ("sent", "<i8"), ("viewer", "<u4"), ("frame", "<u4"), ("bytes", "<u4"),
                    ("kind", "u1"), ("lacking", "u1"), ("unused", "u1", 2)])
CONNECTING, CLOSED = 200, 201
INTRA = 2
FRAMES = (2, 3, 6, 7, 11)  # kinds of packets that hold a frame
STALL_SECONDS = 1.0
LIVE_SECONDS = 0.25  # a viewer who joined has caught up with what happens once a frame comes within this


def read(path):
    return np.fromfile(path, ARRIVAL)


def frames(arrivals):
    return arrivals[np.isin(arrivals["kind"], FRAMES)]


def delays_ms(arrivals):
    return (arrivals["arrived"] - arrivals["sent"]) / 1000


def percentile(values, percent):
    """The smallest value that at least so many percent of all do not exceed; nan if there are none."""
    return float(np.percentile(values, percent, method="inverted_cdf")) if len(values) else float("nan")


def sent_within(arrivals, begin, end):
    """Arrivals of packets that were sent between these moments, in microseconds."""
    return arrivals[(arrivals["sent"] >= begin) & (arrivals["sent"] < end)]


def of_each_viewer(arrivals):
    """{number: its arrivals, in order}."""
    ordered = arrivals[np.argsort(arrivals["viewer"], kind="stable")]
    numbers, places = np.unique(ordered["viewer"], return_index=True)
    return dict(zip(numbers.tolist(), np.split(ordered, places[1:])))


def missing(shown):
    """Of the frames that any of these viewers got, how many others lack; and the number of gaps, at which a viewer
    fell behind. Frames that were sent before a viewer's first do not count."""
    if not len(shown):
        return 0, 0
    newest, lacking, gaps = int(shown["frame"].max()), 0, 0
    for own in of_each_viewer(shown).values():
        numbers = own["frame"].astype(np.int64)
        steps = np.diff(np.append(numbers, newest + 1))
        lacking += int(np.sum(steps - 1))
        gaps += int(np.sum(steps > 1))
    return lacking, gaps


def stalls(shown, end):
    """Lengths, in seconds, of the pauses in which a viewer got no frame for too long, up to the moment `end`."""
    lengths = [np.empty(0)]
    for own in of_each_viewer(shown).values():
        pauses = np.diff(np.append(own["arrived"], max(end, own["arrived"][-1]))) / 1e6
        lengths.append(pauses[pauses > STALL_SECONDS])
    return np.concatenate(lengths)


def joins(arrivals, until):
    """Of each time a viewer joined before the moment `until`: the seconds from connecting to the first frame, and to
    the first that came live; and how often a viewer left without one that did."""
    pictures, lives, in_vain = [], [], 0
    for own in of_each_viewer(arrivals).values():
        begins = np.flatnonzero(own["kind"] == CONNECTING)
        for visit in np.split(own, begins)[1:]:
            since, shown = visit["arrived"][0], frames(visit)
            if since >= until:
                continue
            live = shown[delays_ms(shown) < LIVE_SECONDS * 1000]
            if len(live):
                pictures.append((shown["arrived"][0] - since) / 1e6)
                lives.append((live["arrived"][0] - since) / 1e6)
            else:
                in_vain += 1
    return np.array(pictures), np.array(lives), in_vain
