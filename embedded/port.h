/* What the check asks of the machine that it runs on. */
#ifndef PORT_H
#define PORT_H

#include <stdint.h>

extern uint32_t port_stack_low[], port_stack_top[]; /* the stack's room */

void port_write(const char *text);
void port_exit(int status);       /* ends the simulation with this exit code */
void port_start_counting(void);
uint32_t port_counted(void);      /* instructions since then */
int main(void);

#endif
