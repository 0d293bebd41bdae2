#define RUNG(name) name##_scalar
#include "engine/places_kernel.h"
