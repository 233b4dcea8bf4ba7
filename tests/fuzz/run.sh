#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds every fuzzer and runs each for SECONDS (default 60). New inputs are kept in build/fuzz/corpus, failing inputs in
# build/fuzz/found. usage: tests/fuzz/run.sh [SECONDS [MIN_RUNS]]
# Exit code 1 if a fuzzer fails, or if all fuzzers together make fewer than MIN_RUNS runs.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
least=${2:-1}
total=0
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz
mkdir -p build/fuzz/found
code=0
for fuzzer in build/fuzz/tests/fuzz/fuzz_*; do
  [ -f "$fuzzer" ] && [ -x "$fuzzer" ] || continue
  name=$(basename "$fuzzer")
  corpus=build/fuzz/corpus/$name
  mkdir -p "$corpus"
  seeds=()
  case "$name" in
    fuzz_model_text | fuzz_model_report) seeds=(config/models) ;;
    fuzz_frame_description | fuzz_description_report) seeds=(config/frames) ;;
    fuzz_log_header) seeds=(tests/fuzz/corpus/log) ;;
    fuzz_csv_row) seeds=(tests/replay/captures) ;;
    fuzz_config) seeds=(config/examples tests/fuzz/corpus/config) ;;
    fuzz_capture_reader) seeds=(tests/fuzz/corpus/capture) ;;
    fuzz_table) seeds=(tests/files/data) ;;
    fuzz_rpc_line) seeds=(tests/fuzz/corpus/rpc) ;;
  esac
  "$fuzzer" -max_total_time="$seconds" -print_final_stats=1 -artifact_prefix="build/fuzz/found/$name-" "$corpus" "${seeds[@]}" \
    >"$corpus.log" 2>&1 && said=good || { said=FAILED code=1; tail -40 "$corpus.log"; }
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$corpus.log")
  total=$((total + ${runs:-0}))
  echo "$name: ${runs:-0} runs in $seconds s, $said"
done
if [ "$total" -lt "$least" ]; then
  echo "tests/fuzz/run.sh: found $total runs, expected at least $least" >&2
  code=1
fi
exit "$code"
