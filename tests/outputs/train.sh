# SPDX-License-Identifier: MIT
# The texts of training, and the models of polynomials. Kernels have c and sigma2 given: a search may end elsewhere on another processor.
log a 6 1 --profile fast
log b 6 2 --profile fast --outliers 0.5
train() { echo "== $*"; prismcal train "${@:2}" --method "$1" --out "$1.json" --force --quiet; }
train ls a b --inputs T
train stepwise a b
show ls.json stepwise.json
train lssvm a b --c 20 --sigma2 2
train ir-lssvm a b --c 20 --sigma2 2 --weight huber
train ir-lssvm a --c 20 --sigma2 1.5 --weight hampel --scale iqr --reweight 1 --slope least_squares
train svr a --c 5 --sigma2 2 --epsilon 0.2 --no-earth-rate
train stepwise a --leave-out 3600..7200 --response 600 --inputs T,dTdt --json
train lssvm a.pcap --config g.json --c 10 --sigma2 3 --end-mean 20
# A new constant: of polynomials, of kernels, and of a model without a standard deviation.
log moved 1 3 --profile steady --turn-on 0.1
for model in ls stepwise lssvm ir-lssvm svr; do
  echo "== from $model.json"
  prismcal train moved --from $model.json --out moved.json --quiet --force || continue
  jq -c '[.normalisation.target_shift, (.terms[0] // empty), .provenance.constant, [.provenance.recordings[].name]]' moved.json $model.json
done
