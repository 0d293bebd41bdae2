#define RUNG(name) name##_avx512
#include "engine/places_kernel.h"
