#define RUNG(name) name##_scalar
#include "map/look_kernel.h"
