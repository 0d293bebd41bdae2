#include "coverage/lanes_avx2.h"
#define GROUP_KERNEL ss_group_avx2
#include "coverage/group_kernel.h"
