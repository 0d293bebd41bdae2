#define RUNG(name) name##_avx512
#include "technique/lamp_walk_kernel.h"
