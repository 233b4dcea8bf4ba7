# SPDX-License-Identifier: MIT
# The live screen on a real terminal, at 80x24 and 200x50. The layout, with numbers and curves masked, is compared with screens/;
# PRISM_REGENERATE=1 rewrites these files. Also tests keys, colours, an unplugged gyro, a killed prismd and hostile texts.
if [ -w /dev/shm ]; then export TMPDIR=/dev/shm; fi  # a busy disk is an event, which the screen would show
. "$(dirname "$0")/lib.sh"
command -v tmux >/dev/null || skip "tmux is not installed (run tools/setup)"
export LC_ALL=C.UTF-8 PRISM_SOCKET=$dir/gyro.sock
terminal() { tmux -S "$dir/tmux" -f /dev/null "$@"; }
close_terminals() { terminal kill-server 2>/dev/null; }
at_exit close_terminals
screens=$PRISM_SOURCE/tests/system/screens

# open NAME COLUMNS ROWS COMMAND: runs the command in a new terminal.
open() { terminal new-session -d -s "$1" -x "$2" -y "$3" "$4"; }
shows() { terminal capture-pane -p -t "$1" | grep -qF -- "$2"; }
# masked NAME: prints the screen with # for numbers and ~ for curves; the unit tests check their widths. After a path it prints
# only the next word, because the length of the test's directory determines how much fits into the line.
masked() {
  terminal capture-pane -p -t "$1" | sed "s|$dir|DIR|g" |
    perl -CSD -pe 's/[\x{2800}-\x{28FF}]+/~/g; s/-?[0-9][0-9.:]*/#/g; s/ +/ /g; s/ $//; s{(DIR/\S+ \S+).*}{$1}'
}
# compare NAME SCREEN: compares the terminal with the file screens/SCREEN.
compare() {
  if [ -n "${PRISM_REGENERATE:-}" ]; then sleep 2; masked "$1" >"$screens/$2"; fi
  (wait_for 5 looks_like "$1" "$2") 2>"$dir/differs" || { diff "$screens/$2" "$dir/found" >&2; fail "$2: the screen differs (< expected, > found)"; }
}
looks_like() { masked "$1" >"$dir/found"; diff "$screens/$2" "$dir/found"; }

config
start_sim --profile steady --speed 40
start_prismd
for size in 80x24 200x50; do open "w$size" "${size%x*}" "${size#*x}" "prismctl watch"; done
wait_for 20 shows w80x24 "quality is now good"
wait_for 20 shows w200x50 "quality is now good"
for size in 80x24 200x50; do
  wait_for 5 shows "w$size" "quality      good"
  compare "w$size" "receiving-$size.txt"
  same "$size: the clock ends at the right edge" "$(terminal capture-pane -p -t "w$size" | head -1 | awk '{print length}')" "${size%x*}"
done

terminal send-keys -t w80x24 1
wait_for 2 shows w80x24 "span: 1 min"
terminal send-keys -t w80x24 2
wait_for 2 shows w80x24 "span: 10 min"
terminal resize-window -t w80x24 -x 100 -y 30
grown() { [ "$(terminal capture-pane -p -t w80x24 | tail -1 | cut -c1-7)" = "q quit " ]; }
wait_for 5 grown
terminal resize-window -t w80x24 -x 80 -y 24

# The screen is updated without an event: the number of frames increases.
frames_shown() { terminal capture-pane -p -t w80x24 | grep -oE '^[0-9]+ frames good' | grep -oE '^[0-9]+'; }
wait_for 3 frames_shown
before=$(frames_shown)
moved() { [ "$(frames_shown)" -gt "$before" ]; }
wait_for 3 moved

# Colours on a terminal, but not if NO_COLOR is set.
colours() { terminal capture-pane -p -e -t "$1" | grep -qP '\e\[3[0-7]m'; }
colours w80x24 || fail "no colours on a terminal"
open plain 80 24 "NO_COLOR=1 prismctl watch"
wait_for 5 shows plain "quality      good"
colours plain && fail "colours although NO_COLOR is set"

# q ends prismctl with exit code 0 and restores the keyboard. The last values stay.
open shell 80 24 "sh -c 'prismctl watch; echo left \$?; stty -a; read _'"
wait_for 5 shows shell "quality      good"
terminal send-keys -t shell q
wait_for 2 shows shell "left 0"
wait_for 2 shows shell " icanon"
shows shell " echo " || fail "the keyboard was not restored"

# Ctrl-Z stops it; it continues in the foreground.
open jobs 80 24 "sh -c 'set -m; prismctl watch; echo stopped; fg >/dev/null; echo left \$?; read _'"
wait_for 5 shows jobs "quality      good"
terminal send-keys -t jobs C-z
wait_for 5 shows jobs "stopped"
wait_for 5 shows jobs "quality      good"
terminal send-keys -t jobs C-c
wait_for 5 shows jobs "left 0"

# An axis that does not exist.
open wrong 80 24 "sh -c 'prismctl --axis w watch; echo left \$?; read _'"
wait_for 5 shows wrong "left 1"
shows wrong "found w, expected one of z" || fail "the axis is not named"

kill "$sim"
wait_for 10 shows w80x24 "connecting, last data"
wait_for 10 shows w80x24 "not there;"
compare w80x24 unplugged-80x24.txt

kill -STOP "$prismd"
wait_for 10 shows w80x24 "prismd does not respond"
kill -CONT "$prismd"
wait_for 10 shows w80x24 "connecting, last data"
kill -9 "$prismd"
for size in 80x24 200x50; do
  wait_for 5 shows "w$size" "gyro  prismd stopped"
  wait_for 5 shows "w$size" "no prismd answers"
  compare "w$size" "gone-$size.txt"
done
start_prismd
wait_for 5 shows w80x24 "connecting"

# Hostile texts in every field: no command prints them so that the terminal interprets them.
start_hostile hostile
open hostile 80 24 "prismctl --socket '$dir/hostile.sock' watch"
wait_for 10 shows hostile 'DROP TABLE'
wait_for 10 shows hostile '\x1b[2J'
same "terminal titles set by a text" "$(terminal display-message -p -t hostile '#{pane_title}' | grep -c '^title$')" 0
for command in status bias stability line model config events history version rows metrics "status --json" "config --json" "events --json" "rows --json" "watch --count 1" "watch --json --count 1"; do
  terminal_of="prismctl --socket $dir/hostile.sock $command"
  { script -qc "$terminal_of" /dev/null </dev/null 2>&1 || true; } | tr -d '\r' >"$dir/shown"  # some responses are errors
  is_printable "$dir/shown" || fail "$command: $(head -c 300 "$dir/shown" | cat -v)"
  case $command in *--json*|metrics|version) ;; *) grep -q 'DROP TABLE' "$dir/shown" || [ "$command" = history ] || fail "$command: the text is not shown: $(head -c 300 "$dir/shown")" ;; esac
done
prismctl --socket "$dir/hostile.sock" rows --json 2>/dev/null | jq -e . >"$dir/parsed" || fail "rows --json prints invalid JSON"
code=0; prismctl --socket "$dir/hostile.sock" --axis $'\xff' bias 2>"$dir/refused.err" || code=$?
same "exit code for an invalid axis name" "$code" 64
contains "its error" "$(cat "$dir/refused.err")" '--axis: found "\xff", expected 1 to 16 letters, digits or _'
