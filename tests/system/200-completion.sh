# SPDX-License-Identifier: MIT
# Bash completion of commands, options and their values: words of --help, installed descriptions, running instances.
. "$(dirname "$0")/lib.sh"
for program in prismcal prismctl prismsim; do . "$PRISM_SOURCE/completions/$program.bash"; done
# offered WORD...: prints the completions of the last word.
offered() {
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
  "_$1"
  echo "${COMPREPLY[*]}"
}
same "a profile" "$(offered prismsim --profile st)" "steady"
same "a method" "$(offered prismcal fit t.csv --method st)" "stepwise"
same "no value of another command" "$(offered prismcal train --divisor N)" ""
same "an option" "$(offered prismsim --prof)" "--profile"
same "a command" "$(offered prismctl stab)" "stability"
same "an option of a command" "$(offered prismctl history --sec)" "--seconds"
mkdir -p "$dir/data/frames" "$dir/run/prismd"
cp "$PRISM_SOURCE/config/frames/kvh1750.json" "$dir/data/frames/bench-fog.json"
cp "$PRISM_SOURCE/config/frames/frame.schema.json" "$dir/data/frames/"
same "a frame description" "$(PRISM_DATA=$dir/data offered prismsim --frames bench)" "bench-fog"
same "no schema" "$(PRISM_DATA=$dir/data offered prismsim --frames frame)" ""
touch "$dir/run/prismd/table-gyro.sock"
same "an instance" "$(XDG_RUNTIME_DIR=$dir/run offered prismctl --name table)" "table-gyro"
same "a command after --name NAME" "$(offered prismctl --name table-gyro stat)" "status"
