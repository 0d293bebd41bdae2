#include <string.h>

#include "technique/exact.h"
#include "technique/map_techniques.h"
#include "technique/raytrace.h"
#include "technique/technique.h"

/* In the order in which listings show them. */
const ss_technique *const ss_techniques[] = {
    &ss_exact,
    &ss_raytrace,
    &ss_hard,
    &ss_pcf,
    &ss_pcss,
    &ss_single_sample,
    &ss_penumbra_map,
    &ss_smoothie,
    &ss_penumbra_volume,
    &ss_penumbra_mask,
    &ss_backprojection,
    &ss_penumbra_limit,
};
const uint32_t ss_technique_count = sizeof ss_techniques / sizeof ss_techniques[0];

const ss_technique *ss_technique_find(const char *name) {
    for (uint32_t i = 0; i < ss_technique_count; i++) {
        if (strcmp(ss_techniques[i]->name, name) == 0) return ss_techniques[i];
    }
    return NULL;
}
