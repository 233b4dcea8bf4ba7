# SPDX-License-Identifier: MIT
# A reload through systemd keeps the process, its line and its clients.
pid=$(property MainPID)
client prismctl --json --socket "$address" watch --samples --count 150 >"$box/samples" 2>&1 &   # 3 s at 50 Hz
watcher=$!
sleep 0.5
inside sed -i 's/"silence_s": 1,/"silence_s": 2,/' /etc/prism/gyro1.json
check "systemctl reload succeeds" inside systemctl reload "$unit"
# The reload of systemd 252 may end before the daemon has handled the signal of kill(1).
becomes 5 "the reloaded value is in force" 2 configured ".line.silence_s * 1"
becomes 5 "the unit is active again" active property ActiveState
inside sh -c 'echo "{\"line\": {\"baudd\": 1}}" >/etc/prism/gyro1.json'
refuse "the reload of an invalid configuration fails" inside systemctl reload "$unit"
contains "the journal has the reason with file and key" "$(journal)" gyro1.json:/line/baudd
inside sh -c 'cat >/etc/prism/gyro1.json' <<<"$configuration"
check "the valid configuration is loaded again" inside systemctl reload "$unit"
same "the process is the same" "$(property MainPID)" "$pid"
wait "$watcher" && ended=0 || ended=$?
same "the client received its samples" "$ended/$(wc -l <"$box/samples")" 0/150
same "the client's samples have no gap" \
  "$(jq -s 'map(.params.time_s) | [.[1:], .[:-1]] | transpose | map(.[0] - .[1]) | max < 0.1' "$box/samples" 2>&1)" true
