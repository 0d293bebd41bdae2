#define RUNG(name) name##_scalar
#include "raster/cpu/setup_kernel.h"
