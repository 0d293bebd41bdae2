#define RUNG(name) name##_avx2
#include "map/look_kernel.h"
