/* RISC-V of QEMU's virt board: entry, FPU, output by semihosting, instruction count by minstret. */
#include "port.h"

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026 };

extern uint32_t port_data_source[], port_data_start[], port_data_end[], port_zero_start[], port_zero_end[];
void port_start(void);
__attribute__((used)) static void prepare(void);

static uint32_t counted_at_start;

/* The three instructions must not be compressed, and must lie in one page. */
__attribute__((naked, noinline, aligned(16))) static void call_host(uintptr_t operation, const void *argument)
{
  (void)operation; /* a0 */
  (void)argument;  /* a1 */
  __asm__ volatile(".option push\n\t.option norvc\n\t"
                   "slli zero, zero, 0x1f\n\tebreak\n\tsrai zero, zero, 7\n\tret\n\t.option pop" ::
                     : "a0", "memory");
}

void port_write(const char *text)
{
  call_host(SYS_WRITE0, text);
}

void port_exit(int status)
{
  const uintptr_t block[2] = { APPLICATION_EXIT, (uintptr_t)status };
  call_host(SYS_EXIT_EXTENDED, block);
  for (;;) {
  }
}

__attribute__((naked, section(".entry"), used)) void port_start(void)
{
  __asm__ volatile(".option push\n\t.option arch, +zicsr\n\tla sp, port_stack_top\n\t"
                   "li t0, 0x2000\n\tcsrs mstatus, t0\n\tj prepare\n\t.option pop"); /* mstatus.FS: FPU on */
}

static void prepare(void)
{
  const uint32_t *source = port_data_source;
  for (uint32_t *target = port_data_start; target < port_data_end; ++target) {
    *target = *source++;
  }
  for (uint32_t *target = port_zero_start; target < port_zero_end; ++target) {
    *target = 0;
  }
  port_exit(main());
}

static uint32_t retired(void)
{
  uint32_t count;
  __asm__ volatile(".option push\n\t.option arch, +zicsr\n\tcsrr %0, minstret\n\t.option pop" : "=r"(count));
  return count;
}

void port_start_counting(void)
{
  counted_at_start = retired();
}

uint32_t port_counted(void)
{
  return retired() - counted_at_start;
}
