#define RUNG(name) name##_scalar
#include "coverage/sky_kernel.h"
