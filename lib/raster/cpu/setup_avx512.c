#define RUNG(name) name##_avx512
#include "raster/cpu/setup_kernel.h"
