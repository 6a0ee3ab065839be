#!/usr/bin/env bash
# Fills corpus/ with streams to start from.
set -euo pipefail
cd "$(dirname "$0")"
cargo +nightly run --quiet --release --example seeds
