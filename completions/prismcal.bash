# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismcal() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in train|fit|cv|predict|evaluate|compare|report|allan|convert) command=$word && break ;; esac
  done
  case $command in
    train)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --slope) words='difference least_squares'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --method) words='ls stepwise lssvm ir-lssvm svr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --weight) words='huber hampel logistic myriad'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --tune) words='blocked shuffled loo reml'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --reweight) words='1 converge'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --scale) words='mad iqr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --normalise) words='zscore auto none'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --inputs --out --serial --name --force --map --interval --config --latitude --elevation --azimuth --no-earth-rate --window --slope --end-mean --max-gap --lag --hold-out --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    fit)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --method) words='ls stepwise lssvm ir-lssvm svr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --weight) words='huber hampel logistic myriad'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --tune) words='blocked shuffled loo reml'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --reweight) words='1 converge'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --scale) words='mad iqr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --normalise) words='zscore auto none'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --inputs --target --fold-column --out --diagnostics --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    cv)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --method) words='ls stepwise lssvm ir-lssvm svr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --weight) words='huber hampel logistic myriad'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --tune) words='blocked shuffled loo reml'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --reweight) words='1 converge'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --scale) words='mad iqr'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --normalise) words='zscore auto none'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --inputs --target --fold-column --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    predict)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --extrapolation) words='flag clamp blend'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --out --extrapolation --json' ;;
    evaluate)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --divisor) words='N N-1'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --extrapolation) words='flag clamp blend'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --training --limits --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    compare)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --divisor) words='N N-1'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --extrapolation) words='flag clamp blend'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --on --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    report)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --models) words='paper ladder'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --divisor) words='N N-1'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --extrapolation) words='flag clamp blend'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --models --limits --seed --folds --reweight --threads --force --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    allan)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --unit) words='deg/h deg/s rad/s arcsec/s'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --grid) words='octave decade dense'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
        --estimator) words='overlapping non-overlapping'; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --column --unit --time --interval --grid --estimator --confidence --json' ;;
    convert)
      case ${COMP_WORDS[COMP_CWORD-1]} in
        --frames) words=$(for file in ./frames/*.json /etc/prism/frames/*.json /usr/share/prism/frames/*.json ${PRISM_DATA-.}/frames/*.json; do [ -e "$file" ] && file=${file##*/} && case $file in *.schema.json) ;; *) echo "${file%.*}" ;; esac; done); mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return ;;
      esac
      words='-h --help --out --frames --map --interval --config' ;;
    *) words='-h --help --version train fit cv predict evaluate compare report allan convert' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismcal prismcal
