#ifdef __SSE2__
#include "coverage/lanes_sse2.h"
#else
#include "coverage/lanes_scalar.h"
#endif
#define RUNG(name) name##_scalar
#include "coverage/plates_kernel.h"
