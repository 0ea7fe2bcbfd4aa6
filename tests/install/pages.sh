#!/usr/bin/env bash
# Man pages and completions, as the programs write them: the pages format without warnings and have every option of the
# help; the shells accept the completions, which offer the right words. pages.sh HTVM HTVM_LAB
set -euo pipefail
htvm=$1 lab=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$htvm" --write-pages "$work"
"$lab" --write-pages "$work"
cd "$work"
checks=0
fail() { echo "FAILED: $*"; exit 1; }

# ---- man pages --------------------------------------------------------------------------------------------------------

[ "$(cd man1 && echo *)" = "htvm-calibrate.1 htvm-check.1 htvm-compare.1 htvm-cut.1 htvm-decode.1 htvm-demo.1 htvm-encode.1 htvm-help.1 htvm-index.1 htvm-info.1 htvm-join.1 htvm-lab-bake.1 htvm-lab-decoding.1 htvm-lab-endure.1 htvm-lab-events.1 htvm-lab-help.1 htvm-lab-hierarchy.1 htvm-lab-rd.1 htvm-lab-reproduce.1 htvm-lab.1 htvm-link.1 htvm-pack.1 htvm-play.1 htvm-publish.1 htvm-render.1 htvm-serve.1 htvm-still.1 htvm-synth.1 htvm-transcode.1 htvm-verify.1 htvm.1" ] ||
    fail "the pages are $(cd man1 && echo *)"
for page in man1/*.1; do
    for section in NAME SYNOPSIS DESCRIPTION OPTIONS '"EXIT STATUS"' '"SEE ALSO"'; do
        grep -qx "\.SH $section" "$page" || fail "$page has no section $section"
    done
    if command -v groff >/dev/null; then
        said=$(groff -man -ww -Tutf8 "$page" 2>&1 >/dev/null)
        [ -z "$said" ] || fail "groff: $said"
    fi
    if command -v mandoc >/dev/null; then
        # Pages have the version, not a day.
        said=$(mandoc -Tlint -W warning "$page" 2>&1 | grep -v 'missing date') || true
        [ -z "$said" ] || fail "$said"
    fi
    checks=$((checks + 1))
done
command -v groff >/dev/null || echo "groff is not installed: the pages are not formatted"
# has_options PROGRAM COMMAND NAME: every option of the whole help is on the page.
has_options() {
    local option all=--help
    if "$1" "$2" --help | grep '^--help-all shows' >/dev/null; then all=--help-all; fi
    for option in $(COLUMNS=1000 "$1" "$2" $all | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+' | grep -oE '\-\-[a-z-]+'); do
        grep -qF -- "\\fB${option//-/\\-}\\fR" "man1/$3-$2.1" || fail "the page of $3 $2 lacks $option"
        checks=$((checks + 1))
    done
}
for command in synth encode decode info calibrate compare cut join pack transcode index verify still render play demo publish serve link; do has_options "$htvm" $command htvm; done
for command in rd decoding reproduce events endure bake; do has_options "$lab" $command htvm-lab; done
[ $checks -gt 100 ] || fail "only $checks checks: the help was not read"
grep -q '^\.SH EXAMPLES' man1/htvm-encode.1 || fail "no examples"

# ---- completions --------------------------------------------------------------------------------------------------------

mkdir -p capture 'old takes' && touch person.htvm "a b.htvm"
# offers "EXPECTED" "WORDS": what bash completes the last word to, sorted.
offers() {
    local offered
    offered=$(
        source bash/htvm
        source bash/htvm-lab
        read -ra COMP_WORDS <<<"$2"
        [[ $2 != *' ' ]] || COMP_WORDS+=("")
        COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
        function=$(complete -p "${COMP_WORDS[0]}" | sed -E 's/.*-F ([a-z_]+) .*/\1/')
        "$function"
        printf '%s\n' "${COMPREPLY[@]}" | LC_ALL=C sort | paste -sd '|'
    )
    [ "$offered" = "$1" ] || fail "bash offers '$offered' for '$2', not '$1'"
    checks=$((checks + 1))
}
offers 'calibrate|check|compare|cut|decode|demo|encode|help|index|info|join|link|pack|play|publish|render|serve|still|synth|transcode|verify' 'htvm '
offers 'decode' 'htvm dec'
offers '--help|--version' 'htvm --'
offers 'paper|topology|tracked' 'htvm encode capture --profile '
offers 'topology' 'htvm encode capture --profile to'
offers 'any|bone' 'htvm encode --reference '
offers 'intra|previous' 'htvm encode --tracked-from '
offers '--quality|--quiet' 'htvm encode --q'
offers '' 'htvm encode --quality '
offers 'a b.htvm' 'htvm decode a'
offers 'person.htvm' 'htvm decode -o out p'
for command in cut join pack transcode index verify play; do offers 'person.htvm' "htvm $command p"; done
offers 'capture' 'htvm synth -o c'
offers 'animate|gap' 'htvm decode a.htvm --conceal '
offers 'flat|smooth|unlit' 'htvm compare a b --shading '
offers 'bake|decoding|endure|events|help|hierarchy|rd|reproduce' 'htvm-lab '
offers 'm1|m2|m3' 'htvm-lab rd --metrics m'
# The other shells, where they are.
if command -v fish >/dev/null; then
    for program in htvm htvm-lab; do fish --no-execute fish/$program.fish || fail "fish/$program.fish"; done
    offered() { fish --no-config -c "source fish/htvm.fish; complete -C '$1'" | cut -f1 | LC_ALL=C sort | paste -sd '|'; }
    [ "$(offered 'htvm encode --profile ')" = 'paper|topology|tracked' ] || fail "fish offers $(offered 'htvm encode --profile ')"
    [ "$(offered 'htvm dec')" = 'decode' ] || fail "fish offers $(offered 'htvm dec')"
    [ "$(offered 'htvm encode --quali')" = '--quality' ] || fail "fish offers $(offered 'htvm encode --quali')"
else
    echo "fish is not installed: its completions are not tried"
fi
if command -v zsh >/dev/null; then
    for program in htvm htvm-lab; do zsh -fn zsh/_$program || fail "zsh/_$program"; done
    # What it hands to zsh's _arguments once a command is known.
    zsh -f -c 'compdef() {}; source zsh/_htvm; state=argument; line=(encode)
               _arguments() { [[ $1 = -C ]] || print -l -- "$@" }
               functions[_htvm]=${functions[_htvm]/local curcontext=\$curcontext state line/}; _htvm' >zsh_specs || fail "zsh/_htvm"
    grep -qx -- '(--profile)--profile\[.*\]:word:(tracked topology paper)' zsh_specs || { cat zsh_specs; fail "zsh"; }
    grep -qx -- '(-o --output)-o\[.*\]:FILE:_files' zsh_specs || fail "zsh"
else
    echo "zsh is not installed: its completions are not tried"
fi
echo "$checks passed, 0 failed"
