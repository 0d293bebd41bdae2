/* Structs that cross the ABI: older and newer sizes are both welcome. */
#ifndef SS_API_STRUCTS_H
#define SS_API_STRUCTS_H

#include <stdbool.h>
#include <stddef.h>

#include "softshadow.h"

/* Copies a struct given by the host into ours (`size` bytes, zeroed first). `name` is the
 * argument's, `least` its size in 1.0. A larger one is taken where all that we do not know is
 * zero. */
softshadow_status ss_struct_in(const char *name, const void *given, void *ours, size_t size,
                               size_t least);
/* Is there a struct, and is it as large as it was in 1.0? Sets no message. */
bool ss_struct_takes(const void *given, size_t least);
/* Copies ours back, as many bytes as the host has room for; its struct_size stays. */
softshadow_status ss_struct_out(const char *name, void *given, const void *ours, size_t size,
                                size_t least);

#endif
