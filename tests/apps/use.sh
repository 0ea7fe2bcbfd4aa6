#!/usr/bin/env bash
# Every command of docs/use.md, in its order, in one folder. Lines that show something until Ctrl-C are run for a moment.
. "$(dirname "$0")/expect.sh"

mkdir bin
ln -s "$htvm" bin/htvm
PATH=$PWD/bin:$PATH

# The lines of the blocks marked sh.
mapfile -t lines < <(awk '/^```/ { inside = ($0 == "```sh"); next } inside && NF' "$project/docs/use.md")
[ ${#lines[@]} -ge 15 ] || fail "docs/use.md has only ${#lines[@]} commands"

for line in "${lines[@]}"; do
    case $line in
        'htvm play '* | 'htvm serve '*)
            command=${line%%#*}
            # Not at the address of the manual, where something else may listen.
            command="${command//--port 8080/} --port 0"
            [[ $command = 'htvm play '* ]] && command+=" --no-open"
            said=$(timeout 5 bash -c "exec $command" 2>&1)
            case $? in
                124) grep -q 'http://' <<<"$said" || fail "$line: said no address: $said" ;;
                4) grep -q 'without the web player' <<<"$said" || fail "$line: $said" ;;
                *) fail "$line: $said" ;;
            esac ;;
        *)
            said=$(bash -c "$line" 2>&1 </dev/null) || fail "$line: $said" ;;
    esac
done

[ -s person.htvm ] && [ -s twice.htvm ] && [ -s poster.png ] && [ -s person.glb ] && [ -s turn/00000.png ] || fail "not everything was made: $(ls)"
[ "$(find meshes -name '*.ply' | wc -l)" -eq 24 ] || fail "meshes/ has not 24 meshes"
[ "$(find two -name '*.obj' | wc -l)" -eq 2 ] || fail "two/ has not 2 meshes"
done_with "docs/use.md does what it says"
