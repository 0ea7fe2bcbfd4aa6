#!/usr/bin/env bash
# Makes the container image of the hub by buildah from packaging/Containerfile, and tries it by podman.
#   packaging/container.sh [IMAGE]        IMAGE: its name, htvm-hub by default
# HTVM_BASE names the image it is built on: by default Debian's, docker.io/library/debian:12-slim; "debian" is one that
# mmdebstrap makes here of Debian's packages, where no registry can be reached.
# HTVM_CCACHE names a folder of ccache that the compiler inside uses. BUILDAH_RUNTIME names the runtime (crun, runc).
# Prints a line for each thing that was tried, and the sizes. As root, or where users may have containers.
set -euo pipefail
cd "$(dirname "$0")/.."
image=${1:-htvm-hub} base=${HTVM_BASE:-docker.io/library/debian:12-slim}
runtime=${BUILDAH_RUNTIME:-}
work=$(mktemp -d)
container=htvm-hub-$$
made=()
engine() { podman ${runtime:+--runtime "$runtime"} "$@"; }
end() {
    engine rm -f -t 0 "$container" >/dev/null 2>&1 || true
    [ ${#made[@]} -eq 0 ] || buildah rm "${made[@]}" >/dev/null 2>&1 || true
    rm -rf "$work"
}
trap end EXIT
fail() { echo "not so: $*" >&2; engine logs "$container" >&2 2>/dev/null || true; exit 1; }

if [ "$base" = debian ]; then
    # As Debian's own slim image: no manuals, no translations, and /bin in /usr without the program that moves it there.
    nice mmdebstrap --quiet --variant=minbase --include=usr-is-merged --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
        --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/share/doc/*' \
        --dpkgopt='path-include=/usr/share/doc/*/copyright' bookworm "$work/base.tar" \
        "deb http://deb.debian.org/debian bookworm main" "deb http://deb.debian.org/debian bookworm-updates main" \
        "deb http://deb.debian.org/debian-security bookworm-security main" >/dev/null
    base=localhost/htvm-base
    made=("$(buildah from scratch)")
    buildah add -q "${made[0]}" "$work/base.tar" / >/dev/null
    buildah config --cmd bash --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "${made[0]}"
    buildah commit -q --rm "${made[0]}" $base >/dev/null
    made=()
fi

# Docker's format: that of OCI has no health checks.
nice buildah bud --layers --format docker ${runtime:+--runtime "$runtime"} ${HTVM_CCACHE:+--volume "$HTVM_CCACHE:/ccache"} \
    --build-arg BASE="$base" -f packaging/Containerfile -t "$image" . >"$work/log" 2>&1 || { cat "$work/log"; fail "the image is built"; }

# As it is meant to be run, on a network of its own, with a root that nobody can write to.
inside() { engine exec "$container" "$@"; }
mkdir "$work/streams"
chmod 755 "$work" "$work/streams"
cp tests/data/conformance/tracked_4.htvm "$work/streams/person.htvm"
# The check is run when it is asked for: podman's own timer is systemd's, and it complains where there is none.
engine --log-level fatal run -d --name "$container" --network none --read-only --cap-drop all \
    --ulimit nofile=4096 --ulimit nproc=512 -v "$work/streams:/var/lib/htvm:ro" "$image" >/dev/null
for _ in $(seq 100); do
    engine healthcheck run "$container" >/dev/null 2>&1 && break
    sleep 0.1
done
engine healthcheck run "$container" >/dev/null || fail "the health check finds the hub well"
echo "the health check finds the hub well"
[ "$(inside id -un)" = htvm ] || fail "the hub runs as htvm"
! inside test -w /usr/bin/htvm || fail "the program belongs to others"
echo "the hub runs as a user of its own: $(inside id)"
# The file that it serves is the file; what is published to it is watched, frame by frame.
inside bash -c "exec 3<>/dev/tcp/127.0.0.1/8080 && printf 'GET /files/person.htvm HTTP/1.0\r\nHost: localhost\r\n\r\n' >&3 && cat <&3" \
    >"$work/answer"
tail -c "$(stat -c %s "$work/streams/person.htvm")" "$work/answer" | cmp - "$work/streams/person.htvm" || fail "the hub serves a file"
engine exec -d "$container" htvm publish person.htvm ws://127.0.0.1:8080/publish/anna --loop >/dev/null
inside timeout 60 htvm decode ws://127.0.0.1:8080/watch/anna --frames 30 -o - --quiet >"$work/watched"
[ "$(grep -ac '^end_header' "$work/watched")" -eq 30 ] || fail "30 frames of a live stream are watched"
echo "a file is served as it is, and 30 frames of a live stream are watched"
# A hub that serves nothing any more is not healthy; one that is told to end, ends well.
engine kill --signal STOP "$container" >/dev/null
! timeout 30 podman ${runtime:+--runtime "$runtime"} healthcheck run "$container" >/dev/null 2>&1 || fail "the health check finds a hub that hangs ill"
engine kill --signal CONT "$container" >/dev/null
echo "the health check finds a hub that hangs ill"
engine stop -t 8 "$container" >/dev/null
[ "$(engine inspect -f '{{.State.ExitCode}}' "$container")" -eq 0 ] || fail "the hub ends well"
echo "it ends well when it is told to"
engine image inspect -f "size of $image: {{.Size}} bytes" "$image"
engine save --format docker-archive "$image" | gzip -9 | wc -c | sed 's/$/ bytes packed/'
echo "1 passed, 0 failed"
