#!/usr/bin/env bash
# Runs all tests. Installs what some of them need where it is missing and where the script may: the
# software Vulkan driver for the GPU passes, and Chromium, whose WGSL compiler is strict.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends mesa-vulkan-drivers libvulkan1
    else
        echo "No Vulkan driver found: install one (Debian: mesa-vulkan-drivers) to test the GPU passes." >&2
    fi
fi
if ! command -v chromium >/dev/null; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends chromium
    else
        echo "Chromium not found: install it to check the shaders with a strict compiler." >&2
    fi
fi
# The software driver wants a private runtime folder.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    XDG_RUNTIME_DIR=$(mktemp -d)
    export XDG_RUNTIME_DIR
fi

cargo test --workspace --locked "$@"
# The pure-Rust zstd decoder with its bound on memory, and the table-driven CRC: what a browser runs.
cargo test --locked -p dapple-codec --no-default-features --test memory
cargo test --locked -p dapple-codec --no-default-features --test main -- stream:: reject::
# What an engine embeds, and what a client takes, build alone.
cargo build --locked -p dapple-codec --no-default-features
cargo check --locked --lib --no-default-features
# A client in a browser.
wasm=wasm32-unknown-unknown
if command -v rustup >/dev/null && ! rustup target list --installed | grep -qx "$wasm"; then
    rustup target add "$wasm" || true
fi
if [ -d "$(rustc --print sysroot)/lib/rustlib/$wasm" ]; then
    cargo build --locked -p dapple-codec --no-default-features --target "$wasm"
else
    echo "The target $wasm is not installed: the codec was not built for browsers." >&2
fi
