#!/usr/bin/env bash
# Prints how the public interface of dapple-codec differs from that of a commit. The listing comes from
# rustdoc's JSON, which needs a nightly toolchain, so no test runs it.
#   codecs/public-api.sh [COMMIT]    (the last commit of origin/main where none is named)
set -euo pipefail
cd "$(dirname "$0")/.."
commit=${1:-origin/main}
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
cargo public-api --version >/dev/null 2>&1 || cargo install --locked cargo-public-api@0.52.0
files=$(mktemp -d)
trap 'git worktree remove --force "$files/base"; rm -r "$files"' EXIT
git worktree add --quiet --detach "$files/base" "$commit"
list() { (cd "$1" && cargo +nightly public-api --package dapple-codec --simplified 2>"$files/log") || {
    cat "$files/log" >&2
    exit 1
}; }
list "$files/base" >"$files/before"
list . >"$files/after"
if diff --unified=0 "$files/before" "$files/after"; then
    echo "no difference"
fi
