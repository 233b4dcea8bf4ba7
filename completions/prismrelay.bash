# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismrelay() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  case $command in
    *) words='-h --help --version --check --schema --init --status --json' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismrelay prismrelay
