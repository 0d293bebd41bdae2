#include "coverage/lanes_avx512.h"
#define RUNG(name) name##_avx512
#include "coverage/plates_kernel.h"
