#!/usr/bin/env bash
# Builds the package and tests it in Node and Chromium, with all conformance vectors. `DAPPLE` is the program that
# runs the vectors, `target/debug/dapple` if not set. Without Node, nothing is tested.
set -euo pipefail
cd "$(dirname "$0")/../.."
dapple=${DAPPLE:-${CARGO_TARGET_DIR:-$PWD/target}/debug/dapple}
if ! command -v node >/dev/null; then
    echo "Not found: node. The web package was not tested." >&2
    exit 0
fi
embed/js/build.sh
node --test embed/js/test/unit.mjs
if command -v chromium >/dev/null; then
    node embed/js/test/page.mjs
fi
# The module's memory is address space that it does not use.
"$dapple" conformance --vectors conformance/vectors --decoder 'node embed/js/test/conformance.mjs' --batch \
    --prefixes none --memory 0 2>/dev/null | tail -n 1
# The package has these files and no others.
if command -v npm >/dev/null; then
    (cd embed/js && npm pack --dry-run --ignore-scripts --json) |
        node -e '
            const [{ files }] = JSON.parse(require("fs").readFileSync(0));
            const names = files.map(({ path }) => path).sort().join(" ");
            const wanted = "README.md dapple-without-zstd.wasm dapple.d.ts dapple.js dapple.wasm package.json";
            if (names !== wanted) throw new Error(`npm pack has ${names}`);'
fi
