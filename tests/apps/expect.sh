# What the tests of the command line share; sourced with the program's path: a folder to work in, expect and fail.
set -u
export COLUMNS=1000  # what help says stays on one line
htvm=$1
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

fail() { echo "FAILED: $*"; failures=$((failures + 1)); }

# expect CODE WORDS COMMAND...: the command exits with CODE and says WORDS on its standard error or output.
expect() {
    local code=$1 words=$2 said
    shift 2
    said=$("$@" 2>&1 </dev/null | tr -d '\0'; exit "${PIPESTATUS[0]}")
    local got=$?
    if [ $got -ne "$code" ] || ! grep -qF -- "$words" <<<"$said"; then
        printf 'FAILED: %s\n  exit %d, expected %d; said, without "%s":\n%s\n' "$*" $got "$code" "$words" "$said"
        failures=$((failures + 1))
    fi
}

# times STREAM MICROSECONDS: when its frames are shown, in so many microseconds each.
times() {
    "$htvm" info "$1" --json | awk -F'[:,]' -v unit="$2" '/"timestamp_us"/ { printf "%d ", ($2 + 500) / unit }'
}

# interrupted STREAM COMMAND...: the command, which would write kept.htvm, a copy of STREAM, ends at once and leaves it so.
interrupted() {
    local stream=$1 process code
    shift
    "$@" 2>said &
    process=$!
    sleep 0.3
    kill -s INT $process
    wait $process
    code=$?
    [ $code -eq 130 ] && grep -q "interrupted; nothing is written" said || fail "interrupted, $* exits with $code: $(cat said)"
    cmp -s "$stream" kept.htvm && [ ! -e kept.htvm.partial ] || fail "interrupted, $* leaves something"
}

# done_with WHAT: the end of a test.
done_with() {
    [ $failures -eq 0 ] && echo "$1"
    exit $failures
}
