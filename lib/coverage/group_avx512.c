#include "coverage/lanes_avx512.h"
#define GROUP_KERNEL ss_group_avx512
#include "coverage/group_kernel.h"
