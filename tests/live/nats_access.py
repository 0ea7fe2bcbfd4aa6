#!/usr/bin/env python3
"""Hubs that a real nats-server asks who they are: by user and password, by token, by TLS, and by a user of NATS's own
accounts. Two that may join are joined; the log of one that may not says so, and what is published there goes on.

usage: nats_access.py HTVM
"""
import base64
import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile

from nats import NAME, SKIPPED, Publisher, Viewer, back, free_port, has_nats, streams_at, wait_until


def openssl(*words, given=None):
    return subprocess.run(["openssl", *words], input=given, check=True, capture_output=True).stdout


# ---- A user of NATS's own accounts: keys by Ed25519, and tokens (JWT) that one signs for the next -----------------------

OPERATOR, ACCOUNT, USER, SEED = 14 << 3, 0, 20 << 3, 18 << 3


def with_checksum(data):
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return base64.b32encode(data + crc.to_bytes(2, "little")).decode().rstrip("=")


class Key:
    def __init__(self, kind, folder, name):
        self.kind, self.path = kind, os.path.join(folder, f"{name}.key")
        openssl("genpkey", "-algorithm", "ed25519", "-out", self.path)
        self.public = with_checksum(bytes([kind]) + openssl("pkey", "-in", self.path, "-pubout", "-outform", "DER")[-32:])

    def seed(self):
        raw = openssl("pkey", "-in", self.path, "-outform", "DER")[-32:]
        return with_checksum(bytes([SEED | self.kind >> 5, (self.kind & 31) << 3]) + raw)

    def token(self, subject, name, claims):
        """What this key says of the other key `subject`."""
        def part(value):
            return base64.urlsafe_b64encode(value).rstrip(b"=")
        body = {"iat": 1600000000, "iss": self.public, "sub": subject, "name": name, "nats": {**claims, "version": 2}}
        body["jti"] = base64.b32encode(hashlib.sha256(json.dumps(body).encode()).digest()).decode().rstrip("=")
        said = part(b'{"typ":"JWT","alg":"ed25519-nkey"}') + b"." + part(json.dumps(body).encode())
        with open(self.path + ".said", "wb") as file:
            file.write(said)
        return (said + b"." + part(openssl("pkeyutl", "-sign", "-inkey", self.path, "-rawin", "-in", file.name))).decode()


def write_credentials(folder, name, account):
    user = Key(USER, folder, name)
    token = account.token(user.public, name, {"type": "user", "pub": {}, "sub": {}, "subs": -1, "data": -1, "payload": -1})
    path = os.path.join(folder, f"{name}.creds")
    with open(path, "w", encoding="ascii") as file:
        file.write(f"-----BEGIN NATS USER JWT-----\n{token}\n------END NATS USER JWT------\n\n"
                   f"-----BEGIN USER NKEY SEED-----\n{user.seed()}\n------END USER NKEY SEED------\n")
    return path


# ---- What nats-server is told, and the options of a hub that may join and of one that may not ---------------------------
# Each returns options of nats-server, address and options of the right hub, those of the wrong one, and why it is wrong.

REFUSED = "Authentication Violation"


def by_password(_folder):
    return ["--user", "hubs", "--pass", "secret"], ["nats://hubs:secret@"], ["nats://hubs:guess@"], REFUSED


def by_token(_folder):
    return ["--auth", "s3cr3t"], ["nats://s3cr3t@"], ["nats://guess@"], REFUSED


def by_tls(folder):
    for name in ("server", "other"):
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj",
                "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", f"{folder}/{name}.key", "-out",
                f"{folder}/{name}.pem")
    right, wrong = f"{folder}/server.pem", f"{folder}/other.pem"
    return (["--tls", "--tlscert", right, "--tlskey", f"{folder}/server.key", "--user", "hubs", "--pass", "secret"],
            ["tls://hubs:secret@", "--nats-ca", right], ["tls://hubs:secret@", "--nats-ca", wrong], "SSL Error")


