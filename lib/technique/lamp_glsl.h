/* lamp.h and the pyramid of least depths as text, in floats: after SS_LIGHT_MAPS_GLSL, with the
 * pyramids of all faces as table 4. Differs from the C, and why:
 * - A part of a disk's edge below 3e-7 of the light counts as nothing: floats tell no less.
 * - The arc tangent is its own polynomial (error 1e-7): what a shading language promises for its is
 *   a thousand times worse, and edges are sums of hundreds of them. */
#ifndef SS_TECHNIQUE_LAMP_GLSL_H
#define SS_TECHNIQUE_LAMP_GLSL_H

/* A face's words: see ss_lamp_words(). */
#define SS_LAMP_VIEW_GLSL \
    "struct View { vec2 row[2]; vec2 reach; float texel; float area; float least; bool square;\n" \
    "              bool disk; uint face; };\n" \
    "vec3 lamp3(uint face, uint i) { return vec3(word(face, i), word(face, i + 1u), word(face, i + 2u)); }\n" \
    "bool lamp_see(uint face, vec3 look, out View v) {\n" \
    "    float inverse = word(face, 11u);\n" \
    "    vec2 tangent = (vec2(word(face, 12u), word(face, 13u)) + word(face, 14u) * look.xy) * inverse;\n" \
    "    vec2 a, b;\n" \
    "    if (word(face, 8u) == 0.0) {\n" \
    "        vec3 p = lamp3(face, 0u), q = lamp3(face, 3u);\n" \
    "        a = p.xy - p.z * tangent, b = q.xy - q.z * tangent;\n" \
    "    } else {\n" \
    "        float tilt = dot(tangent, tangent), along = word(face, 10u) / (1.0 - look.z * inverse);\n" \
    "        float square = along * along * (1.0 + tilt), own = word(face, 7u);\n" \
    "        if (!(square > own)) return false;\n" \
    "        float radius = word(face, 6u) * sqrt(square / (square - own));\n" \
    "        float longer = 1.0 / (sqrt(1.0 + tilt) + 1.0);\n" \
    "        a = radius * (vec2(1.0, 0.0) + longer * tangent.x * tangent);\n" \
    "        b = radius * (vec2(0.0, 1.0) + longer * tangent.y * tangent);\n" \
    "    }\n" \
    "    float det = a.x * b.y - a.y * b.x;\n" \
    "    if (!(abs(det) > 1e-6 * (dot(a, a) + dot(b, b)))) return false;\n" \
    "    v.row[0] = vec2(b.y, -b.x) / det, v.row[1] = vec2(-a.y, a.x) / det;\n" \
    "    v.face = face, v.disk = word(face, 9u) != 0.0;\n" \
    "    float skew = abs(v.row[0].y) + abs(v.row[1].x), straight = abs(v.row[0].x) + abs(v.row[1].y);\n" \
    "    v.square = !v.disk && skew < 1e-6 * straight;\n" \
    "    v.area = 1.0 / abs(det) / (v.disk ? 3.14159265 : 4.0);\n" \
    "    v.texel = max(length(vec2(v.row[0].x + v.row[0].y, v.row[1].x + v.row[1].y)),\n" \
    "                  length(vec2(v.row[0].x - v.row[0].y, v.row[1].x - v.row[1].y))) / 2.0;\n" \
    "    v.reach = v.disk ? vec2(length(vec2(a.x, b.x)), length(vec2(a.y, b.y))) : abs(a) + abs(b);\n" \
    "    v.least = 9.5367431640625e-7 / max(v.reach.x, v.reach.y);\n" \
    "    return true;\n" \
    "}\n" \
    "vec2 to_light(View v, vec2 p) { return vec2(dot(v.row[0], p), dot(v.row[1], p)); }\n" \
    "bool lamp_misses(View v, vec2 p, float gap, float size) {\n" \
    "    vec2 s = to_light(v, p);\n" \
    "    float most = gap + size * v.texel;\n" \
    "    return v.disk ? dot(s, s) >= most * most : max(abs(s.x), abs(s.y)) >= most;\n" \
    "}\n"

