#!/usr/bin/env bash
# htvm serve and htvm link as their operator meets them: options, files of tokens and keys, links, TLS, the end.
. "$(dirname "$0")/expect.sh"
mkdir streams && echo person >streams/person.htvm

# ask URL [CA]: the status and the body, on one line.
ask() {
    python3 - "$@" <<'PYTHON'
import ssl, sys, urllib.error, urllib.request
context = ssl.create_default_context(cafile=sys.argv[2]) if len(sys.argv) > 2 else None
try:
    with urllib.request.urlopen(sys.argv[1], timeout=10, context=context) as response:
        print(response.status, response.read().decode().strip())
except urllib.error.HTTPError as error:
    print(error.code, error.read().decode().strip())
PYTHON
}
# start OPTIONS...: a server in the background; $server is its process, $url its address.
start() {
    rm -f out err
    "$htvm" serve --port 0 "$@" >out 2>err &
    server=$!
    for _ in $(seq 200); do [ -s out ] && break; sleep 0.05; done
    url=$(grep -oE 'https?://[^ "/]+' out | head -1)
    [ -n "$url" ] || fail "serve $*: says no address: $(cat out err)"
}
# stop SIGNAL: it ends with 0, within 5 seconds.
stop() {
    kill -"$1" $server
    timeout 5 tail --pid=$server -f /dev/null || { fail "still there 5 s after SIG$1"; kill -9 $server; }
    wait $server || fail "SIG$1: exit $?"
}

# ---- what it is told ----------------------------------------------------------------------------------------------------

expect 2 "--cert requires --key" "$htvm" serve --cert a.pem
expect 2 "--add-publisher requires --publishers" "$htvm" serve --add-publisher anna
expect 1 "cannot read none.json" "$htvm" serve --publishers none.json
expect 1 "a.pem" "$htvm" serve --cert a.pem --key a.key
expect 2 "--viewers" "$htvm" serve --viewers 0
expect 2 "--record-minutes requires --record" "$htvm" serve --record-minutes 5
expect 1 "there is no folder none" "$htvm" serve --port 0 --record none
expect 1 "add one of them" "$htvm" serve --port 0 --auth-for publish
expect 1 "add --link-keys or --jwt-keys" "$htvm" serve --port 0 --revoked none.txt
mkdir folder.json
expect 1 "folder.json: it is a folder" "$htvm" serve --port 0 --publishers folder.json
expect 0 "--viewers-per-address" "$htvm" serve --help-all
expect 0 "(default 1024 MiB)" "$htvm" serve --help-all
# With NATS or without, the option is known, and what is wrong is said in a sentence.
said=$("$htvm" serve --port 0 --nats somewhere 2>&1)
case "$? $said" in
"1 "*"begins with nats:// or tls://"* | "4 "*"was built without NATS, "*" -DHTVM_NATS=ON"*) ;;
*) fail "--nats somewhere: $said" ;;
esac
printf 'port = 0\nfiles = "streams"\njson = true\n' >serve.conf
start --config serve.conf
grep -q '"event":"listening"' out || fail "--json from the file of options: $(cat out)"
[ "$(ask "$url/files/person.htvm")" = "200 person" ] || fail "files from the file of options: $(ask "$url/files/person.htvm")"
stop TERM
grep -q '"event":"stopped"' out || fail "no last line: $(cat out)"
printf 'speed = 3\n' >odd.conf
expect 2 "speed" "$htvm" serve --config odd.conf
printf 'files = "none"\n' >files.conf
expect 1 "none" "$htvm" serve --port 0 --config files.conf
start --config files.conf --files streams # the command line counts
stop INT
# A sibling is read, and not listed; what is called like one and has no stream beside it is a stream.
mkdir siblings
for name in person person.h264 anna.vp9; do echo "$name" >siblings/$name.htvm; done
start --files siblings
[ "$(ask "$url/files/person.h264.htvm")" = "200 person.h264" ] || fail "a sibling is not read: $(ask "$url/files/person.h264.htvm")"
[ "$(ask "$url/api/files" | grep -o '"[a-z0-9.]*htvm"' | sort -u | paste -sd ' ')" = '"anna.vp9.htvm" "person.htvm"' ] || fail "listed: $(ask "$url/api/files")"
stop TERM
mkdir recordings
start --record recordings --record-minutes 60
[ "$(ask "$url/readyz")" = "200 ready" ] || fail "is not ready: $(ask "$url/readyz")"
[ "$(ask "$url/healthz")" = "200 ok" ] || fail "is not well: $(ask "$url/healthz")"
ask "$url/metrics" | grep -q '^htvm_recording_faults_total 0$' || fail "no metrics of recordings: $(ask "$url/metrics")"
stop TERM
# On this machine's own address neither other hosts' names nor other sites' pages count, unless they are told.
asked() { python3 - "$url" "$@" <<'PYTHON'
import sys, urllib.error, urllib.request
try:
    with urllib.request.urlopen(urllib.request.Request(sys.argv[1] + "/files/person.htvm", headers=dict([sys.argv[2].split("=")])), timeout=10) as answer:
        print(answer.status, answer.headers["Access-Control-Allow-Origin"])
except urllib.error.HTTPError as error:
    print(error.code)
PYTHON
}
start --files streams
[ "$(asked Host=evil.example)" = 421 ] || fail "another host's name counts: $(asked Host=evil.example)"
[ "$(asked Origin=https://evil.example)" = "200 None" ] || fail "another site's page may read: $(asked Origin=https://evil.example)"
stop TERM
start --files streams --host hub.example --origin https://A.example
[ "$(asked Host=Hub.example:80)" = "200 None" ] || fail "the host that is told does not count"
[ "$(asked Origin=https://a.example:443)" = "200 https://a.example:443" ] || fail "the site that is told may not read"
stop TERM
# Behind a proxy: whom it names counts, and is no program on this machine; each request is logged by that address.
expect 2 "--proxy-protocol requires --trust-proxy" "$htvm" serve --proxy-protocol
expect 1 "hub.example is no address or network" "$htvm" serve --port 0 --trust-proxy hub.example
start --files streams --trust-proxy 127.0.0.0/8 --access-log access.log --json
[ "$(asked X-Forwarded-For=198.51.100.1,192.0.2.7)" = "200 None" ] || fail "a proxy's request is not answered"
stop TERM
grep -q '"address":"192.0.2.7","method":"GET","path":"/files/person.htvm","status":200,"bytes":7' access.log ||
    fail "the access log has $(cat access.log)"
