# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismcal() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in train|fit|cv|predict|evaluate|compare|report|allan|convert) command=$word && break ;; esac
  done
  case $command in
    train) words='-h --help --inputs --out --serial --name --force --map --interval --config --latitude --elevation --azimuth --no-earth-rate --window --slope --end-mean --max-gap --lag --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    fit) words='-h --help --inputs --target --fold-column --out --diagnostics --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    cv) words='-h --help --inputs --target --fold-column --method --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --normalise --seed --threads --start --p-enter --p-remove --memory --json --quiet' ;;
    predict) words='-h --help --out --extrapolation --json' ;;
    evaluate) words='-h --help --training --limits --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    compare) words='-h --help --on --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    report) words='-h --help --models --limits --seed --folds --reweight --threads --force --map --interval --config --latitude --elevation --azimuth --no-earth-rate --divisor --max-bias --extrapolation --fallback --out --simulated --any-gyro --json' ;;
    allan) words='-h --help --column --unit --time --interval --grid --estimator --confidence --json' ;;
    convert) words='-h --help --out --frames --map --interval --config' ;;
    *) words='-h --help --version train fit cv predict evaluate compare report allan convert' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismcal prismcal
