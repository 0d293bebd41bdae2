#include "coverage/lanes_scalar.h"
#define LANES lanes_plain
#include "unit/lanes.h"
