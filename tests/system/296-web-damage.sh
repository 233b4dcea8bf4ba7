# SPDX-License-Identifier: MIT
# A damaged file of minutes is named once, deleted and filled again from the log, and the view is marked as incomplete until then. What
# SQLite's check does not notice is noticed by the number of seconds: rows that vanished without a trace were missing in the charts.
. "$(dirname "$0")/lib.sh"
frames 1
config
jq '.name = "gyro"' gyro.json >named.json && mv named.json gyro.json
prismsim --profile paper --hours 12 --frames frames.json --out past.pcap 2>sim.err
prismd gyro.json --replay past.pcap --out log >/dev/null 2>replay.err || fail "$(cat replay.err)"
touch "$dir/tty"  # an absent gyro: the log does not grow
start_prismd
cat >equal.py <<'END_EQUAL'
"""equal.py URL TOKEN: waits until the store equals the log; until then, each view must be marked as incomplete."""
import glob, json, sys, time, urllib.error, urllib.request

url, token = sys.argv[1:3]
log = [line.split(",") for name in glob.glob("log/*.csv") for line in open(name) if line[0] not in "#t"]


def log_steps(step_s):
    steps = {}
    for cells in log:
        rate, begin = float(cells[4]), int((float(cells[1]) - 1) // step_s * step_s)
        seconds, samples, low, high = steps.get(begin, (0, 0, rate, rate))
        steps[begin] = seconds + 1, samples + int(cells[2]), min(low, rate), max(high, rate)
    return steps


def is_complete(points):
    request = urllib.request.Request(f"{url}api/gyro/range?seconds=200000&points={points}", headers={"Authorization": f"Bearer {token}"})
    try:
        answer = json.load(urllib.request.urlopen(request, timeout=60))
    except urllib.error.HTTPError as error:
        assert "periods.sqlite: " in json.load(error)["error"]
        return False
    columns, step_s = answer["columns"], answer["step_s"]
    found = {row[0] - step_s: tuple(row[columns.index(name)] for name in ("seconds", "samples", "rate_min", "rate_max")) for row in answer["rows"]}
    if answer["building"] < 1:  # the fraction of the log that was read
        read = sum(values[0] for values in found.values()) / len(log)
        assert answer["building"] <= read + 0.05, f"building {answer['building']}, but {read} of the rows"
        return False
    assert found == log_steps(step_s), f"{len(found)} rows, building 1"
    return True


deadline = time.monotonic() + 120
while not (is_complete(5000) & is_complete(500) & is_complete(40)):
    assert time.monotonic() < deadline, "the store was not filled again"
    time.sleep(0.05)
END_EQUAL
web_state=$dir/state
end_web() { kill -TERM "$web"; wait "$web" || fail "exit code $?"; }
file=state/gyro/z/periods.sqlite
equal() { python3 equal.py "$url" "$token" 2>equal.err || fail "$1: $(tail -3 equal.err)"; }
# change PYTHON: changes the closed file; `run(SQL)` runs a command, `flip(OFFSET)` flips a bit.
change() {
  python3 - "$file" "$1" <<'END_CHANGE'
import sqlite3, sys

path = sys.argv[1]
size = len(open(path, "rb").read())


def run(sql):
    with sqlite3.connect(path) as file:
        file.execute(sql)


def flip(offset):
    with open(path, "r+b") as file:
        file.seek(offset)
        byte = file.read(1)[0]
        file.seek(offset)
        file.write(bytes([byte ^ 16]))


exec(sys.argv[2])
END_CHANGE
}
start_web
equal "a new store"
same "messages without damage" "$(cat web.err)" ""
# Each line: the change, and the message.
while IFS='|' read -r changed message; do
  end_web
  change "$changed"
  : >web.err
  start_web
  equal "$changed"
  [[ $(grep -v '^$' web.err | head -1) = *"periods.sqlite: $message"*"; filling it again from the log" ]] || fail "$changed: found $(cat web.err), expected $message"
  same "$changed: then" "$(sed 1d web.err)" "prismweb: gyro z: minutes and hours are stored again"
done <<'END_CHANGES'
run("DELETE FROM minutes WHERE begin_s % 3600 > 600")|found
run("DELETE FROM hours")|found 0 seconds in hours, expected 
run("DELETE FROM state")|found
run("DROP TABLE hours")|no such table: hours
flip(3)|file is not a database
[flip(4096 * page) for page in range(1, size // 4096)]|found damage: 
open(path, "wb").write(b"{}" * 4096)|file is not a database
open(path, "r+b").truncate(size // 8192 * 4096)|
END_CHANGES
# Before 0.4 each row had a checksum, in other tables.
end_web
rm -r state
mkdir -p state/gyro/z
python3 -c 'import sqlite3; sqlite3.connect("state/gyro/z/periods.sqlite").executescript("CREATE TABLE minutes (begin_s INTEGER PRIMARY KEY, crc INTEGER)")'
touch state/gyro/z/place.json  # of 0.2
start_web
equal "a store of 0.3"
[ ! -e state/gyro/z/place.json ] || fail "a file of 0.2 is still there"
end_web
