#!/usr/bin/env bash
# Tests of the C library from outside: programs in C11 and C++17 under the address and undefined-behaviour
# sanitizers, the symbols that the library shows, and all conformance vectors through a decoder in C. Needs
# gcc and g++. `DAPPLE` is the program that runs the vectors, `target/debug/dapple` if not set.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-$PWD/target}
dapple=${DAPPLE:-$target/debug/dapple}
out=$target/c
here=embed/c
mkdir -p "$out"

cargo build --locked -p dapple-c
library=$target/debug/libdapple_c.a

warnings="-Wall -Wextra -Werror -pedantic -I$here/include"
sanitizers="-g -O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
# What Rust's standard library takes from the system.
system="-lpthread -ldl -lm"
# shellcheck disable=SC2086
build() { # COMPILER SOURCE NAME FLAGS
    $1 $warnings $4 "$here/$2" "$library" $system -o "$out/$3"
}
# The header alone, in both languages, and the layout of its structs.
# shellcheck disable=SC2086
gcc -std=c11 $warnings -c -x c "$here/tests/layout.c" -o "$out/layout.o"
# shellcheck disable=SC2086
g++ -std=c++17 $warnings -c -x c++ "$here/tests/layout.c" -o "$out/layout.o"
build "gcc -std=c11" examples/decode.c decode "$sanitizers"
build "gcc -std=c11" examples/encode.c encode "$sanitizers"
build "gcc -std=c11" tests/memory.c memory "$sanitizers"
build "gcc -std=c11" conformance/decoder.c conformance-sanitized "$sanitizers"
build "gcc -std=c11" conformance/decoder.c conformance "-O2"
build "g++ -std=c++17" examples/decode.cpp decode-cpp "$sanitizers"

"$out/encode"
streams=(spec/examples/{points,probes,regions,vertices}.dapple)
for stream in "${streams[@]}"; do
    "$out/decode" "$stream" >"$out/decode.txt"
    "$out/decode-cpp" "$stream" >"$out/decode-cpp.txt"
    cmp <(grep -o '^frame [0-9]*' "$out/decode.txt") <(grep -o '^frame [0-9]*' "$out/decode-cpp.txt")
    "$out/conformance-sanitized" <"$stream" | cmp - "${stream%.dapple}.dump"
done
for damaged in /dev/null "$here/test.sh"; do
    if "$out/decode" "$damaged" 2>"$out/error.txt"; then
        echo "$damaged was decoded" >&2
        exit 1
    fi
    grep -q '^E1' "$out/error.txt"
done
# Not that of points, which has zstd records: the zstd decoder in Rust ends the program without memory.
"$out/memory" spec/examples/{probes,regions,vertices}.dapple

# No symbols of other libraries: a program may link a zstd, lz4 or xxHash of its own.
symbols=$(nm --extern-only --defined-only "$library" 2>/dev/null | awk 'NF == 3 { print $3 }')
if grep '^\(ZSTD\|HUF\|FSE\|HIST\|XXH\|LZ4\|POOL\|COVER\|ZDICT\)' <<<"$symbols"; then
    echo "The static library shows these symbols of other libraries." >&2
    exit 1
fi
missing=$(grep -o '\bdapple_[a-z_]*(' "$here/include/dapple.h" | tr -d '(' | sort -u | while read -r name; do
    grep -qx "$name" <<<"$symbols" || echo "$name"
done)
if [ -n "$missing" ]; then
    echo "The static library lacks" $missing >&2
    exit 1
fi

"$dapple" conformance --vectors conformance/vectors --decoder "$out/conformance" --batch | tail -n 4
