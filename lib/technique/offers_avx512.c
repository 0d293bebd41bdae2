#define RUNG(name) name##_avx512
#include "technique/offers_kernel.h"
