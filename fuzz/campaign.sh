#!/usr/bin/env bash
# Runs fuzz targets, each for so many seconds, $JOBS at a time (1), and adds them up. May be stopped and
# run again: corpus, logs and curves go on. A finding ends a target and the exit status says so.
#   fuzz/campaign.sh SECONDS [TARGET...]
set -euo pipefail
cd "$(dirname "$0")"
seconds=${1:?usage: campaign.sh SECONDS [TARGET...]}
shift
cargo +nightly fuzz build --fuzz-dir .
bin=$(find target -path '*/release/container' -type f -printf '%T@ %p\n' | sort -n | tail -1 | cut -d' ' -f2)
bin=$(dirname "$bin")
[ $# -gt 0 ] || mapfile -t targets < <(cargo +nightly fuzz list --fuzz-dir .)
[ $# -eq 0 ] || targets=("$@")
if ! printf '' | ${DAPPLE_DECODER:-../conformance/decoders/python/run.sh} --batch; then
    echo "differential is left out: its other decoder does not run" >&2
    for i in "${!targets[@]}"; do [ "${targets[$i]}" != differential ] || unset "targets[$i]"; done
fi
mkdir -p campaign

# Into the target's log, with the seconds since the epoch before each line of libFuzzer, for the curve.
fuzz() { # TARGET
    local found=0 log=campaign/$1.log
    mkdir -p "corpus/$1" "artifacts/$1"
    echo "=== start $(date +%s)" >>"$log"
    TIMEFORMAT='=== cpu %U'
    { time nice -n "${NICE:-19}" "$bin/$1" "corpus/$1" -dict=dapple.dict -max_total_time="$seconds" \
        -max_len=8192 -len_control=50 -timeout=20 -rss_limit_mb=2048 -print_final_stats=1 \
        -artifact_prefix="artifacts/$1/"; } 2>&1 |
        while IFS= read -r line; do printf '%(%s)T %s\n' -1 "$line"; done >>"$log" || found=1
    python3 curve.py "$1"
    return $found
}

trap 'trap - TERM; kill 0' INT
found=0 running=0
for target in "${targets[@]}"; do
    if [ $running -ge "${JOBS:-1}" ]; then
        wait -n || found=1
        running=$((running - 1))
    fi
    fuzz "$target" &
    running=$((running + 1))
done
while [ $running -gt 0 ]; do
    wait -n || found=1
    running=$((running - 1))
done
python3 curve.py
exit $found
