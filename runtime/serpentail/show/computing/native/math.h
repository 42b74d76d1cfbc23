/* What the generated C needs of math.h, in a browser: instructions, and functions of JavaScript's Math. */
#define OF_JAVASCRIPT(name) __attribute__((import_module("Math"), import_name(#name)))
double sin(double x) OF_JAVASCRIPT(sin);
double cos(double x) OF_JAVASCRIPT(cos);
double pow(double x, double y) OF_JAVASCRIPT(pow);
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define ceil __builtin_ceil
#define NAN __builtin_nanf("")
