#!/usr/bin/env bash
# Live streams from end to end: htvm publish and htvm encode to a hub, htvm decode and htvm info from it.
. "$(dirname "$0")/expect.sh"
unset HTVM_TOKEN
started=()
trap 'kill "${started[@]}" 2>/dev/null; wait 2>/dev/null; rm -rf "$work"' EXIT

# begins_to COMMAND...: until the command succeeds, for ten seconds.
begins_to() {
    for _ in $(seq 100); do
        "$@" >/dev/null 2>&1 && return
        sleep 0.1
    done
    fail "never: $*"
}
# hub LOG PORT OPTIONS...: a hub on this port, or a free one (0); sets hub_pid and address.
hub() {
    "$htvm" serve --port "$2" "${@:3}" >"$1" 2>"$1.err" &
    hub_pid=$!
    started+=("$hub_pid")
    begins_to grep -q http "$1"
    address=$(sed -E 's|.*https?://([^/]*)/.*|\1|' "$1" | head -1)
}

"$htvm" synth walk --frames 12 --vertices 300 >/dev/null 2>&1
"$htvm" encode walk --keyint 6 --group 1 -o walk.htvm 2>/dev/null # in groups, who joins within one begins with a gap
"$htvm" decode walk.htvm -o meshes 2>/dev/null

hub serve 0

# What is decoded from a hub is what is decoded from the file; each round of a loop is a sequence of its own.
"$htvm" publish walk.htvm "ws://$address/publish/walk" --loop --json >published 2>published.err &
publisher=$!
started+=("$publisher")
"$htvm" decode "ws://$address/watch/walk" --frames 30 -o live --json --timestamps live.csv >live.json 2>live.err ||
    fail "decoding a live stream: $(cat live.err)"
python3 - <<'PYTHON' || fail "the live frames are not those of the file"
import glob, json, os
frames = json.load(open("live.json"))["frames"]
# The stream was joined at a frame of its own; its rounds follow each other.
meshes = [open(f, "rb").read() for f in sorted(glob.glob("meshes/*.ply"))]
body = lambda ply: ply[ply.index(b"end_header"):]
first = body(open(frames[0]["file"], "rb").read())
at = [body(m) for m in meshes].index(first)
for k, frame in enumerate(frames):
    got = body(open(frame["file"], "rb").read())
    assert got == body(meshes[(at + k) % len(meshes)]), f"frame {k}"
assert len(frames) == 30
times = [float(line.split(",")[1]) for line in open("live.csv").read().split()[1:]]
assert all(20000 < b - a < 50000 for a, b in zip(times, times[1:])), times
PYTHON
# Frames of a live stream are told as they come.
timeout -s INT 3 "$htvm" info "ws://$address/watch/walk" >info 2>info.err
[ "$(grep -cE '^ +[0-9]+ +[ITP]' info)" -ge 20 ] || fail "info of a live stream: $(cat info info.err)"

# A hub that is killed and back costs the frames of that time, and nobody gives up.
"$htvm" decode "ws://$address/watch/walk" --frames 60 -o again 2>again.err &
viewer=$!
sleep 1
kill -9 "$hub_pid"
wait "$hub_pid" 2>/dev/null
sleep 0.5
hub serve_again "${address##*:}"
wait "$viewer"
[ $? -le 3 ] && [ "$(find again -name '*.ply' | wc -l)" -eq 60 ] || fail "a viewer of a hub that is back: $(cat again.err)"
grep -q 'trying again' again.err || fail "the viewer does not say that the hub was lost: $(cat again.err)"
for _ in {1..100}; do # it says so once the hub has kept it for a second
    grep -q "connected to ws://$address/publish/walk" published.err && break
    sleep 0.1
done
kill -INT "$publisher"
wait "$publisher"
[ $? -eq 0 ] || fail "htvm publish --loop after Ctrl-C: $(cat published.err)"
grep -q "connected to ws://$address/publish/walk" published.err || fail "a publisher does not say that its hub is back: $(cat published.err)"
python3 - <<'PYTHON' || fail "htvm publish --json"
import json
lines = [json.loads(line) for line in open("published")]
assert lines[-1]["frames"] > 90 and lines[-1]["rounds"] >= 7 and lines[-1]["connections"] == 2, lines[-1]
assert any(line["round_trip_ms"] is not None for line in lines)
PYTHON

# A hub takes the connection before it judges the stream. Who publishes one that is another's says once that it is
# refused, and never that it is connected.
"$htvm" publish walk.htvm "ws://$address/publish/taken" --loop 2>taken.err &
publisher=$!
started+=("$publisher")
"$htvm" decode "ws://$address/watch/taken" --frames 1 -o taken 2>/dev/null || fail "nobody publishes: $(cat taken.err)"
"$htvm" publish walk.htvm "ws://$address/publish/taken" --loop 2>refused.err
[ $? -eq 1 ] || fail "a second publisher of a stream is not refused: $(cat refused.err)"
grep -q "connected to" refused.err && fail "a publisher that is refused says that it is connected: $(cat refused.err)"
[ "$(grep -c "is being published by another session; end that one, or wait; trying again" refused.err)" -eq 1 ] ||
    fail "a publisher that is refused says so not once: $(cat refused.err)"
