#include "coverage/lanes_scalar.h"
#define GROUP_KERNEL ss_group_scalar
#include "coverage/group_kernel.h"
