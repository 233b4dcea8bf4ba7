# SPDX-License-Identifier: MIT
# Simulated gyros of a production lot, for the campaign tests. Source it after lib.sh.
frames 2

# gyro LOT SERIAL SEED [prismsim option...]: writes the logs of two short temperature cycles to LOT/SERIAL/cycle1 and cycle2.
gyro() {
  local place=$1/$2 serial=$2 seed=$3 cycle; shift 3
  mkdir -p "$place"
  echo "{\"frames\": \"$dir/frames.json\", \"clock\": \"device\", \"name\": \"g\", \"gyro\": {\"serial\": \"$serial\"},
    \"site\": {\"latitude_deg\": 34.25, \"elevation_deg\": 90}}" >"$dir/replayed.json"
  for cycle in 1 2; do
    prismsim --profile fast --hours 8 --frames "$dir/frames.json" --seed $((10 * seed + cycle)) "$@" --out "$dir/cycle.pcap" 2>/dev/null
    prismd "$dir/replayed.json" --replay "$dir/cycle.pcap" --out "$place/cycle$cycle" >/dev/null 2>&1
  done
}

# without_thermometer DIRECTORY: removes temperature and slope from its recordings, as if the thermometer were broken.
without_thermometer() {
  local file
  for file in "$1"/*/*.csv; do
    awk -F, -v OFS=, '/^#/ {next} /^time_utc/ {for (i = 1; i <= NF; ++i) if ($i ~ /temperature|slope/) blank[i] = 1; print; next}
      {for (i in blank) $i = ""; print}' "$file" >"$dir/rows"
    # Omit the end line, and delete the index below: their checksums no longer match.
    { grep '^#' "$file" | grep -v '^# end'; cat "$dir/rows"; } >"$dir/whole"
    cp "$dir/whole" "$file"
  done
  rm -f "$1"/*/*.index
}

# campaign_file FILE LOT: writes a campaign with two models for all gyros of LOT.
campaign_file() {
  cat >"$1" <<END
{"name": "lot", "recordings": [{"role": "train", "paths": "$2/*/cycle1"}, {"role": "repeat", "paths": "$2/*/cycle2"}],
 "models": {"kernel": {"method": "ir-lssvm", "weight": "huber", "tune": "reml"}, "stepwise": {"method": "stepwise"}},
 "limits": {"repeat": {"improvement_percent": {"min": 15}}}}
END
}
