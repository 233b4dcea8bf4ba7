# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismd() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  case $command in
    *) words='-h --help --version --check --sniff --replay --replay-sensors --speed --strict --accept-clock --out --out-frames --socket --model --device' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismd prismd
