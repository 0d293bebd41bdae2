#define RUNG(name) name##_scalar
#include "technique/offers_kernel.h"