#define SS_LAMP_AREA_GLSL \
    "float cross2(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }\n" \
    "float angle(float y, float x) {\n" \
    "    float big = max(abs(x), abs(y)), small = min(abs(x), abs(y));\n" \
    "    if (big == 0.0) return 0.0;\n" \
    "    float t = small / big, turn = 0.0;\n" \
    "    if (t > 0.41421356) t = (t - 1.0) / (t + 1.0), turn = 0.785398163;\n" \
    "    float z = t * t;\n" \
    "    float r = turn + (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z -\n" \
    "                      3.33329491539e-1) * z * t + t;\n" \
    "    r = abs(y) > abs(x) ? 1.57079633 - r : r;\n" \
    "    r = x < 0.0 ? 3.14159265 - r : r;\n" \
    "    return y < 0.0 ? -r : r;\n" \
    "}\n" \
    "float sector(vec2 a, vec2 b) { return angle(cross2(a, b), dot(a, b)) / 2.0; }\n" \
    "float slice(vec2 a, vec2 b) {\n" \
    "    vec2 d = b - a;\n" \
    "    float square = dot(d, d), along = dot(a, d), c = cross2(a, d), room = square - c * c;\n" \
    "    if (!(room > 0.0)) return sector(a, b);\n" \
    "    float root = sqrt(room), enter = (-along - root) / square, leave = (-along + root) / square;\n" \
    "    if (leave <= 0.0 || enter >= 1.0) return sector(a, b);\n" \
    "    vec2 p = a + enter * d, q = a + leave * d;\n" \
    "    vec2 from = enter > 0.0 ? p : a, to = leave < 1.0 ? q : b;\n" \
    "    return (enter > 0.0 ? sector(a, p) : 0.0) + cross2(from, to) / 2.0 +\n" \
    "           (leave < 1.0 ? sector(q, b) : 0.0);\n" \
    "}\n" \
    "float in_disk(vec2 corner[4], float radius) {\n" \
    "    float sum = 0.0;\n" \
    "    for (int i = 0; i < 4; i++) sum += slice(corner[i] / radius, corner[(i + 1) & 3] / radius);\n" \
    "    sum = abs(sum) / 3.14159265;\n" \
    "    return sum < 3e-7 ? 0.0 : sum;\n" \
    "}\n" \
    "float in_square(vec2 corner[4]) {\n" \
    "    vec2 from[8], to[8];\n" \
    "    int n = 4;\n" \
    "    for (int i = 0; i < 4; i++) from[i] = corner[i];\n" \
    "    for (int side = 0; side < 4; side++) {\n" \
    "        int k = side >> 1, m = 0;\n" \
    "        float sign = (side & 1) == 0 ? 1.0 : -1.0;\n" \
    "        for (int i = 0; i < n; i++) {\n" \
    "            vec2 a = from[i], b = from[i + 1 < n ? i + 1 : 0];\n" \
    "            float da = 1.0 - sign * a[k], db = 1.0 - sign * b[k];\n" \
    "            if (da >= 0.0 && m < 8) to[m++] = a;\n" \
    "            if ((da < 0.0) != (db < 0.0) && m < 8) to[m++] = a + da / (da - db) * (b - a);\n" \
    "        }\n" \
    "        n = m;\n" \
    "        for (int i = 0; i < n; i++) from[i] = to[i];\n" \
    "    }\n" \
    "    float sum = 0.0;\n" \
    "    for (int i = 1; i + 1 < n; i++) sum += cross2(from[i] - from[0], from[i + 1] - from[0]);\n" \
    "    return abs(sum) / 8.0;\n" \
    "}\n" \
    "float lamp_hidden(View v, vec2 low, vec2 high) {\n" \
    "    if (v.square) {\n" \
    "        vec2 to = vec2(v.row[0].x, v.row[1].y);\n" \
    "        vec2 side = abs(clamp(to * high, -1.0, 1.0) - clamp(to * low, -1.0, 1.0));\n" \
    "        return side.x * side.y / 4.0;\n" \
    "    }\n" \
    "    vec2 corner[4];\n" \
    "    corner[0] = to_light(v, low), corner[1] = to_light(v, vec2(high.x, low.y));\n" \
    "    corner[2] = to_light(v, high), corner[3] = to_light(v, vec2(low.x, high.y));\n" \
    "    if (!v.disk) return in_square(corner);\n" \
    "    float farthest = max(max(dot(corner[0], corner[0]), dot(corner[1], corner[1])),\n" \
    "                         max(dot(corner[2], corner[2]), dot(corner[3], corner[3])));\n" \
    "    float all = (high.x - low.x) * (high.y - low.y) * v.area, hidden = 0.0;\n" \
    "    uint rings = uint(word(v.face, 15u));\n" \
    "    for (uint i = 0u; i < rings; i++) {\n" \
    "        float ring = word(v.face, 16u + i), square = ring * ring;\n" \
    "        hidden += word(v.face, 24u + i) * (farthest <= square ? all / square : in_disk(corner, ring));\n" \
    "    }\n" \
    "    return hidden;\n" \
    "}\n"

/* How many steps lamp_hidden()'s loops take, at most; and the end of an advance() (raster.h). */
#define SS_LAMP_STEPS_GLSL \
    "uint lamp_steps(View v) {\n" \
    "    return v.square ? 1u : v.disk ? 6u * uint(word(v.face, 15u)) : 90u;\n" \
    "}\n" \
    "bool done(inout uvec4 at, float seen) { return at.x = floatBitsToUint(seen), true; }\n"

