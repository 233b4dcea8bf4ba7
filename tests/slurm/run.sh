#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A campaign on a real Slurm of two nodes on this machine: 24 simulated gyros, three of them bad (noisy, moved, no thermometer). A node
# is killed midway, and so is the program that submitted; the same command finishes, and the result is that of the local engine, byte
# for byte but for times. Skipped, with the reason, where Slurm is not installed (tools/setup slurm) or nobody is root.
. "$(dirname "$0")/../system/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
. "$(dirname "$0")/../system/lot.sh"
cluster=${PRISM_SHARED:-$PRISM_SOURCE/../shared}/slurm
[ -x "$cluster/start" ] || skip "$cluster/start is not there; it starts the cluster"
for program in slurmctld slurmd sbatch munged; do command -v $program >/dev/null || skip "found no $program; tools/setup slurm installs it"; done
[ "$(id -u)" = 0 ] || skip "only root starts the nodes"
! awk '$2 ~ /:41B1$/ && $4 == "0A" {found = 1} END {exit !found}' /proc/net/tcp || skip "another cluster of this kind runs here (port 16817)"

slurm=$dir/s
stop_cluster() { "$cluster/stop" "$slurm"; sleep 1; }
at_exit stop_cluster
export SLURM_CONF=$slurm/slurm.conf
"$cluster/start" "$slurm" >"$dir/start.err" 2>&1 || fail "the cluster does not start"
cd "$dir"

begin=$SECONDS
for i in $(seq 10 30); do gyro lot "S$i" "$i"; done
gyro lot S31 31 --flicker 0.5                      # noisy
gyro lot S32 32 && awk -F, -v OFS=, '/^[#t]/ {print; next} {if (++n > 14000) $5 += 5; print}' lot/S32/cycle1/*.csv |
  grep -v '^# end' >moved && rm lot/S32/cycle1/* && mv moved lot/S32/cycle1/g.csv  # turned midway
gyro lot S33 33 && without_thermometer lot/S33
campaign_file slurm.json lot
sed -i 's/"name": "lot"/"name": "slurm"/' slurm.json
sed 's/"name": "slurm"/"name": "local"/' slurm.json >local.json
echo "24 gyros simulated in $((SECONDS - begin)) s"

standing() { ls "$1.campaign/tasks" 2>/dev/null | wc -l; }
at_least() { [ "$(standing slurm)" -ge "$1" ]; }
start submit prismcal campaign slurm.json --engine slurm
submitter=$pid
wait_for 60 at_least 6
# Node n2, with all it runs: its daemon, the jobs' own daemons, and their tasks.
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
echo "node n2 killed with $(standing slurm) of 48 tasks done"
wait_for 60 at_least 12
kill -9 "$submitter"
wait "$submitter" 2>/dev/null || true
stood=$(standing slurm)
echo "the submitting program killed with $stood of 48 tasks done"
prismcal campaign slurm.json --status >status.out || true
contains "status without the program" "$(cat status.out)" "of 48 tasks done"

begin=$SECONDS
prismcal campaign slurm.json --engine slurm 2>again.err || fail "the second run: $(cat again.err)"
same "tasks" "$(standing slurm)" 48
contains "the end" "$(tail -1 again.err)" " 0 failed, 0 left"
echo "finished by the same command in $((SECONDS - begin)) s"

begin=$SECONDS
prismcal campaign local.json 2>local.err || fail "the local engine: $(cat local.err)"
echo "the local engine took $((SECONDS - begin)) s"
# What differs from run to run: times.json, and when a model was made.
for name in slurm local; do
  rm "$name".campaign/tasks/*/times.json
  sed -i 's/"made": *"[^"]*"/"made": ""/' "$name".campaign/tasks/*/model.json
done
diff -r slurm.campaign/tasks local.campaign/tasks >diff.err || fail "Slurm's results differ from the local engine's"
for name in slurm local; do
  prismcal campaign $name.json --collect >$name.out 2>$name.err || fail "collect of $name"
done
diff <(jq -S '.tables' slurm.campaign/report/report.json) <(jq -S '.tables' local.campaign/report/report.json) >diff.err ||
  fail "the reports differ"
bad=$(jq -r '[.tables.gyros.rows[] | select(.[2].text != "accepted") | .[0].text] | unique | join(" ")' slurm.campaign/report/report.json)
for serial in S31 S32 S33; do contains "gyros that are not accepted" "$bad" "$serial z"; done
