#include "coverage/lanes_avx2.h"
#define RUNG(name) name##_avx2
#include "coverage/plates_kernel.h"
