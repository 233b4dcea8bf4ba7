# SPDX-License-Identifier: MIT
# A reload goes through systemd; the process, its line and its clients do not notice.
pid=$(property MainPID)
client prismctl --json --socket "$address" watch --samples --count 150 >"$box/samples" 2>&1 &   # 3 s at 50 Hz
watcher=$!
sleep 0.5
inside sed -i 's/"silence_s": 1,/"silence_s": 2,/' /etc/prism/gyro1.json
check "systemctl reload succeeds" inside systemctl reload "$unit"
# systemd 252 ends the reload with kill(1), which may be before the daemon has answered it.
becomes 5 "the reloaded value is in force" 2 configured .line.silence_s
becomes 5 "the unit is active again" active property ActiveState
inside sh -c 'echo "{\"line\": {\"baudd\": 1}}" >/etc/prism/gyro1.json'
refuse "a bad configuration fails the reload" inside systemctl reload "$unit"
contains "the journal says why, with file and key" "$(journal)" gyro1.json:/line/baudd
inside sh -c 'cat >/etc/prism/gyro1.json' <<<"$configuration"
check "the good one is taken again" inside systemctl reload "$unit"
same "the process is the same" "$(property MainPID)" "$pid"
wait "$watcher" && ended=0 || ended=$?
same "the client's stream went through" "$ended/$(wc -l <"$box/samples")" 0/150
same "without losing a frame" "$(jq -s 'map(.params.time_s) | [.[1:], .[:-1]] | transpose | map(.[0] - .[1]) | max < 0.1' "$box/samples" 2>&1)" true
