#include "api/structs.h"

#include <string.h>

#include "base/status.h"

/* No version's struct comes near this: a larger size is memory that nobody has set, and what would
 * lie behind the struct is not to be read. */
#define MOST 4096

static softshadow_status given_size(const char *name, const void *given, size_t least,
                                    uint32_t *size) {
    if (!given) return ss_fail(SOFTSHADOW_E_ARGUMENT, "%s: NULL, must be a struct", name);
    memcpy(size, given, sizeof *size);
    if (*size >= least && *size <= MOST) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_ARGUMENT,
                   "%s.struct_size: %u, must be sizeof the struct (at least %zu); start from its "
                   "_INIT macro",
                   name, *size, least);
}

bool ss_struct_takes(const void *given, size_t least) {
    uint32_t size = 0;
    if (given) memcpy(&size, given, sizeof size);
    return size >= least && size <= MOST;
}

softshadow_status ss_struct_in(const char *name, const void *given, void *ours, size_t size,
                               size_t least) {
    uint32_t theirs = 0;
    memset(ours, 0, size);
    const softshadow_status status = given_size(name, given, least, &theirs);
    if (status) return status;
    const unsigned char *byte = given;
    for (size_t i = size; i < theirs; i++) {
        if (byte[i] == 0) continue;
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "%s: byte %zu is set, but this library, %s, knows only %zu bytes", name, i,
                       softshadow_version_string(), size);
    }
    memcpy(ours, given, theirs < size ? theirs : size);
    return SOFTSHADOW_OK;
}

softshadow_status ss_struct_out(const char *name, void *given, const void *ours, size_t size,
                                size_t least) {
    uint32_t theirs = 0;
    const softshadow_status status = given_size(name, given, least, &theirs);
    if (status) return status;
    const size_t skip = sizeof theirs;
    memcpy((char *)given + skip, (const char *)ours + skip, (theirs < size ? theirs : size) - skip);
    return SOFTSHADOW_OK;
}
