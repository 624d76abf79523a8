/* Where rays come in: the box on the picture of each face with nothing seen behind it. Vertex
 * 6 i + k is a corner of the two triangles of the box of face i. */
layout(std430, binding = 2) readonly buffer verts_block {
    vec4 verts[];
};
layout(std430, binding = 3) readonly buffer tets_block {
    uvec4 tets[];
};
layout(std430, binding = 4) readonly buffer doors_block {
    uint doors[]; /* 4 * tet + face */
};

flat out vec3 a, b, c;
flat out uint door;

/* Pixels around a box: more than the rasterizer rounds. */
const float MARGIN = 1.0 / 16.0;
/* A face that looks away does so by more than rounding. */
const float AWAY = -1e-5;

bool looks_away(bool is_before)
{
    vec3 normal = cross(b - a, c - a);
    float side = dot(a, normal) * (is_before ? 1.0 : -1.0);
    return side < AWAY * length(a) * length(normal);
}

void main()
{
    door = doors[gl_VertexID / 6];
    uvec3 ids = face_of(tets[door >> 2u], door & 3u);
    a = verts[ids.x].xyz;
    b = verts[ids.y].xyz;
    c = verts[ids.z].xyz;
    vec3 w = parallel ? vec3(1.0) : vec3(a.z, b.z, c.z);
    bool is_before = all(greaterThan(w, vec3(0.0))), is_behind = all(lessThan(w, vec3(0.0)));
    vec2 low = vec2(-2.0), high = vec2(2.0);
    gl_Position = NOT_SEEN;
    float sum = dot(a + b + c, vec3(1.0));
    if (isnan(sum) || isinf(sum)) return;
    if (is_before || is_behind) { /* not beside the camera */
        if (!parallel && looks_away(is_before)) return;
        vec2 pa = a.xy / w.x, pb = b.xy / w.y, pc = c.xy / w.z;
        low = (min(pa, min(pb, pc)) + aside - MARGIN) / half_size;
        high = (max(pa, max(pb, pc)) + aside + MARGIN) / half_size;
    }
    int k = gl_VertexID % 6;
    bvec2 far_side = bvec2(k == 1 || k == 2 || k == 4, k == 2 || k == 4 || k == 5);
    gl_Position = vec4(clamp(mix(low, high, far_side), -2.0, 2.0), 0.0, 1.0);
}