kill -INT "$publisher"
wait "$publisher"

# From a file at the time of its frames: twelve of them last 0.4 s.
begun=$(date +%s%N)
expect 0 "12 frames to ws://$address/publish/once" "$htvm" publish walk.htvm "ws://$address/publish/once"
lasted=$((($(date +%s%N) - begun) / 1000000))
[ $lasted -ge 366 ] || fail "12 frames were published in $lasted ms"
# Encoded from files it goes on at their pace, too, and what waits for its time is not late.
"$htvm" encode walk --frames 4 --fps 2 --deadline 400 --json -o "ws://$address/publish/slow" >paced.json 2>paced.err ||
    fail "encoding files for a hub: $(cat paced.err)"
python3 -c 'import json; pace = json.load(open("paced.json"))["pace"]; assert pace["late_frames"] == 0, pace' ||
    fail "frames that wait for their time count as late"
"$htvm" publish - "ws://$address/publish/piped" --speed 10 <walk.htvm 2>piped.err || fail "from a pipe: $(cat piped.err)"

# As a camera sends it: synth, encode, decode.
"$htvm" synth --live --vertices 300 2>synth.err >camera.ply &
camera=$!
started+=("$camera")
begins_to test -s camera.ply
kill -INT "$camera"
wait "$camera" || fail "synth --live after Ctrl-C: $(cat synth.err)"
"$htvm" synth --live --vertices 300 --frames 1000 2>/dev/null |
    "$htvm" encode - -o "ws://$address/publish/me" 2>encode.err &
encoder=$!
started+=("$encoder")
"$htvm" decode "ws://$address/watch/me" --frames 20 -o me 2>me.err || fail "decoding what a camera sends: $(cat me.err)"
[ "$(find me -name '*.ply' | wc -l)" -eq 20 ] || fail "a camera: $(ls me)"
kill -INT "$encoder"
wait "$encoder"
[ $? -eq 130 ] || fail "encoding for a hub after Ctrl-C: $(cat encode.err)"

# With TLS and a token: the hub's certificate is checked, and its answer ends what it refuses.
if command -v openssl >/dev/null; then
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout key.pem -out cert.pem -days 1 \
        -subj /CN=hub -addext subjectAltName=IP:127.0.0.1 2>/dev/null
    "$htvm" serve --publishers publishers.json --add-publisher walk >token 2>/dev/null
    hub secure 0 --cert cert.pem --key key.pem --publishers publishers.json
    "$htvm" publish walk.htvm "wss://$address/publish/walk" --ca cert.pem --token-file token --loop 2>wss.err &
    publisher=$!
    started+=("$publisher")
    "$htvm" decode "wss://$address/watch/walk" --ca cert.pem --frames 12 -o secure_meshes 2>secure.err ||
        fail "decoding over TLS: $(cat secure.err wss.err)"
    expect 1 "is not trusted" "$htvm" publish walk.htvm "wss://$address/publish/walk" --token-file token
    expect 1 "is not trusted" "$htvm" decode "wss://localhost:${address##*:}/watch/walk" --ca cert.pem -o nothing
    expect 1 "401" env HTVM_TOKEN=wrong "$htvm" publish walk.htvm "wss://$address/publish/walk" --ca cert.pem
    expect 1 "401" "$htvm" publish walk.htvm "wss://$address/publish/walk" --insecure
    "$htvm" publish walk.htvm "wss://$address/publish/walk" --insecure 2>&1 | grep -q "trying again" &&
        fail "what is refused for good is said to be tried again"
    kill -INT "$publisher"
else
    echo "openssl is not installed: TLS is not tried"
fi

# A ladder goes to the hub as streams of their own, of which it makes a list; the publisher's token and viewers' links are
# those of the ladder.
"$htvm" synth step --frames 75 --vertices 300 >/dev/null 2>&1
rm -f publishers.json
HTVM_TOKEN=$("$htvm" serve --publishers publishers.json --add-publisher person 2>/dev/null)
export HTVM_TOKEN
expect 1 "whose token is for all rungs" "$htvm" serve --publishers publishers.json --add-publisher person~1
"$htvm" serve --link-keys keys.json --add-link-key >/dev/null 2>&1
hub ladder 0 --segments 1 --publishers publishers.json --link-keys keys.json
expect 0 "person~2: 75 frames" "$htvm" encode step --ladder q20,q50 --segment 1 --effort 1 --end \
    -o "ws://$address/publish/person"
