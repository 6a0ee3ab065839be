#!/usr/bin/env bash
# Ten seconds of every target, one a processor: what CI runs. Needs the nightly toolchain.
#   fuzz/smoke.sh [SECONDS]
set -euo pipefail
cd "$(dirname "$0")"
cargo +nightly fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz@0.13.2
./seeds.sh
JOBS=${JOBS:-$(nproc)} ./campaign.sh "${1:-10}"
