# SPDX-License-Identifier: MIT
# Files of version 0.1 are read unchanged: its configuration, description, capture and models give its log, equal in every
# column that it had; its log is evaluated, verified and used for training. The files were made by its own programs (57a4ccf).
. "$(dirname "$0")/../system/lib.sh"
old=$PRISM_SOURCE/tests/replay/version-0.1
log=$(echo "$old"/gyro1-*.csv)
rows() { grep -v '^#' "$1"; }  # without metadata and the end
same_rows() { # LOG: its first columns are those of 0.1
  rows "$log" >was; columns=$(head -1 was | tr ',' '\n' | wc -l)
  rows "$1" | cut -d, -f1-"$columns" >is
  diff was is >difference || fail "$1: $(head -4 difference)"
}
cp "$old/frames.json" .
prismd "$old/gyro.json" --replay "$old/gyro.pcap" --out log >/dev/null
same_rows "$(echo log/gyro1-*.csv)"
# The same model in the form with axes.
plain=$(grep -v "^ *//" "$old/gyro.json")
echo "$plain" | jq --arg here "$old" '{name, gyro, clock, frames: ($here + "/frames.json"), site: {latitude_deg: .site.latitude_deg},
  axes: {z: {model: ($here + "/ir-lssvm.json"), elevation_deg: .site.elevation_deg}}}' >axes.json
prismd axes.json --replay "$old/gyro.pcap" --out axes >/dev/null
same_rows "$(echo axes/gyro1-z-*.csv)"
for model in stepwise ir-lssvm; do
  prismd --check "$old/$model.json" >/dev/null || fail "the model $model"
  prismcal evaluate "$old/$model.json" "$log" >evaluated || fail "evaluating $model"
  contains "rows of its log" "$(cat evaluated)" " 360 "
done
contains "verify" "$(prismcal verify "$log")" "whole: 360 rows, format 1"
prismcal train "$log" --inputs T --method ls --window 20 --force --quiet --out new.json >/dev/null || fail "training on its log"
contains "what the new model says" "$(jq -r .gyro.serial new.json)" 70-0042
