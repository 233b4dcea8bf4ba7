# SPDX-License-Identifier: MIT
# Kernels that training chooses, by each criterion: equal on three levels of the processor, but for the number of evaluations.
log a 4 1 --profile fast
train() { echo "== $*"; prismcal train a "${@:2}" --method "$1" --out "$1.json" --force --quiet | sed -E "s|, [0-9]+ evaluations||"; }
train svr --tune blocked --folds 4
train svr --tune shuffled --folds 4 --seed 3 --inputs T,dTdt
train lssvm --tune loo
train lssvm --tune blocked --inputs T,dTdt
train ir-lssvm --tune reml --weight logistic
train ir-lssvm --tune shuffled --weight myriad --inputs T,U
train composite --drift open --weight huber --inputs T,dTdt
train composite --drift none --inputs T
