#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the fuzzers and runs each for SECONDS (default 60). New inputs are kept in build/fuzz/corpus, failing inputs in
# build/fuzz/found. usage: tests/fuzz/run.sh [--changed] [SECONDS [MIN_RUNS]]
# --changed: only fuzzers of directories that the last 50 commits changed. Exit code 1 if a fuzzer fails, or if all fuzzers together make fewer than MIN_RUNS runs.
set -euo pipefail
cd "$(dirname "$0")/../.."
changed=
if [ "${1:-}" = --changed ]; then
  shift
  changed=$(git log -50 --format= --name-only | sort -u)
fi
seconds=${1:-60}
least=${2:-1}
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
cmake --preset fuzz >/dev/null

# code_of FUZZER: the folder or the files whose code it runs.
code_of() {
  case "$1" in
    fuzz_frame_* | fuzz_commands) echo drivers/wire ;;
    fuzz_model_text | fuzz_csv_row) echo compensation ;;
    fuzz_config) echo config ;;
    fuzz_capture_reader) echo drivers ;;
    fuzz_table) echo 'tools/prismcal/(plain_table|units)' ;;
    fuzz_rpc_line) echo daemon/socket ;;
    fuzz_log_header) echo daemon/log ;;
    *) echo tools/prismcal ;;
  esac
}
fuzzers=()
for source in tests/fuzz/fuzz_*.cpp; do
  name=$(basename "$source" .cpp)
  if [ -z "$changed" ] || grep -qE "^($(code_of "$name")|tests/fuzz)[/.]" <<<"$changed"; then fuzzers+=("$name"); fi
done
if [ "${#fuzzers[@]}" -eq 0 ]; then
  echo "tests/fuzz/run.sh: the last 50 commits changed no code of a fuzzer"
  exit 0
fi
cmake --build build/fuzz --target "${fuzzers[@]}"
fuzzers=("${fuzzers[@]/#/build/fuzz/tests/fuzz/}")
mkdir -p build/fuzz/found

# run_one FUZZER: prints its number of runs, or the end of its log.
run_one() {
  local name=${1##*/} seeds=() said=good
  local corpus=build/fuzz/corpus/$name
  mkdir -p "$corpus"
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
  "$1" -max_total_time="$seconds" -print_final_stats=1 -artifact_prefix="build/fuzz/found/$name-" "$corpus" "${seeds[@]}" \
    >"$corpus.log" 2>&1 || { said=FAILED; tail -40 "$corpus.log"; }
  echo "$name: $(runs_of "$corpus.log") runs in $seconds s, $said"
  [ "$said" = good ]
}
runs_of() { awk '/^stat::number_of_executed_units:/ {n += $2} END {print n + 0}' "$@"; }
export -f run_one runs_of
export seconds

code=0
printf '%s\0' "${fuzzers[@]}" | xargs -0 -n 1 -P "$(nproc)" bash -c 'run_one "$1"' fuzz || code=1
logs=("${fuzzers[@]/#*\//build/fuzz/corpus/}")
total=$(runs_of "${logs[@]/%/.log}" </dev/null)
if [ "$total" -lt "$least" ]; then
  echo "tests/fuzz/run.sh: found $total runs, expected at least $least" >&2
  code=1
fi
exit "$code"
