#define RUNG(name) name##_avx2
#include "raster/cpu/setup_kernel.h"
