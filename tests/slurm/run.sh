#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A campaign with the job array of docs/campaign.md on a real Slurm with two nodes on this machine: 24 simulated gyros, three of them
# bad (noisy, turned, no thermometer). The test kills a node; Slurm must finish the campaign with the same bytes as GNU parallel, except
# times. Skipped with the reason if Slurm is not installed (tools/setup slurm) or the user is not root.
. "$(dirname "$0")/../system/lib.sh"
. "$PRISM_SOURCE/tests/system/lot.sh"
cluster=${PRISM_SHARED:-$PRISM_SOURCE/../shared}/slurm
[ -x "$cluster/start" ] || skip "$cluster/start does not exist; it starts the cluster"
for program in slurmctld slurmd sbatch munged parallel; do command -v $program >/dev/null || skip "found no $program; tools/setup slurm installs it"; done
[ "$(id -u)" = 0 ] || skip "only root can start the nodes"
! awk '$2 ~ /:41B1$/ && $4 == "0A" {found = 1} END {exit !found}' /proc/net/tcp || skip "another test cluster is running (port 16817)"

slurm=$dir/s
stop_cluster() { "$cluster/stop" "$slurm"; sleep 1; }
at_exit stop_cluster
export SLURM_CONF=$slurm/slurm.conf
"$cluster/start" "$slurm" >"$dir/start.err" 2>&1 || fail "the cluster did not start"
cd "$dir"

begin=$SECONDS
for i in $(seq 10 30); do gyro lot "S$i" "$i"; done
gyro lot S31 31 --flicker 0.5                      # noisy
gyro lot S32 32 && awk -F, -v OFS=, '/^[#t]/ {print; next} {if (++n > 14000) $5 += 5; print}' lot/S32/cycle1/*.csv |
  grep -v '^# end' >moved && rm lot/S32/cycle1/* && mv moved lot/S32/cycle1/g.csv  # turned during the cycle
gyro lot S33 33 && without_thermometer lot/S33
campaign_file slurm.json lot
sed -i 's/"name": "lot"/"name": "slurm"/' slurm.json
sed 's/"name": "slurm"/"name": "local"/' slurm.json >local.json
echo "24 gyros simulated in $((SECONDS - begin)) s"

standing() { ls "$1.campaign/tasks" 2>/dev/null | wc -l; }
at_least() { [ "$(standing slurm)" -ge "$1" ]; }
sed -n '/^    #!\/bin\/sh/,/^    exit/s/^    //p' "$PRISM_SOURCE/docs/campaign.md" >lot.sh
same "lines of the script" "$(grep -c . lot.sh)" 14
prismcal campaign slurm.json --engine print >tasks.txt
same "printed lines" "$(wc -l <tasks.txt)" 48
sbatch --array=1-16 lot.sh >/dev/null || fail "sbatch"
wait_for 60 at_least 6
# Kills node n2: its daemon, the daemons of its jobs, and their tasks.
kill_tree() {
  local child
  for child in $(ps -o pid= --ppid "$1"); do kill_tree "$child"; done
  kill -9 "$1" 2>/dev/null || true
}
jobs_of_n2=$(squeue -h -w n2 -t R -o %A)
kill -9 "$(cat "$slurm/run/slurmd-n2.pid")"
for job in $jobs_of_n2; do
  for step in $(ps -eo pid,args | awk -v job="[$job." 'index($0, "slurmstepd: " job) {print $1}'); do kill_tree "$step"; done
done
echo "killed node n2 with $(standing slurm) of 48 tasks done"
begin=$SECONDS
wait_for 200 sh -c '[ -z "$(squeue -h)" ]'
prismcal campaign slurm.json --engine print >left.txt
same "lines left" "$(wc -l <left.txt)" 0
same "tasks" "$(standing slurm)" 48
echo "finished by Slurm in $((SECONDS - begin)) s"

begin=$SECONDS
prismcal campaign local.json --engine print >tasks.txt
parallel <tasks.txt 2>local.err || fail "GNU parallel: $(cat local.err)"
echo "GNU parallel took $((SECONDS - begin)) s"
# Removes what differs between runs: times.json, the date of a model, and with it the model's SHA-256.
for name in slurm local; do
  sed -i 's/model.json (SHA-256 [0-9a-f]*)/model.json/' "$name".campaign/tasks/*/report/report.{html,json}
  sed -i 's/"made": *"[^"]*"/"made": ""/' "$name".campaign/tasks/*/model.json
done
diff -r slurm.campaign/tasks local.campaign/tasks >diff.err || fail "Slurm's results differ from those of GNU parallel"
for name in slurm local; do
  prismcal campaign $name.json --collect >$name.out 2>$name.err || fail "collect of $name"
done
diff <(jq -S '.tables' slurm.campaign/report/report.json) <(jq -S '.tables' local.campaign/report/report.json) >diff.err ||
  fail "the reports differ"
bad=$(jq -r '[.tables.gyros.rows[] | select(.[2].text != "accepted") | .[0].text] | unique | join(" ")' slurm.campaign/report/report.json)
for serial in S31 S32 S33; do contains "rejected gyros" "$bad" "$serial z"; done