def by_credentials(folder):
    operator, account, stranger = (Key(kind, folder, name) for kind, name in
                                   ((OPERATOR, "operator"), (ACCOUNT, "account"), (ACCOUNT, "stranger")))
    limits = {"subs": -1, "conn": -1, "leaf": -1, "imports": -1, "exports": -1, "data": -1, "payload": -1, "wildcards": True}
    accounts = operator.token(account.public, "hubs", {"type": "account", "limits": limits})
    with open(f"{folder}/nats.conf", "w", encoding="ascii") as file:
        file.write(f"operator: {operator.token(operator.public, 'operator', {'type': 'operator'})}\n"
                   f"resolver: MEMORY\nresolver_preload: {{ {account.public}: {accounts} }}\n")
    return (["--config", file.name], ["nats://", "--nats-credentials", write_credentials(folder, "hub", account)],
            ["nats://", "--nats-credentials", write_credentials(folder, "guess", stranger)], REFUSED)


# ---- The test -----------------------------------------------------------------------------------------------------------

class Hub:
    def __init__(self, htvm, folder, name, nats, words):
        self.port, self.log = free_port(), os.path.join(folder, f"{name}.log")
        address, *options = words
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(
                [htvm, "serve", "--json", "--port", str(self.port), "--hub-name", name, "--nats",
                 f"{address}127.0.0.1:{nats}", *options], stdout=log)

    def events(self, name):
        with open(self.log, encoding="utf-8") as log:
            events = [json.loads(line) for line in log if line.endswith("\n")]
        return [event["text"] for event in events if event["event"] == name]

    def lists(self):
        with contextlib.suppress(OSError):
            return streams_at(self.port)
        return {}


def check(htvm, folder, rule):
    nats = free_port()
    words, right, wrong, why = rule(folder)
    hubs = []
    processes = [subprocess.Popen(["nats-server", "-a", "127.0.0.1", "-p", str(nats), *words], stderr=subprocess.DEVNULL)]
    try:
        hubs = [Hub(htvm, folder, f"{rule.__name__}-{name}", nats, given)
                for name, given in (("a", right), ("b", right), ("refused", wrong))]
        processes += [hub.process for hub in hubs]
        a, b, refused = hubs
        for hub in (a, b):
            wait_until(f"{rule.__name__}: a hub that may join says that it has", lambda: hub.events("nats_connected"))
        wait_until(f"{rule.__name__}: one that may not says why", lambda: why in "".join(refused.events("nats_trouble")))
        publisher = Publisher([a.port])
        local = Publisher([refused.port])
        for each in (publisher, local):
            each.start()
        wait_until(f"{rule.__name__}: what is published on one hub is listed by the other",
                   lambda: b.lists().get(NAME, {}).get("far"))
        wait_until(f"{rule.__name__}: it is published on the hub that is alone", lambda: NAME in refused.lists())
        viewers = [Viewer([b.port]), Viewer([refused.port])]
        for viewer in viewers:
            viewer.start()
        back(f"{rule.__name__}, from hub to hub", publisher, viewers[:1])
        back(f"{rule.__name__}, on the hub that is alone", local, viewers[1:])
        said = refused.events("nats_trouble")
        assert not refused.events("nats_connected") and not refused.lists()[NAME]["far"]
        assert len(said) <= 2, f"the same trouble again and again: {said}"
        assert all("not joined with other hubs: " in text and "secret" not in text and "guess" not in text for text in said), said
        print(f"{rule.__name__}: {'; '.join(said)}")
        for each in (publisher, local):
            each.ends = True
    except BaseException:
        for hub in hubs:
            with open(hub.log, encoding="utf-8") as log:
                print(f"--- {hub.log}\n{log.read()}", file=sys.stderr)
        raise
    finally:
        for process in processes:
            process.kill()
            process.wait()


def main():
    htvm = sys.argv[1]
    if not shutil.which("nats-server") or not shutil.which("openssl"):
        print("Skipped: there is no nats-server, or no openssl.")
        return SKIPPED
    if not has_nats(htvm):
        print("Skipped: this htvm was built without NATS.")
        return SKIPPED
    for rule in (by_password, by_token, by_tls, by_credentials):
        with tempfile.TemporaryDirectory() as folder:
            check(htvm, folder, rule)
    return 0


if __name__ == "__main__":
    sys.exit(main())
