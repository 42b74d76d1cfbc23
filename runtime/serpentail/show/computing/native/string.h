#define memcpy __builtin_memcpy /* an instruction of WebAssembly */
