#define RUNG(name) name##_avx512
#include "technique/answers_kernel.h"
