# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismweb() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  case $command in
    *) words='-h --help --version --config --check --listen --socket --instance --page --state' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismweb prismweb
