"""What is published through a hub is watched, as frames."""

import contextlib
import os
import subprocess
import threading

import numpy as np
import pytest
from conftest import needs_program, program, sheet

import htvm

needs_library = pytest.mark.skipif("HTVM_LIVE_LIBRARY" not in os.environ, reason="the library for live streams is not there")


@contextlib.contextmanager
def hub():
    with subprocess.Popen([program, "serve", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          text=True) as server:
        try:
            yield server.stdout.readline().strip().rstrip("/").replace("http://", "ws://")
        finally:
            server.terminate()


@needs_program
@needs_library
def test_what_is_published_is_watched():
    with hub() as address:
        publisher = htvm.Publisher(address + "/publish/anna")
        seen = []
        first = threading.Event()

        def watch():
            for frame in htvm.open(htvm.watch(address + "/watch/anna")):
                seen.append((frame.number, np.array(frame.positions)))
                first.set()

        watching = threading.Thread(target=watch)
        watching.start()
        encoder = htvm.Encoder(publisher, session=publisher.session, subject_size=1000)
        encoder.push(sheet(0))
        assert first.wait(30)
        for number in range(1, 5):
            encoder.push(sheet(number), force_intra=publisher.wants_key_frame())
        encoder.finish()
        assert publisher.connected and publisher.dropped_frames == 0
        publisher.finish()
        watching.join(30)
    assert [number for number, _ in seen] == [0, 1, 2, 3, 4]
    assert np.abs(seen[4][1][:, 2].max() - sheet(4).positions[:, 2].max()) < 5


@needs_library
def test_wrong_addresses_and_bytes_are_errors():
    with pytest.raises(htvm.BadInput):
        htvm.watch("http://127.0.0.1/watch/anna")
    publisher = htvm.Publisher("ws://127.0.0.1:9/publish/anna")
    with pytest.raises(htvm.CorruptStream):
        publisher.write(b"no packet")
    assert not publisher.connected
    with pytest.raises(htvm.LimitExceeded):  # there is no hub
        publisher.close(timeout=0.1)
    with pytest.raises(htvm.BadInput):
        publisher.write(b"")