mv access.log access.log.1
start --files streams --access-log access.log
[ "$(ask "$url/files/person.htvm?signature=secret")" = "200 person" ] || fail "no file"
mv access.log access.log.2
kill -HUP $server
for _ in $(seq 100); do [ -e access.log ] && break; sleep 0.05; done
[ "$(ask "$url/files/nothing.htvm")" = "404 " ] || fail "another file"
stop TERM
grep -q "Z GET /files/person.htvm 200 7 bytes .* (127.0.0.1)$" access.log.2 || fail "the access log has $(cat access.log.2)"
grep -q "GET /files/nothing.htvm 404" access.log || fail "after SIGHUP the access log has $(cat access.log)"
grep -q secret access.log* && fail "the access log tells what is secret"
# A new hub takes over from one that shares its port.
start --files streams --reuse-port
first=$server port=${url##*:} port=${port%/}
"$htvm" serve --port "$port" --files streams --reuse-port >out2 2>err2 &
second=$!
for _ in $(seq 100); do grep -q http out2 && break; sleep 0.05; done
kill -TERM $first
wait $first || fail "the first hub ends with $?"
[ "$(ask "$url/files/person.htvm")" = "200 person" ] || fail "nobody took over"
server=$second
stop TERM
start
grep -q "programs on this machine may publish" err || fail "does not say who may publish: $(cat err)"
[ "$(ask "$url/files/person.htvm")" = "404 " ] || fail "serves files without a folder"
stop TERM

# ---- tokens and links ---------------------------------------------------------------------------------------------------

token=$("$htvm" serve --publishers publishers.json --add-publisher anna 2>said)
[[ $token =~ ^[0-9a-f]{64}$ ]] || fail "the token is $token"
grep -q "shown only now" said || fail "says nothing of the token: $(cat said)"
[ "$(stat -c %a publishers.json)" = 600 ] || fail "others may read the publishers"
expect 1 "a stream's name has 1 to 64" "$htvm" serve --publishers publishers.json --add-publisher ../anna
expect 1 "a stream's name has 1 to 64" timeout 5 "$htvm" serve --port 0 --publishers publishers.json --add-publisher ""
"$htvm" serve --link-keys keys.json --add-link-key 2>said || fail "no key"
grep -q "has key 1 now" said || fail "says nothing of the key: $(cat said)"
expect 2 "--for" "$htvm" link anna --keys keys.json
expect 2 "--for" "$htvm" link anna --keys keys.json --for 2
expect 2 "less than no time" "$htvm" link anna --keys keys.json --for -2h
expect 1 "no name of a live stream" "$htvm" link a/b --keys keys.json --for 2h
expect 0 "https://hub.example/play/anna?expires=" "$htvm" link anna --keys keys.json --for 2h --url https://hub.example/
expect 0 "wss://hub.example/watch/anna?expires=" "$htvm" link anna --keys keys.json --for 2h --url https://hub.example --packets
expect 0 "https://hub.example/files/a%20b/%3F%23.htvm?expires=" "$htvm" link 'a b/?#.htvm' --file --keys keys.json --for 2h --url https://hub.example
for name in ../anna.htvm .anna.htvm a//b.htvm notes.txt $'a\eb.htvm'; do
    expect 1 "no hub serves" "$htvm" link "$name" --file --keys keys.json --for 2h
done
start --files streams --link-keys keys.json --publishers publishers.json
link=$("$htvm" link person.htvm --file --keys keys.json --for 1h --url "$url")
[ "$(ask "$link")" = "200 person" ] || fail "a good link: $(ask "$link")"
[ "$(ask "${link/person/people}")" = "403 this link is not one that this hub knows: it is incomplete, changed, or by a key no longer in use" ] ||
    fail "another file's link: $(ask "${link/person/people}")"
[ "$(ask "$url/files/person.htvm")" = "403 this needs a link: ask whoever runs this hub (htvm link writes one)" ] || fail "without a link"
short=$("$htvm" link person.htvm --file --keys keys.json --for 1s --url "$url")
sleep 2
[ "$(ask "$short")" = "403 this link has expired: ask for a new one" ] || fail "an expired link: $(ask "$short")"
watch=$("$htvm" link anna --packets --keys keys.json --for 1h --url "$url")
[[ $(ask "http${watch#ws}") =~ ^404 ]] || fail "a good link to what is not there yet: $(ask "http${watch#ws}")"
# Two more keys: that of the link is no longer among the newest two, once the server has read them.
"$htvm" serve --quiet --link-keys keys.json --add-link-key
"$htvm" serve --quiet --link-keys keys.json --add-link-key
kill -HUP $server
for _ in $(seq 100); do grep -q "were read again" err && break; sleep 0.05; done
[[ $(ask "$link") =~ ^403 ]] || fail "a link by a key of before: $(ask "$link")"
link=$("$htvm" link person.htvm --file --keys keys.json --for 1h --url "$url")
[ "$(ask "$link")" = "200 person" ] || fail "a link by the new key: $(ask "$link")"
echo '{' >keys.json
kill -HUP $server
for _ in $(seq 100); do grep -q "stay as they were" err && break; sleep 0.05; done
[ "$(ask "$link")" = "200 person" ] || fail "keys that cannot be read are taken: $(cat err)"
stop TERM

# ---- TLS ----------------------------------------------------------------------------------------------------------------

if command -v openssl >/dev/null; then
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout key.pem -out cert.pem -days 1 \
        -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1 2>/dev/null
    start --files streams --cert cert.pem --key key.pem
    [ "${url%%:*}" = https ] || fail "its address is $url"
    [ "$(ask "$url/files/person.htvm" cert.pem)" = "200 person" ] || fail "TLS: $(ask "$url/files/person.htvm" cert.pem)"
    stop TERM
else
    echo "openssl is not installed: TLS is not tried"
fi

# ---- as a service -------------------------------------------------------------------------------------------------------

if command -v systemd-analyze >/dev/null; then
    sed -e "s|/usr/bin/htvm|$htvm|" -e '/^Documentation/d' "$project/examples/systemd/htvm-serve.service" >htvm-serve.service
    said=$(systemd-analyze verify "$PWD/htvm-serve.service" 2>&1) && [ -z "$said" ] || fail "systemd: $said"
else
    echo "systemd-analyze is not installed: the unit is not checked"
fi
sed -E 's|/etc/htvm/|./|; s|^port.*|port = 0|; s|^address.*|address = "127.0.0.1"|; s|^#([a-z-]+ = )|\1|' \
    "$project/examples/systemd/serve.conf" >serve.conf
cp cert.pem chain.pem 2>/dev/null && "$htvm" serve --quiet --link-keys ./fresh.json --add-link-key && sed -i 's|./keys.json|./fresh.json|' serve.conf && {
    start --config serve.conf
    stop TERM
}

done_with "serve and link do what their help says"
