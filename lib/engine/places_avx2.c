#define RUNG(name) name##_avx2
#include "engine/places_kernel.h"
