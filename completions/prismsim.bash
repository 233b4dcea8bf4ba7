# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismsim() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  case "$command ${COMP_WORDS[COMP_CWORD-1]}" in
    *' --profile') words='paper second third beyond fast steady warm-up' ;;
    *' --frames') words=$(for file in ./frames/*.json /etc/prism/frames/*.json /usr/share/prism/frames/*.json ${PRISM_DATA-.}/frames/*.json; do [ -e "$file" ] && file=${file##*/} && case $file in *.schema.json) ;; *) echo "${file%.*}" ;; esac; done) ;;
  esac
  if [ -n "${words+set}" ]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return; fi
  case $command in
    *) words='-h --help --version --profile --seed --cycles --hours --frames --axis --invalid --rate --latitude --elevation --azimuth --outliers --lose-frames --drop-bytes --damage-bytes --smooth --in-air --sensor-lag --hysteresis --turn-on --warm-up --flicker --mode-hops --ageing --thermal-ageing --age --gradient --tilt --out --truth --chunk-bytes --pty --link --tcp --tcp-listen --udp --obey --wait --overrun --speed' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismsim prismsim
