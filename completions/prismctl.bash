# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismctl() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in status|bias|stability|line|model|config|events|history|reload|version|rows|export|metrics|send|offset|watch) command=$word && break ;; esac
  done
  case "$command ${COMP_WORDS[COMP_CWORD-1]}" in
    *' -n'|*' --name') words=$(for file in /run/prismd/*.sock ${XDG_RUNTIME_DIR-/run/user/$UID}/prismd/*.sock; do [ -e "$file" ] && file=${file##*/} && case $file in *.schema.json) ;; *) echo "${file%.*}" ;; esac; done) ;;
  esac
  if [ -n "${words+set}" ]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return; fi
  case $command in
    status) words='-h --help' ;;
    bias) words='-h --help' ;;
    stability) words='-h --help' ;;
    line) words='-h --help' ;;
    model) words='-h --help' ;;
    config) words='-h --help' ;;
    events) words='-h --help --count' ;;
    history) words='-h --help --seconds' ;;
    reload) words='-h --help' ;;
    version) words='-h --help' ;;
    rows) words='-h --help --after --cursor --limit --follow' ;;
    export) words='-h --help --from --to' ;;
    metrics) words='-h --help --file' ;;
    send) words='-h --help --line --hex' ;;
    offset) words='-h --help --set --reason --expires --clear' ;;
    watch) words='-h --help --samples --every --count' ;;
    *) words='-h --help --version -s --socket -n --name --axis --json --no-start status bias stability line model config events history reload version rows export metrics send offset watch' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismctl prismctl
