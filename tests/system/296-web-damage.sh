# SPDX-License-Identifier: MIT
# Bits that change in the file of minutes, between runs of prismweb and while it runs: each row that `range` returns equals the log, or the
# request fails, or the view is marked as incomplete. The damage is named once, and the store is rebuilt from the log.
. "$(dirname "$0")/lib.sh"
frames 1
config
jq '.name = "gyro"' gyro.json >named.json && mv named.json gyro.json
# 30 h: the minutes are larger than the cache of the store, so that pages are read again.
prismsim --profile paper --hours 30 --frames frames.json --out past.pcap 2>sim.err
prismd gyro.json --replay past.pcap --out log >/dev/null 2>replay.err || fail "$(cat replay.err)"
touch "$dir/tty"  # an absent gyro: the log does not grow
start_prismd
cat >compare.py <<'END_COMPARE'
"""compare.py URL TOKEN FILE COMMAND: checks that the store equals the log (equal), flips bits of the file (flip, or flip TABLE)."""
import glob, json, random, sqlite3, sys, time, urllib.error, urllib.request

url, token, path, command = sys.argv[1:5]


def log_steps(step_s):
    steps = {}
    for name in glob.glob("log/*.csv"):
        for line in open(name):
            if line[0] in "#t":
                continue
            cells = line.split(",")
            rate, begin = float(cells[4]), int((float(cells[1]) - 1) // step_s * step_s)
            seconds, samples, low, high = steps.get(begin, (0, 0, rate, rate))
            steps[begin] = seconds + 1, samples + int(cells[2]), min(low, rate), max(high, rate)
    return steps


def served(points):
    request = urllib.request.Request(f"{url}api/gyro/range?seconds=200000&points={points}", headers={"Authorization": f"Bearer {token}"})
    try:
        return json.load(urllib.request.urlopen(request, timeout=60))
    except urllib.error.HTTPError as error:
        return json.load(error)


def check(points):
    """Returns whether the view is complete; fails if a row differs from the log."""
    answer = served(points)
    if "error" in answer:
        assert "periods.sqlite: " in answer["error"], answer
        return False
    columns, step_s = answer["columns"], answer["step_s"]
    truth = log_steps(step_s)
    found = {row[0] - step_s: tuple(row[columns.index(name)] for name in ("seconds", "samples", "rate_min", "rate_max")) for row in answer["rows"]}
    is_complete = answer["building"] == 1
    for begin, values in found.items():
        # While the store is built, its last step and the first one in memory have fewer seconds.
        if is_complete or values[0] >= truth[begin][0]:
            assert values == truth[begin], f"{begin}: found {values}, expected {truth[begin]}, building {answer['building']}"
    assert not is_complete or found.keys() == truth.keys(), f"{len(found)} rows, expected {len(truth)}"
    return is_complete


def flip(count, offsets):
    with open(path, "r+b") as file:
        for at in offsets[:count]:
            file.seek(at)
            byte = file.read(1)[0]
            file.seek(at)
            file.write(bytes([byte ^ 1 << random.randrange(8)]))


random.seed(sys.argv[5] if len(sys.argv) > 5 else 0)
if command == "equal":
    deadline = time.monotonic() + 120
    while not (check(5000) & check(500) & check(40)):
        assert time.monotonic() < deadline, "the store was not rebuilt"
        time.sleep(0.2)
elif command == "flip":
    size = len(open(path, "rb").read())
    flip(30, [size * i // 30 + random.randrange(size // 30) for i in range(30)])
else:  # one bit in the last record of a table
    with sqlite3.connect(f"file:{path}?immutable=1", uri=True) as file:
        page = file.execute("SELECT rootpage FROM sqlite_master WHERE name = ?", (command,)).fetchone()[0]
    data = open(path, "rb").read()
    while data[(page - 1) * 4096] == 5:  # an interior page: follow the right-most child
        page = int.from_bytes(data[(page - 1) * 4096 + 8:(page - 1) * 4096 + 12], "big")
    flip(1, [page * 4096 - random.randrange(20, 27)])
END_COMPARE
web_state=$dir/state
end_web() { kill -TERM "$web"; wait "$web" || fail "exit code $?"; }
file=state/gyro/z/periods.sqlite
compare() { python3 compare.py "$url" "$token" "$file" "$@" 2>compare.err || fail "$*: $(tail -3 compare.err)"; }
reports() { grep -c 'periods.sqlite: .*; rebuilding it from the log' web.err || true; }
start_web
compare equal
same "messages without damage" "$(cat web.err)" ""
same "the file is larger than the cache" "$(($(stat -c %s "$file") + $(stat -c %s "$file-wal") > 262144))" 1

# Between runs: one bit of each table, then 30 bits at once.
expected=0
for table in state places minutes ten_minutes hours; do
  end_web
  compare "$table" "$table"
  start_web
  compare equal
  expected=$((expected + 1))
  same "reports after a bit of $table" "$(reports)" "$expected"
done
end_web
compare flip 1
start_web
compare equal
same "reports after 30 bits" "$(reports)" $((expected + 1))

# While prismweb runs: state and cursors are in memory, so only changed pages that are read again are noticed.
for seed in 2 3 4; do
  compare flip "$seed"
  compare equal
done
[ "$(reports)" -gt $((expected + 1)) ] || fail "no damage was reported while prismweb ran"
contains "the last message" "$(tail -1 web.err)" "minutes and hours are stored again"
[ "$(grep -cv 'rebuilding it from the log\|stored again' web.err)" = 0 ] || fail "other messages: $(cat web.err)"
end_web
