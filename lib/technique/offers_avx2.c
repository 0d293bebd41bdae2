#define RUNG(name) name##_avx2
#include "technique/offers_kernel.h"
