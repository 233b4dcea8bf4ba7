// SPDX-License-Identifier: MIT
// Start of a Cortex-M4F without an operating system, on QEMU's mps2-an386 (-icount shift=0): runs the self-test, and counts the
// instructions of one second of data. It has no copy of .data to RAM, because QEMU loads both.
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "prism_predict.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define COPROCESSORS REGISTER(0xE000ED88)  // CPACR
#define TIMER_CONTROL REGISTER(0xE000E010)  // SysTick counts down, 24 bits
#define TIMER_RELOAD REGISTER(0xE000E014)
#define TIMER REGISTER(0xE000E018)
#define INSTRUCTIONS_PER_TICK 40u  // 25 MHz; an instruction takes 1 ns
#define STACK_TOP ((void *)0x20010000)

int prism_selftest(void);
void initialise_monitor_handles(void);  // of newlib: printf() through the debugger
void reset(void);
void _init(void);
void _fini(void);

__attribute__((section(".vectors"), used)) static void *const vectors[] = {STACK_TOP, (void *)reset};
static prism_state gyro;

void _init(void) {}
void _fini(void) {}

static void push(int first, int last) {
  int second;
  for (second = first; second <= last; ++second) {
    prism_second means;
    means.second = second;
    means.rate_deg_per_h = 1;
    means.temperature_degc = 25 + (prism_number)second / 1000;
    means.uhfo_v = 5;
    prism_push(&gyro, &means);
  }
}

void reset(void) {
  int wrong;
  uint32_t begin, end;
  COPROCESSORS |= 0xFu << 20;
  __asm__ volatile("dsb\nisb");
  initialise_monitor_handles();
  wrong = prism_selftest();
  prism_reset(&gyro);
  push(0, PRISM_HISTORY_S - 1);
  TIMER_RELOAD = 0xFFFFFF;
  TIMER = 0;
  TIMER_CONTROL = 5;
  while (TIMER == 0) continue;
  begin = TIMER;
  push(PRISM_HISTORY_S, PRISM_HISTORY_S + 9);
  end = TIMER;
  printf("%d wrong values, %u bytes of RAM, %lu instructions for a second of data\n", wrong, (unsigned)sizeof gyro,
         (unsigned long)((begin - end) * INSTRUCTIONS_PER_TICK / 10));
  exit(wrong != 0);
}
