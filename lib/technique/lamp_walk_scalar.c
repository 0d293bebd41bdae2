#define RUNG(name) name##_scalar
#include "technique/lamp_walk_kernel.h"
