#define RUNG(name) name##_avx2
#include "technique/lamp_walk_kernel.h"
