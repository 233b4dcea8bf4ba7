# SPDX-License-Identifier: MIT
# `prismctl export` copies the log of a time span through the socket: the same bytes as the files, also when prismd restarts, and prismcal reads them.
. "$(dirname "$0")/lib.sh"
frames 50
config
start_sim --profile steady --speed 10
start_prismd
wait_for 15 field_above '.log.rows - .log.unsynced' status 8
prismctl export "$dir/all" >"$dir/out" || fail "export: $(cat "$dir/out")"
contains "what it did" "$(cat "$dir/out")" "$dir/all: "
file=$(basename "$dir"/all/*.csv)
sed '$d' "$dir/all/$file" >"$dir/rows"  # without the end line
head -c "$(stat -c %s "$dir/rows")" "$dir/log/$file" | cmp - "$dir/rows" || fail "another content than the log file"
second=$(sed -n '/^time_utc/{n;n;n;p}' "$dir/all/$file" | cut -d, -f1)
prismctl export "$dir/part" --from "$second" --to "${second%Z}" >/dev/null 2>"$dir/e" && fail "an empty span"
contains "an empty span" "$(cat "$dir/e")" "--to: is not after --from"
next=$(sed -n '/^time_utc/{n;n;n;n;n;p}' "$dir/all/$file" | cut -d, -f1)
prismctl export "$dir/two" --from "${second/T/ }" --to "$next" >"$dir/out"
same "rows from the third to before the fifth" "$(sed -n '/^time_utc/,$p' "$dir/two/$file" | sed '$d')" "$(sed -n '/^time_utc/p' "$dir/all/$file"; sed -n '/^time_utc/{n;n;n;p;n;p}' "$dir/all/$file")"
prismctl export "$dir/two" 2>"$dir/e" && fail "written over files"
contains "a directory with files" "$(cat "$dir/e")" "is not empty, expected a new directory"
prismctl export "$dir/x" --from yesterday 2>"$dir/e" && fail "accepted yesterday"
contains "a wrong time" "$(cat "$dir/e")" '--from: found "yesterday", expected a time in UTC such as 2026-11-23T09:11:00'
code=0; prismctl export "$dir/none" --from 2099-01-01 >"$dir/out" || code=$?
same "no row: exit code" "$code" 1
contains "no row" "$(cat "$dir/out")" "0 rows in 0 files"
verified=$(prismcal verify "$dir/all") || fail "prismcal verify: $verified"