#define SS_LAMP_KERNEL_GLSL \
    "layout(std430, binding = 6) readonly buffer Pyramids { float pyramids[]; };\n" \
    "struct Kernel { ivec2 low; ivec2 high; ivec2 count; int step; };\n" \
    "uint side_at(uint level) {\n" \
    "    uint s = side();\n" \
    "    for (uint l = 0u; l < level; l++) s = (s + 1u) / 2u;\n" \
    "    return s;\n" \
    "}\n" \
    "uint levels() {\n" \
    "    uint l = 1u;\n" \
    "    for (uint s = side(); s > 1u; l++) s = (s + 1u) / 2u;\n" \
    "    return l;\n" \
    "}\n" \
    /* where a level starts in pyramids[]; not of level 0, which is the map */ \
    "uint level_start(uint face, uint level) {\n" \
    "    uint all = 0u, before = 0u, s = side();\n" \
    "    for (uint l = 1u; s > 1u; l++) {\n" \
    "        s = (s + 1u) / 2u;\n" \
    "        all += s * s;\n" \
    "        if (l < level) before += s * s;\n" \
    "    }\n" \
    "    return face * all + before;\n" \
    "}\n" \
    "float least_within(uint face, ivec2 low, ivec2 high, uint count) {\n" \
    "    int most = max(high.x - low.x, high.y - low.y);\n" \
    "    uint l = 0u;\n" \
    "    while (l + 1u < count && (most >> l) > 2) l++;\n" \
    "    uint wide = side_at(l), start = l > 0u ? level_start(face, l) : base_of(face);\n" \
    "    float least = 1e30;\n" \
    "    for (int y = low.y >> l; y <= high.y >> l; y++) {\n" \
    "        for (int x = low.x >> l; x <= high.x >> l; x++) {\n" \
    "            uint at = start + uint(y) * wide + uint(x);\n" \
    "            float h = l > 0u ? pyramids[at] : depths[at];\n" \
    "            least = h < least ? h : least;\n" \
    "        }\n" \
    "    }\n" \
    "    return least;\n" \
    "}\n" \
    "int place_of(float at, int n) { return at < 0.0 ? -1 : at >= float(n) ? n : int(at); }\n" \
    "bool lamp_footprint(View v, vec2 at, float gap, out Kernel k) {\n" \
    "    int n = int(side());\n" \
    "    vec2 low = at - v.reach * gap, high = at + v.reach * gap;\n" \
    "    k.low = ivec2(place_of(low.x, n), place_of(low.y, n));\n" \
    "    k.high = ivec2(place_of(high.x, n), place_of(high.y, n));\n" \
    "    if (any(greaterThanEqual(k.low, ivec2(n))) || any(lessThan(k.high, ivec2(0)))) return false;\n" \
    "    k.low = max(k.low, ivec2(0)), k.high = min(k.high, ivec2(n - 1));\n" \
    "    k.count = k.high - k.low + 1, k.step = 1;\n" \
    "    return true;\n" \
    "}\n" \
    "bool lamp_search(View v, vec3 look, out Kernel k) {\n" \
    "    uint count = levels();\n" \
    "    float least = count > 1u ? pyramids[level_start(v.face, count - 1u)] : depths[base_of(v.face)];\n" \
    "    for (int round = 0; round < 16; round++) {\n" \
    "        if (!(least < look.z)) return false;\n" \
    "        if (!lamp_footprint(v, look.xy, look.z - least, k)) return false;\n" \
    "        float found = least_within(v.face, k.low, k.high, count);\n" \
    "        if (found == least) break;\n" \
    "        least = found;\n" \
    "    }\n" \
    "    return least < look.z;\n" \
    "}\n" \
    "void lamp_thin(inout Kernel k, uint limit) {\n" \
    "    float all = float(k.count.x) * float(k.count.y);\n" \
    "    k.step = limit > 0u && all > float(limit) ? max(int(sqrt(all / float(limit))), 1) : 1;\n" \
    "    for (;; k.step++) {\n" \
    "        k.count = (k.high - k.low) / k.step + 1;\n" \
    "        if (limit == 0u || uint(k.count.x) * uint(k.count.y) <= limit) return;\n" \
    "    }\n" \
    "}\n"

#define SS_LAMP_GLSL \
    SS_LIGHT_MAPS_GLSL SS_LAMP_VIEW_GLSL SS_LAMP_AREA_GLSL SS_LAMP_STEPS_GLSL SS_LAMP_KERNEL_GLSL

#endif
