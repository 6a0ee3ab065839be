#!/usr/bin/env bash
# Runs all tests and prints their totals; the exit status is not 0 if one fails. Arguments go to the first
# `cargo test` (`tests/run.sh points::` runs the tests of that name there). Installs what some tests
# need where it is missing and where the script may: the software Vulkan driver for the GPU passes, and
# Chromium, whose WGSL compiler is strict.
set -euo pipefail
cd "$(dirname "$0")/.."

echo "Building and running all tests; the build is the longer part from an empty ${CARGO_TARGET_DIR:-target}."

get() { # WHAT-FOR PACKAGE...
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        echo "Installing ${*:2}, $1."
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${@:2}"
    else
        echo "Not found: ${*:2}, $1. Tests that need it are skipped or fail." >&2
    fi
}
if ! ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1; then
    get "the software Vulkan driver" mesa-vulkan-drivers libvulkan1
fi
if ! command -v chromium >/dev/null; then
    get "whose WGSL compiler checks the shaders" chromium
fi
# The software driver wants a private runtime folder.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    XDG_RUNTIME_DIR=$(mktemp -d)
    export XDG_RUNTIME_DIR
fi

# Whole builds only lose by incremental compilation: a sixth of the time and most of the disk.
export CARGO_INCREMENTAL=${CARGO_INCREMENTAL:-0}

log=$(mktemp)
# The last line, whatever ends the script.
totals() {
    local status=$?
    awk -v seconds=$SECONDS -v status=$status '
        /^test result: / { passed += $4; failed += $6; ignored += $8 }
        /^test .* \.\.\. FAILED$/ { sub(/^test /, ""); sub(/ \.\.\. FAILED$/, ""); names = names "\n    " $0 }
        END {
            if (names != "") print "Failed tests:" names
            if (status != 0 && failed == 0) print "Stopped by an error: see above."
            printf "%d passed, %d failed, %d ignored, %d s\n", passed, failed, ignored, seconds
        }' "$log"
    rm -f "$log"
    exit $status
}
trap totals EXIT
run() { # TITLE COMMAND...
    echo "== $1"
    "${@:2}" 2>&1 | tee -a "$log"
}

run "All crates" cargo test --workspace --locked --no-fail-fast "$@"
run "The codec without the standard library: Rust's zstd decoder with its bound on memory, CRC by table" \
    cargo test --locked -p dapple-codec --no-default-features --test main --test memory
run "The client's half of the program alone" cargo check --locked --lib --no-default-features

wasm=wasm32-unknown-unknown
if command -v rustup >/dev/null && ! rustup target list --installed | grep -qx "$wasm"; then
    rustup target add "$wasm" || true
fi
if [ -d "$(rustc --print sysroot)/lib/rustlib/$wasm" ]; then
    run "The codec for browsers" cargo build --locked -p dapple-codec --no-default-features --target "$wasm"
else
    echo "The target $wasm is not installed: the codec was not built for browsers." >&2
fi
