#ifndef SS_TECHNIQUE_EXACT_H
#define SS_TECHNIQUE_EXACT_H

#include "technique/technique.h"

extern const ss_technique ss_exact;

#endif
