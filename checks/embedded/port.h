/* Functions that each board provides for the check. */
#ifndef PORT_H
#define PORT_H

#include <stdint.h>

extern uint32_t port_stack_low[], port_stack_top[]; /* limits of the stack */

void port_write(const char *text);
void port_exit(int status);       /* ends the simulation with this exit code */
void port_start_counting(void);
uint32_t port_counted(void);      /* instructions since port_start_counting */
int main(void);

#endif
