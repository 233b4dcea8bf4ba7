# SPDX-License-Identifier: MIT
# Metrics of a simulated gyro and of the relay: promtool accepts them and the alert rules, and a real Prometheus scrapes them from a
# real node_exporter.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
frames 50
config
start_sim --profile steady
start_prismd
wait_for 10 field_above .log.rows status 2
prismctl metrics >all
contains "the gyro" "$(cat all)" 'prism_line_receiving{gyro="gyro"} 1'
contains "its rate" "$(cat all)" 'prism_rate_degrees_per_hour{gyro="gyro",axis="z"} 8.'
prismctl metrics --file prism.prom
same "in a file" "$(grep -c '' prism.prom)" "$(grep -c '' all)"
same "mode of the file" "$(stat -c %a prism.prom)" 644
code=0; prismctl metrics --file /nowhere/x.prom 2>refused.err || code=$?
same "exit code for a missing directory" "$code" 1
same "lines of the error" "$(wc -l <refused.err)" 1
# A symbolic link and a device are rejected and stay unchanged.
echo old >target; chmod 600 target; ln -s target link.prom
for path in "$dir/link.prom" /dev/null; do
  before=$(stat -L -c %a "$path")
  code=0; prismctl metrics --file "$path" 2>refused.err || code=$?
  same "exit code of $path" "$code" 1
  contains "the error of $path" "$(cat refused.err)" "expected a regular file"
  same "mode of $path" "$(stat -L -c %a "$path")" "$before"
done
same "the target of the link" "$(cat target)" old

# With hostile texts and an invalid name in the directory, the metrics of the gyro are still complete.
start_hostile hostile
mkdir -p run/prismd; ln -s "$dir/gyro.sock" "$dir/hostile.sock" run/prismd/
touch "run/prismd/"$'\xff.sock'
env -u PRISM_SOCKET XDG_RUNTIME_DIR="$dir/run" prismctl metrics >both 2>both.log
contains "the gyro" "$(cat both)" 'prism_line_receiving{gyro="gyro"} 1'
contains "the hostile instance" "$(cat both)" 'prism_up{gyro="hostile"} 1'
same "messages about the invalid name" "$(grep -c 'xff.sock: the name is skipped' both.log)" "$(grep -c '' both.log)"
is_printable both both.log || fail "the metrics are not printable"

command -v promtool >/dev/null || skip "prometheus is not installed (run tools/setup all); the checks before passed"
same "promtool on the metrics" "$(promtool check metrics <all 2>&1)" ""
same "promtool on hostile texts" "$(promtool check metrics <both 2>&1)" ""
promtool check rules "$PRISM_SOURCE/config/prometheus/prism.rules.yml" >rules.out || fail "$(cat rules.out)"
promtool test rules "$PRISM_SOURCE/tests/metrics/prism.rules.test.yml" >rules.out 2>&1 || fail "$(cat rules.out)"

# A loop instead of a timer writes them to the directory of node_exporter, with those of the relay; a stopped gyro is down and has no
# values.
mkdir textfiles
port=$(free_port)
relay_config ", \"postgresql\": {\"connection\": \"host=127.0.0.1 port=1 dbname=x\"}"
sed -i "s|status.json|run/prismrelay.json|" relay.json
start_relay
export -n PRISM_SOCKET
start timer sh -c "while sleep 0.2; do XDG_RUNTIME_DIR=run prismctl metrics --file textfiles/prism.prom 2>>timer.err; done"
has() { grep -qF "$1" textfiles/prism.prom; }
wait_for 15 has 'prism_up{gyro="gyro"} 1'
wait_for 15 has 'prism_up{gyro="hostile"} 1'
wait_for 15 has 'prism_relay_target_up{site="lab",target="postgresql"} 0'
same "promtool on the metrics of the relay" "$(promtool check metrics <textfiles/prism.prom 2>&1)" ""
start exporter prometheus-node-exporter --web.listen-address="127.0.0.1:$port" --collector.disable-defaults --collector.textfile --collector.textfile.directory="$dir/textfiles"
other=$(free_port)
cat >prometheus.yml <<END
global: {scrape_interval: 1s, evaluation_interval: 1s}
rule_files: ["$PRISM_SOURCE/config/prometheus/prism.rules.yml"]
scrape_configs: [{job_name: gyros, static_configs: [{targets: ["127.0.0.1:$port"]}]}]
END
start prometheus prometheus --config.file=prometheus.yml --storage.tsdb.path="$dir/tsdb" --web.listen-address="127.0.0.1:$other"
found() { curl -s -G "http://127.0.0.1:$other/api/v1/query" --data-urlencode "query=$1" | jq -r '.data.result[0].value[1] // "nothing"'; }
found_is() { [ "$(found "$1")" = "$2" ]; }
wait_for 30 found_is 'prism_line_receiving{gyro="gyro"}' 1
wait_for 10 found_is 'count(prism_rate_degrees_per_hour{gyro="gyro"}) > 0' 1
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
wait_for 15 found_is 'prism_up{gyro="gyro"}' 0
wait_for 15 found_is 'count(prism_rate_degrees_per_hour{gyro="gyro"})' nothing
wait_for 15 found_is 'ALERTS{alertname="PrismDown"}' 1
wait_for 15 found_is 'prism_relay_up{site="lab"}' 1
kill -STOP "$relay"
wait_for 15 found_is 'prism_relay_up{site="lab"}' 0
same "values of a relay that has stalled" "$(found prism_relay_target_up)" nothing
