# SPDX-License-Identifier: MIT
# Exported models on a Cortex-M4F in QEMU: the self-test passes there, and a wrong weight fails it. Prints flash, RAM and instructions.
. "$(dirname "$0")/lib.sh"
command -v arm-none-eabi-gcc >/dev/null && command -v qemu-system-arm >/dev/null || skip "gcc-arm-none-eabi or qemu-system-arm is not installed (run tools/setup all)"
echo '{"frames": "second-means", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
for seed in 1 2; do
  prismsim --frames second-means --rate 1 --profile fast --hours 20 --seed $seed --out $seed.pcap 2>/dev/null
  prismd gyro.json --replay $seed.pcap --out $seed >/dev/null || fail "the replay"
done
prismcal train 1 --out composite.json --quiet >/dev/null || fail "training"
prismcal train 1 --out response.json --method stepwise --response 600 --quiet >/dev/null || fail "training"
arm() { arm-none-eabi-gcc -std=c99 -O2 -Wall -Wextra -Werror -Wconversion -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -Ic "$@" || fail "the cross compiler"; }
run() { # prints what the board prints; its exit code is the self-test's
  arm -c c/prism_predict.c -o predict.o
  arm -DPRISM_NO_MAIN --specs=rdimon.specs -nostartfiles -T "$PRISM_SOURCE/tests/firmware/board.ld" "$PRISM_SOURCE/tests/firmware/board.c" c/prism_predict.c c/prism_selftest.c -lm -o board.elf
  timeout 120 qemu-system-arm -M mps2-an386 -icount shift=0 -nographic -semihosting-config enable=on,target=native -kernel board.elf
}
for options in composite.json "composite.json --float" "composite.json --float --max-bytes 1000 --on 2" response.json "response.json --float" "$PRISM_SOURCE/config/models/tao2019-model2.json --float"; do
  # shellcheck disable=SC2086
  prismcal export $options --c c >export.out 2>&1 || fail "export $options: $(cat export.out)"
  run >board.out || fail "the self-test of $options: $(tail -3 board.out)"
  contains "$options" "$(cat board.out)" "0 wrong values"
  echo "${options##*/}: $(arm-none-eabi-size predict.o | awk 'NR == 2 {print $1}') bytes of flash without libm, $(cat board.out)"
done
prismcal export composite.json --c c >/dev/null 2>&1
sed -i '/prism_weight/s/0x1\./0x1.f/' c/prism_model.h
! run >board.out || fail "the self-test does not find a wrong weight"
