#define RUNG(name) name##_scalar
#include "technique/midpoint_kernel.h"
