#define RUNG(name) name##_avx2
#include "technique/answers_kernel.h"
