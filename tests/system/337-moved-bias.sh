# SPDX-License-Identifier: MIT
# A bias that moved: an offset by command has its own column, is an event, survives a restart, ends at its expiry, and is limited by the model's
# turn-on repeatability; train --from proposes a new constant of the model and keeps its shape.
. "$(dirname "$0")/lib.sh"
frames 2
site='"site": {"latitude_deg": 34.25, "elevation_deg": 90}'
echo '{"frames": "./frames.json", "clock": "device", "name": "g", '"$site"'}' >train.json
log() { prismsim --frames frames.json --out "$1.pcap" "${@:2}" 2>/dev/null; prismd train.json --replay "$1.pcap" --out "$1" >/dev/null || fail "the replay of $1"; } # NAME OPTIONS...
log cycle --profile paper --seed 1
prismcal train cycle --quiet --out model.json >train.out || fail "training"

# The constant again: another switch-on.
log moved --profile steady --hours 3 --seed 2 --turn-on 0.1
log same --profile steady --hours 3 --seed 2
from() { prismcal train --quiet --from "$@"; }
! from model.json same --out no.json 2>same.err || fail "a bias that has not moved gave a model"
contains "the same bias" "$(cat same.err)" "which may be none: the model stays; --force writes it anyway"
[ ! -e no.json ] || fail "no.json was written"
from model.json moved --out new.json --json >new.out || fail "train --from"
contains "its sentence" "$(from model.json moved --out again.json)" "deg/h (2 sd) in "
same "the shape" "$(jq -S '[.alpha, .centres, .variances, .features, .inputs]' new.json)" "$(jq -S '[.alpha, .centres, .variances, .features, .inputs]' model.json)"
jq -es '.[0] as $new | .[1] as $old | .[2] | (.moved_deg_per_h | fabs) > 0.02 and .at_rest_s >= 3600 and .id == $new.id and .from == $old.id
  and (($new.normalisation.target_shift - $old.normalisation.target_shift - .moved_deg_per_h) | fabs) < 1e-9
  and .interval_deg_per_h[0] < .moved_deg_per_h and .interval_deg_per_h[1] > .moved_deg_per_h' new.json model.json new.out >/dev/null || fail "the constant: $(cat new.out)"
jq -e '.provenance.constant.at_rest_s and (.provenance.recordings | length) == 2' new.json >/dev/null || fail "its provenance"
since=$(jq .monitor.since_s new.json)
[ "$since" -le "$(grep -hv '^#' moved/*.csv | tail -1 | cut -d, -f2)" ] || fail "the time from which the monitor tests the new model: $since"
jq ".monitor.since_s += 86400" new.json >later.json
contains "rows before that time" "$(prismcal monitor later.json moved || true)" "the gyro was not at rest"
! from new.json moved --out no.json 2>new.err || fail "the new model has another constant on the same log"
contains "the new model" "$(cat new.err)" "which may be none"
! prismcal evaluate new.json moved >evaluate.out 2>&1 || fail "the log that gave the constant is a test"
! from model.json moved --out no.json --inputs T 2>options.err || fail "--inputs was accepted"
contains "--inputs" "$(cat options.err)" "excludes"

# An offset by command.
config "$site"
jq '.model = "./model.json"' gyro.json >m.json && mv m.json gyro.json
start_sim --profile steady --speed 100 --seed 3
start_prismd
wait_for 60 field_is .quality status good
! prismctl offset --set 0.2 --reason "too much" 2>limit.err || fail "an offset of 0.2 deg/h was accepted"
contains "the limit" "$(cat limit.err)" "by which switch-ons differ in the model; for a larger shift: prismcal train --from"
! prismctl offset --set 0.001 2>reason.err || fail "an offset without a reason was accepted"
contains "set" "$(prismctl offset --set 0.001 --reason "turn-on of today")" "+0.00100 deg/h: turn-on of today"
wait_for 10 field_is .window.offset_deg_per_h status 0.001
contains "status" "$(prismctl status)" "0.00100 deg/h by command: turn-on of today"
contains "event" "$(prismctl events)" "offset set: +0.00100 deg/h: turn-on of today"
kill "$prismd"; wait "$prismd" || true
start_prismd
contains "event after a restart" "$(prismctl events)" "offset restored: +0.00100 deg/h: turn-on of today"
wait_for 60 field_is .window.offset_deg_per_h status 0.001
contains "cleared" "$(prismctl offset --clear)" none
wait_for 10 field_is .window.offset_deg_per_h status null
[ ! -e log/*.offset.json ] || fail "the file of the offset remains"
prismctl offset --set -0.001 --reason "for a second" --expires 1s >/dev/null
wait_for 10 field_is .offset status null
contains "event" "$(prismctl events)" "offset expired: -0.00100 deg/h until "
wait_for 10 test ! -e "$(echo log/*.offset.json)"
prismctl export exported >/dev/null
python3 - <<'END' || fail "the log"
import csv, glob
rows = [row for name in sorted(glob.glob("exported/*.csv")) for row in csv.DictReader(line for line in open(name) if not line.startswith("#"))]
number = lambda text: float(text or 0)
seen = {row["offset_deg_per_h"] for row in rows}
assert seen == {"", "0.001000", "-0.001000"}, seen
for row in rows:
    if row["corrected_deg_per_h"]:
        left = number(row["rate_deg_per_h"]) - number(row["bias_deg_per_h"]) - number(row["offset_deg_per_h"]) - number(row["corrected_deg_per_h"])
        assert abs(left) < 2.1e-6, row
END
