#define RUNG(name) name##_avx512
#include "coverage/sky_kernel.h"
