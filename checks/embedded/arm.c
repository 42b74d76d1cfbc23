/* Cortex-M4F and Cortex-M7 of QEMU's mps2 boards: vectors, FPU, output by semihosting, instruction count by SysTick.
 *
 * With `-icount shift=0` an instruction takes 1 ns.  SysTick counts at 25 MHz, so one tick is 40 instructions.
 */
#include "port.h"

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026, INSTRUCTIONS_A_TICK = 40 };
enum { TICKS = 0xffffff, ENABLE_BY_CORE_CLOCK = 5 };
#define CPACR (*(volatile uint32_t *)0xe000ed88)
#define SYST_CSR (*(volatile uint32_t *)0xe000e010)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014)
#define SYST_CVR (*(volatile uint32_t *)0xe000e018)

extern uint32_t port_data_source[], port_data_start[], port_data_end[], port_zero_start[], port_zero_end[];
void port_start(void);
static void stop(void);

typedef void (*handler)(void);
__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
  (handler)(uintptr_t)port_stack_top, port_start, stop, stop, stop, stop, stop, [11] = stop, [14] = stop, stop
};

static void call_host(uint32_t operation, const void *argument)
{
  register uint32_t r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void port_write(const char *text)
{
  call_host(SYS_WRITE0, text);
}

void port_exit(int status)
{
  const uint32_t block[2] = { APPLICATION_EXIT, (uint32_t)status };
  call_host(SYS_EXIT_EXTENDED, block);
  for (;;) {
  }
}

static void stop(void)
{
  port_write("fault\n");
  port_exit(3);
}

void port_start(void)
{
  CPACR |= UINT32_C(0xf) << 20; /* full access to the FPU */
  __asm__ volatile("dsb\n\tisb" ::: "memory");
  const uint32_t *source = port_data_source;
  for (uint32_t *target = port_data_start; target < port_data_end; ++target) {
    *target = *source++;
  }
  for (uint32_t *target = port_zero_start; target < port_zero_end; ++target) {
    *target = 0;
  }
  port_exit(main());
}

void port_start_counting(void)
{
  SYST_RVR = TICKS;
  SYST_CSR = ENABLE_BY_CORE_CLOCK;
  SYST_CVR = 0;
}

uint32_t port_counted(void)
{
  return (TICKS - SYST_CVR) * INSTRUCTIONS_A_TICK;
}
