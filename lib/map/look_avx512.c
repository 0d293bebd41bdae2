#define RUNG(name) name##_avx512
#include "map/look_kernel.h"
