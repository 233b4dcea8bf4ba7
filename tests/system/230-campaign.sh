# SPDX-License-Identifier: MIT
# A campaign on the cores of this machine with GNU parallel, as docs/campaign.md describes: each gyro with each model. A gyro without
# a thermometer is rejected in one line, a killed task runs again, existing results are kept, and a changed recording repeats only its
# own tasks.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/lot.sh"
command -v parallel >/dev/null || skip "no GNU parallel; tools/setup slurm installs it"

gyro lot S1 1
gyro lot S2 2
gyro lot S3 3
without_thermometer lot/S3
campaign_file lot.json lot
tasks() { ls lot.campaign/tasks; }
sums() { (cd lot.campaign/tasks && find . -type f | sort | xargs sha256sum); }

prismcal campaign lot.json --plan >plan.out 2>plan.err || fail "plan"
same "the plan" "$(grep -c '^to do: S[123] z, ' plan.out)" 6
code=0; prismcal campaign lot.json >out 2>action.err || code=$?
same "exit code without an action" "$code" 1
contains "its error" "$(cat action.err)" "expected --engine print and a program that runs its lines"
code=0; prismcal campaign lot.json --engine slurm >out 2>engine.err || code=$?
same "exit code of a removed engine" "$code" 64
contains "its error" "$(cat engine.err)" "a job array of Slurm runs its lines"
code=0; prismcal campaign missing.json --plan >out 2>missing.err || code=$?
same "exit code for a missing file" "$code" 78
sed 's/"method"/"methd"/' lot.json >wrong.json
code=0; prismcal campaign wrong.json --plan >out 2>wrong.out || code=$?
same "exit code for an unknown option" "$code" 1
contains "its error" "$(cat wrong.out)" "wrong.json:/models/"
sed 's/"method": "stepwise"/"method": "stepwise", "prior": "models"/' lot.json >wrong.json
code=0; prismcal campaign wrong.json --plan >out 2>wrong.out || code=$?
same "exit code for an option whose files are not inputs" "$code" 78
contains "its error" "$(cat wrong.out)" "/models/stepwise/prior: found it, expected no option of a file"

# The recipe of docs/campaign.md. After a kill, finished tasks are kept, and the same commands run the others.
printed() { prismcal campaign "$1" --engine print >tasks.txt && rm -f jobs.log || fail "the lines of $1"; }
recipe() { exec $(grep -o 'parallel --joblog jobs.log --resume --bar' "$PRISM_SOURCE/docs/campaign.md" | head -1) "$@" <tasks.txt; }
printed lot.json
same "printed lines" "$(wc -l <tasks.txt)" 6
start run recipe --jobs 1
wait_for 30 sh -c 'ls lot.campaign/tasks | grep -q .'
kill -9 "$pid" $(ps -o pid= --ppid "$pid"); wait "$pid" 2>/dev/null || true
sums >before
printed lot.json
(recipe) 2>run.err || fail "the second run: $(cat run.err)"
same "finished tasks" "$(tasks | wc -l)" 6
sums >after
diff <(grep -Ff before after) before >/dev/null || fail "a finished task was run again"
[ -z "$(ls -A lot.campaign/tasks | grep '^\.')" ] || fail "unfinished results: $(ls -A lot.campaign/tasks)"

prismcal campaign lot.json --status >status.out || fail "status: $(cat status.out)"
same "status" "$(head -1 status.out)" "6 of 6 tasks done"
same "rejected tasks" "$(grep -c '^refused: S3 z, ' status.out)" 2
for id in $(tasks); do
  if [ "$(jq -r .serial "lot.campaign/tasks/$id/result.json")" = S3 ]; then continue; fi
  same "the model's gyro" "$(jq -r .gyro.serial "lot.campaign/tasks/$id/model.json")" \
    "$(jq -r .serial "lot.campaign/tasks/$id/result.json")"
  [ -s "lot.campaign/tasks/$id/report/report.html" ] || fail "no report of $id"
done

# The model is the same as that of prismcal train, except for its provenance.
id=$(jq -r 'select(.serial == "S1" and .model == "stepwise").task' lot.campaign/tasks/*/result.json)
prismcal train lot/S1/cycle1 --method stepwise --name stepwise --threads 1 --quiet --out hand.json >/dev/null
same "the model" "$(jq -Sc 'del(.provenance)' "lot.campaign/tasks/$id/model.json")" "$(jq -Sc 'del(.provenance)' hand.json)"

# A changed input repeats only its own tasks.
prismcal campaign lot.json --plan >plan.out
same "nothing to do" "$(grep -c '^to do' plan.out)" 0
rm -r lot/S2; gyro lot S2 22
printed lot.json
same "tasks of the changed gyro" "$(wc -l <tasks.txt)" 2
sh -e tasks.txt || fail "the printed commands"
same "tasks" "$(tasks | wc -l)" 8
printed lot.json
same "tasks left to run" "$(wc -l <tasks.txt)" 0

# If an input disappears, the task fails with a message, and its line is printed again.
sed 's/"name": "lot"/"name": "other"/' lot.json >other.json
printed other.json
mv lot/S1/cycle2 kept
code=0; sh -c "$(grep "task 'S1 z, kernel'" tasks.txt)" 2>gone.out || code=$?
same "exit code without the input" "$code" 1
contains "the failure" "$(cat gone.out)" "not a task of"
mv kept lot/S1/cycle2
printed other.json
(recipe) 2>other.err || fail "the run after a failure: $(cat other.err)"
prismcal campaign other.json --status >status.out || fail "status after the retry"
same "status after the retry" "$(head -1 status.out)" "6 of 6 tasks done"

# --collect writes the report of the lot; --install copies the accepted models. Limits may be changed afterwards.
code=0; prismcal campaign lot.json --collect >collect.out 2>collect.err || code=$?
same "exit code of --collect" "$code" 0
for name in report.html report.json tables/gyros.csv; do [ -s "lot.campaign/report/$name" ] || fail "no $name"; done
same "rows of the report" "$(jq '.tables.gyros.rows | length' lot.campaign/report/report.json)" 6
contains "links" "$(cat lot.campaign/report/report.html)" 'href="../tasks/'
prismcal campaign lot.json --install models/bench >install.out 2>install.err || fail "install: $(cat install.err)"
accepted=$(jq '.models | length' models/bench/manifest.json)
[ "$accepted" -ge 1 ] || fail "no gyro was accepted: $(cat lot.campaign/report/tables/gyros.csv)"
same "installed" "$(ls models/bench | grep -vc manifest)" "$accepted"
(cd models/bench && jq -r '.models[] | "\(.sha256)  \(.file)"' manifest.json | sha256sum -c --quiet) || fail "checksums of the manifest"
sed -i 's/"min": 15/"min": 99/' lot.json
prismcal campaign lot.json --install models/none >install.out 2>install.err || fail "a second --install"
same "models accepted by a limit that no model meets" "$(jq '.models | length' models/none/manifest.json)" 0
