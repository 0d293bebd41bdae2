#define RUNG(name) name##_avx2
#include "technique/midpoint_kernel.h"
