#ifdef __SSE2__
#include "coverage/lanes_sse2.h"
#else
#include "coverage/lanes_scalar.h"
#endif
#define LANES lanes_sse2
#include "unit/lanes.h"
