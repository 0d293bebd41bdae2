#define RUNG(name) name##_avx512
#include "technique/midpoint_kernel.h"
