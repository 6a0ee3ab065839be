#!/usr/bin/env bash
# Builds `dapple.wasm`, and `dapple-without-zstd.wasm`, which refuses records that are packed by zstd. Needs Rust's
# target wasm32-unknown-unknown. `WASM_OPT` names a `wasm-opt` of binaryen that makes both smaller; none is needed.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-$PWD/target}
build() { # NAME FLAGS
    # A folder of its own for each set of flags, so that neither build undoes the other.
    RUSTFLAGS="$2" CARGO_TARGET_DIR="$target/$1" cargo rustc --locked --quiet -p dapple-c --lib --crate-type cdylib \
        --target wasm32-unknown-unknown --no-default-features --profile wasm
    cp "$target/$1/wasm32-unknown-unknown/wasm/dapple_c.wasm" "embed/js/$1.wasm"
    if [ -n "${WASM_OPT:-}" ]; then
        "$WASM_OPT" -Oz --enable-bulk-memory --enable-sign-ext --enable-mutable-globals \
            --enable-nontrapping-float-to-int --enable-multivalue --enable-reference-types \
            "embed/js/$1.wasm" -o "embed/js/$1.wasm"
    fi
}
build dapple ""
build dapple-without-zstd "--cfg dapple_without_zstd"