expect 1 "whose link is for all rungs" "$htvm" link person~1 --for 1h --keys keys.json --segments
list=$("$htvm" link person --for 1h --keys keys.json --segments --url "http://$address" | sed s/stream.m3u8/master.m3u8/)
expect 0 "75 frames" "$htvm" info "$list"
"$htvm" pack "$list" -o from_hub.htvm 2>pack.err || fail "the ladder's finest rung: $(cat pack.err)"
"$htvm" encode step -q 50 --effort 1 -o alone.htvm 2>/dev/null
size() { stat -c %s "$1"; }
[ "$(size from_hub.htvm)" -gt $(($(size alone.htvm) / 2)) ] && [ "$(size from_hub.htvm)" -lt $(($(size alone.htvm) * 2)) ] ||
    fail "the finest rung has $(size from_hub.htvm) bytes, alone it has $(size alone.htvm)"
expect 1 "401" "$htvm" encode step --ladder q20,q50 --effort 1 -o "ws://$address/publish/other"
unset HTVM_TOKEN
expect 1 "is for segments and hubs" "$htvm" encode step --ladder q20,q50 -o step.htvm

# So does one that is in files, at the time of its frames: as the list of playlists, or as files.
"$htvm" encode step --ladder q20,q50 --segment 1 --effort 1 -o step.m3u8 2>/dev/null
"$htvm" pack step-1.m3u8 -o low.htvm 2>/dev/null
"$htvm" pack step-2.m3u8 -o high.htvm 2>/dev/null
hub files 0 --segments 1
expect 0 "75 frames to ws://$address/publish/listed~2" "$htvm" publish step.m3u8 --ladder "ws://$address/publish/listed" --end
"$htvm" publish low.htvm high.htvm --ladder "ws://$address/publish/named" --end --json >rungs.json 2>rungs.err ||
    fail "publishing the files of a ladder: $(cat rungs.err)"
python3 - "http://$address" <<'PYTHON' || fail "a ladder that was published from files"
import json, re, sys, urllib.request
get = lambda path: urllib.request.urlopen(sys.argv[1] + path).read().decode()
for name in "listed", "named":
    master = get(f"/hls/{name}/master.m3u8")
    assert re.findall(r"^\.\./.*", master, re.M) == [f"../{name}~{rung}/stream.m3u8" for rung in (1, 2)], master
    # The rungs are cut at the same times, and their segments have the same numbers and dates.
    told = []
    for rung in 1, 2:
        text = get(f"/hls/{name}~{rung}/stream.m3u8")
        told.append((re.search(r"SEQUENCE:(\d+)", text).group(1), re.findall(r"DATE-TIME:(\S+)", text), re.findall(r"EXTINF:([\d.]+)", text)))
    assert told[0] == told[1] and len(told[0][1]) >= 2, told
last = json.loads(open("rungs.json").readlines()[-1])["rungs"]
assert [rung["frames"] for rung in last] == [75, 75], last
assert [rung["hub"].rsplit("/", 1)[1] for rung in last] == ["named~1", "named~2"], last
PYTHON
expect 1 "is no ladder: name two files or more" "$htvm" publish low.htvm --ladder "ws://$address/publish/alone"
"$htvm" synth late --frames 10 --vertices 300 >/dev/null 2>&1
seq 1 0.04 1.36 >late.csv
"$htvm" encode late --effort 1 --timestamps late.csv -o late.htvm 2>/dev/null
expect 1 "rungs are of one capture" "$htvm" publish low.htvm late.htvm --ladder "ws://$address/publish/late"
expect 2 "the last word is where to" "$htvm" publish low.htvm high.htvm --ladder

# What is wrong is said.
expect 1 "does not begin with ws://" "$htvm" publish walk.htvm "http://$address/publish/a"
expect 1 "1 to 65535" "$htvm" decode "ws://localhost:0/watch/a" -o nothing
expect 2 "standard input does not allow" "$htvm" publish - "ws://$address/publish/a" --loop
expect 2 "not for what is live" "$htvm" encode walk --jobs 2 -o "ws://$address/publish/a"
expect 1 "cannot be read" "$htvm" publish walk.htvm "ws://$address/publish/a" --token-file nowhere
printf 'a b\n' >spaced
expect 1 "has no token" "$htvm" publish walk.htvm "ws://$address/publish/a" --token-file spaced
expect 3 "it has no frame" "$htvm" publish spaced "ws://$address/publish/a"
expect 4 "encode it again" "$htvm" publish "$project/tests/data/conformance/person.htvm" "ws://$address/publish/a"
expect 2 "a folder to write to or standard output" "$htvm" synth
expect 2 "a folder to write to or standard output" "$htvm" synth walk --live
# Nobody is there: the publisher looks for a hub until it is told to end.
expect 5 "127.0.0.1:9" "$htvm" publish walk.htvm ws://127.0.0.1:9/publish/a
expect 2 "--fixed-bitrate: does nothing without a --bitrate and a hub" "$htvm" encode capture --fixed-bitrate -o x.htvm
done_with "publish: passed"
