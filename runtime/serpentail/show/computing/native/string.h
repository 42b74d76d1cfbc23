/* What the generated C needs of string.h: instructions of WebAssembly. */
#ifndef SERPENTAIL_STRING_H
#define SERPENTAIL_STRING_H

#define memcpy __builtin_memcpy

#endif
