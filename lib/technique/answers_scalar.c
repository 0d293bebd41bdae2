#define RUNG(name) name##_scalar
#include "technique/answers_kernel.h"
