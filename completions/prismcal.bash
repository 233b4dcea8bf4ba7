# SPDX-License-Identifier: MIT
# Made by tools/completions.
_prismcal() {
  local word words command= current=${COMP_WORDS[COMP_CWORD]}
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in train|fit|cv|predict|evaluate|compare|monitor|history|inspect|allan|convert|design|export|verify|campaign) command=$word && break ;; esac
  done
  case "$command ${COMP_WORDS[COMP_CWORD-1]}" in
    'train --time-unit'|'fit --time-unit'|'cv --time-unit'|'predict --time-unit'|'evaluate --time-unit'|'compare --time-unit'|'monitor --time-unit'|'inspect --time-unit'|'allan --time-unit'|'convert --time-unit'|'export --time-unit') words='s ms us ns min h d' ;;
    'train --method'|'fit --method'|'cv --method') words='composite ls stepwise lssvm ir-lssvm svr' ;;
    'train --slope'|'compare --slope'|'inspect --slope') words='difference least_squares' ;;
    'train --weight'|'fit --weight'|'cv --weight') words='huber hampel logistic myriad' ;;
    'train --tune'|'fit --tune'|'cv --tune') words='blocked shuffled loo reml' ;;
    'train --reweight'|'fit --reweight'|'cv --reweight') words='1 converge' ;;
    'train --scale'|'fit --scale'|'cv --scale') words='mad iqr' ;;
    'train --drift'|'fit --drift'|'cv --drift') words='thermal open none' ;;
    'train --normalise'|'fit --normalise'|'cv --normalise') words='zscore auto none' ;;
    'predict --extrapolation'|'evaluate --extrapolation'|'compare --extrapolation') words='preset flag clamp shrink' ;;
    'evaluate --divisor'|'compare --divisor') words='N N-1' ;;
    'evaluate --paper'|'compare --paper'|'allan --paper') words='A4 letter' ;;
    'allan --unit') words='deg/h deg/s rad/s arcsec/s' ;;
    'convert --frames') words=$(for file in ./frames/*.json /etc/prism/frames/*.json /usr/share/prism/frames/*.json ${PRISM_DATA-.}/frames/*.json; do [ -e "$file" ] && file=${file##*/} && case $file in *.schema.json) ;; *) echo "${file%.*}" ;; esac; done) ;;
    'export --extrapolation') words='flag clamp' ;;
  esac
  if [ -n "${words+set}" ]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"); return; fi
  case $command in
    train) words='-h --help --out --inputs --response --serial --name --prior --force --map --interval --decimal --time-unit --config --axis --leave-out --latitude --elevation --azimuth --no-earth-rate --accept-unit --method --json --quiet --from --strict --window --slope --end-mean --max-gap --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --drift --normalise --seed --threads --start --p-enter --p-remove --memory' ;;
    fit) words='-h --help --inputs --target --fold-column --decimal --time-unit --time --out --diagnostics --method --json --quiet --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --drift --normalise --seed --threads --start --p-enter --p-remove --memory' ;;
    cv) words='-h --help --inputs --target --fold-column --decimal --time-unit --method --json --quiet --weight --c --sigma2 --beta --delta --epsilon --tune --folds --reweight --scale --hampel-floor --drift --normalise --seed --threads --start --p-enter --p-remove --memory' ;;
    predict) words='-h --help --out --extrapolation --decimal --time-unit --json --quiet' ;;
    evaluate) words='-h --help --limits --in-sample --map --interval --decimal --time-unit --config --axis --leave-out --latitude --elevation --azimuth --no-earth-rate --accept-unit --max-bias --any-gyro --json --quiet --out --pdf --divisor --extrapolation --fallback --all-blocks --simulated --paper --test' ;;
    compare) words='-h --help --on --leave-one-out --inputs --strict --map --interval --decimal --time-unit --config --axis --leave-out --latitude --elevation --azimuth --no-earth-rate --accept-unit --max-bias --any-gyro --json --quiet --out --pdf --divisor --extrapolation --fallback --all-blocks --simulated --paper --test --window --slope --end-mean --max-gap' ;;
    monitor) words='-h --help --training --out --instance --any-gyro --json --map --interval --decimal --time-unit --config --axis --leave-out --latitude --elevation --azimuth --no-earth-rate --accept-unit' ;;
    history) words='-h --help --axis' ;;
    inspect) words='-h --help --map --interval --decimal --time-unit --config --axis --leave-out --latitude --elevation --azimuth --no-earth-rate --accept-unit --json --window --slope --end-mean --max-gap' ;;
    allan) words='-h --help --column --axis --unit --time --interval --decimal --time-unit --json --quiet --out --pdf --paper --test' ;;
    convert) words='-h --help --out --frames --map --interval --decimal --time-unit --config --axis --leave-out --quiet' ;;
    design) words='-h --help --out --domain --coldest --hottest --rate --start --hours --prior --thermal-lag --self-heating' ;;
    export) words='-h --help --c --float --extrapolation --max-bytes --on --map --interval --decimal --time-unit --config --axis --leave-out' ;;
    verify) words='-h --help --json' ;;
    campaign) words='-h --help --plan --status --task --collect --install --engine' ;;
    *) words='-h --help --version train fit cv predict evaluate compare monitor history inspect allan convert design export verify campaign' ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ -n "$current" ] || [ -z "$command" ] || COMPREPLY=()
}
complete -o default -F _prismcal prismcal
