/* Numbers out of bytes of either order, wherever they lie. Inside cli/mesh only. */
#ifndef CLI_MESH_BYTES_H
#define CLI_MESH_BYTES_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

static inline uint64_t cli_bytes_unsigned(const void *bytes, unsigned size, bool big) {
    const uint8_t *b = bytes;
    uint64_t value = 0;
    for (unsigned i = 0; i < size; i++) value |= (uint64_t) b[big ? size - 1 - i : i] << 8 * i;
    return value;
}

static inline int64_t cli_bytes_signed(const void *bytes, unsigned size, bool big) {
    uint64_t sign = (uint64_t) 1 << (8 * size - 1);
    uint64_t value = cli_bytes_unsigned(bytes, size, big);
    return (int64_t) ((value ^ sign) - sign);
}

static inline float cli_bytes_float(const void *bytes, bool big) {
    uint32_t bits = (uint32_t) cli_bytes_unsigned(bytes, 4, big);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline double cli_bytes_double(const void *bytes, bool big) {
    uint64_t bits = cli_bytes_unsigned(bytes, 8, big);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
