#ifdef __SSE2__
#include "coverage/lanes_sse2.h"
#else
#include "coverage/lanes_scalar.h"
#endif
#define GROUP_KERNEL ss_group_scalar
#include "coverage/group_kernel.h"
