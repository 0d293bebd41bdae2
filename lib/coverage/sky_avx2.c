#define RUNG(name) name##_avx2
#include "coverage/sky_kernel.h"
