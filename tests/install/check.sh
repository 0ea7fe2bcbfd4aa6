#!/usr/bin/env bash
# Installs a build into a folder, moves the folder, and builds programs against it: with CMake and with pkg-config, in
# C++ and in C, with static and with shared libraries. Each program must encode or decode exactly what is expected.
# check.sh BUILD_FOLDER
set -euo pipefail
build=$(cd "$1" && pwd)
project=$(cd "$(dirname "$0")/../.." && pwd)
consumer=$project/tests/install/consumer conformance=$project/tests/data/conformance
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }

cmake --install "$build" --prefix "$work/first" >install.log || { cat install.log; exit 1; }
mv first both
libraries=$(dirname "$(cd both && find lib* -name 'libhtvm_decoder.a')") # lib, or lib/x86_64-linux-gnu
version=$(both/bin/htvm --version | cut -d' ' -f2)

# An installation of one kind of library only.
for kind in static shared; do
    cp -a both $kind
    rm $kind/$libraries/cmake/htvm/htvm-*-"$([ $kind = static ] && echo shared || echo static)"*.cmake
done
rm static/$libraries/*.so* shared/$libraries/*.a

# ---- what is there ----------------------------------------------------------------------------------------------------

[ "$(cd both/include/htvm && echo *)" = "$(cd "$project/include/htvm" && echo *)" ] || fail "headers are not all installed"
# Each header compiles by itself.
for header in both/include/htvm/*.hpp; do
    c++ -std=c++20 -fsyntax-only -Wall -Wextra -Werror -Iboth/include -x c++ -include "$header" /dev/null ||
        fail "$header does not compile by itself"
done
for header in both/include/htvm/*.h; do
    cc -std=c99 -fsyntax-only -pedantic -Wall -Wextra -Werror -Iboth/include -x c -include "$header" /dev/null ||
        fail "$header is not C99"
done

# The C interface's libraries export what htvm.h declares, and nothing else.
exports() { nm -D --defined-only "$1" | awk '{ print $3 }' | LC_ALL=C sort; }
grep -oE '\bhtvm_[a-z_]+ ?\(' both/include/htvm/htvm.h | tr -d ' (' | LC_ALL=C sort -u >declared
exports both/$libraries/libhtvm_c.so >exported
undeclared=$(LC_ALL=C comm -13 declared exported)
[ -z "$undeclared" ] || fail "libhtvm_c.so exports $undeclared"
for name in htvm_version htvm_decoder_create htvm_encoder_create htvm_encoder_receive_packet; do
    grep -qx $name exported || fail "libhtvm_c.so does not export $name"
done
if exports both/$libraries/libhtvm_c_decoder.so | grep -v '^htvm_' || exports both/$libraries/libhtvm_c_decoder.so | grep encoder; then
    fail "libhtvm_c_decoder.so exports more than the decoder"
fi

# ---- programs -----------------------------------------------------------------------------------------------------------

# links PROGRAM KIND: it needs shared libraries at start-up only if it was linked with them.
links() {
    local needed
    needed=$(readelf -d "$1" | grep -cE "NEEDED.*libhtvm_[a-z_]+\.so\.${version%.*}\]") || true
    [ "$([ "$needed" -gt 0 ] && echo shared || echo static)" = "$2" ] || fail "$1 is not linked $2"
}
# decodes PROGRAM: the conformance streams, to the expected frames and counts.
decodes() {
    local stream
    for stream in "$conformance"/*.htvm; do
        diff <("$1" "$stream") <(cut -d' ' -f1-4 "${stream%.htvm}.digests") >difference ||
            { cat difference; fail "$1 decodes $stream to other frames"; }
    done
}
# encodes PROGRAM: what the first of them encoded.
encodes() {
    "$1" stream.htvm || fail "$1"
    [ -f expected.htvm ] || cp stream.htvm expected.htvm
    cmp stream.htvm expected.htvm || fail "$1 encodes to other bytes"
}
programs=0
# works PROGRAM COMPONENT KIND
works() {
    links "$1" "$3"
    case $2 in
        encoder) encodes "$1" ;;
        decoder) decodes "$1" ;;
        c) encodes "$1" ;;
        c_decoder) "$project/tests/c_api/examples.sh" "${1/%_decoder/}" "$1" "$conformance" >/dev/null || fail "$1" ;;
        draco | live | c_live) "$1" || fail "$1" ;;
    esac
    programs=$((programs + 1))
}
# by_cmake KIND INSTALLATION "COMPONENTS" CMAKE_ARGUMENTS...
by_cmake() {
    local kind=$1 installation=$2 components=$3 component folder=cmake_$((++folders))
    shift 3
    cmake -S "$consumer" -B "$folder" -DCMAKE_PREFIX_PATH="$work/$installation" -DEXAMPLES="$project/examples" \
        "-DCOMPONENTS=${components// /;}" "$@" >"$folder.log" 2>&1 || { cat "$folder.log"; fail "find_package: $components"; }
    grep -q "^htvm_DIR:PATH=$work/$installation/" "$folder/CMakeCache.txt" || fail "another htvm was found"
    cmake --build "$folder" -j 2 >>"$folder.log" 2>&1 || { cat "$folder.log"; fail "$kind by CMake: $components"; }
    for component in $components; do
        [ "$component" = "$kind" ] || works "$folder/use_$component" "$component" "$kind"
    done
}
folders=0
plugged_in= # what needs libraries of others
for name in draco live c_live; do [ ! -e both/$libraries/libhtvm_$name.a ] || plugged_in+=" $name"; done
without_eigen=-DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON
by_cmake static both "decoder" $without_eigen
by_cmake static both "static encoder c c_decoder$plugged_in" $without_eigen
by_cmake static static "c c_decoder" -DBUILD_SHARED_LIBS=ON # there is nothing else
by_cmake shared both "decoder encoder c c_decoder$plugged_in" -DBUILD_SHARED_LIBS=ON
by_cmake shared shared "shared decoder"
by_cmake shared shared "c c_decoder" -DC_ALONE=ON
# Missing components are reported.
if cmake -S "$consumer" -B missing -DCMAKE_PREFIX_PATH="$work/static" "-DCOMPONENTS=decoder;shared" >missing.log 2>&1; then
    fail "shared libraries were found that are not there"
fi
grep -q "htvm is installed without shared libraries" missing.log || { cat missing.log; fail "no reason was given"; }

# by_pkg_config KIND
by_pkg_config() {
    local kind=$1 component source compiler package flags
    mkdir "pc_$kind"
    for component in decoder encoder c c_decoder live c_live; do
        case $component in
            c) compiler="cc -std=c99" source=$project/examples/encode.c ;;
            c_decoder) compiler="cc -std=c99" source=$project/examples/decode.c ;;
            c_live) compiler="cc -std=c99" source=$consumer/use_c_live.c ;;
            *) compiler="c++ -std=c++20" source=$consumer/use_$component.cpp ;;
        esac
        package=htvm-${component/_/-}
        flags=$(PKG_CONFIG_PATH=$work/$kind/$libraries/pkgconfig pkg-config --cflags --libs \
            $([ "$kind" = shared ] || echo --static) "$package")
        # shellcheck disable=SC2086
        $compiler "$source" -o "pc_$kind/use_$component" $flags -Wl,-rpath,"$work/$kind/$libraries" ||
            fail "$kind by pkg-config: $package: $flags"
        works "pc_$kind/use_$component" $component "$kind"
    done
}
by_pkg_config static
by_pkg_config shared

# ---- the project within another, and without Eigen --------------------------------------------------------------------

mkdir outer
cat >outer/CMakeLists.txt <<TEXT
cmake_minimum_required(VERSION 3.22)
project(outer LANGUAGES CXX)
add_subdirectory($project htvm)
add_executable(use_decoder $consumer/use_decoder.cpp)
target_link_libraries(use_decoder htvm::decoder)
TEXT
for shared in OFF ON; do
    cmake -G Ninja -S outer -B outer_$shared -DBUILD_SHARED_LIBS=$shared -DHTVM_BUILD_ENCODER=OFF $without_eigen >outer.log 2>&1 ||
        { cat outer.log; fail "add_subdirectory"; }
    grep -qE "^build use_decoder:.*htvm/lib/libhtvm_decoder\.$([ $shared = ON ] && echo so || echo a)" outer_$shared/build.ninja ||
        fail "BUILD_SHARED_LIBS=$shared does not choose the library within another project"
    if grep -q "_encoder_\|/test_" outer_$shared/build.ninja; then fail "HTVM_BUILD_ENCODER=OFF builds the encoder"; fi
done
echo "$programs passed, 0 failed"
