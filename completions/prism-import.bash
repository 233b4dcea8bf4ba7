# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prism-import() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  case "$command ${COMP_WORDS[COMP_CWORD-1]}" in
    *' --direction') words='rx tx' ;;
  esac
  if [ -n "${words+set}" ]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return; fi
  case $command in
    *) words='--help --out --time --interval --columns --decimal --missing --lenient --separator --encoding --header-row --first-row --sheet --hex --direction' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prism-import prism-import
