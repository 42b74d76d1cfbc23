/* The host: output by stdio; no instruction count, no painted stack. */
#include <stdio.h>
#include <stdlib.h>

#include "port.h"

uint32_t port_stack_low[1], port_stack_top[1];

void port_write(const char *text)
{
  fputs(text, stdout);
}

void port_exit(int status)
{
  exit(status);
}

void port_start_counting(void)
{
}

uint32_t port_counted(void)
{
  return 0;
}
