/* Rays through tets, one a pixel, as in draw_cast.inc.h: both are to be changed together. The face
 * that a ray passes is kept as its corners seen from the ray and the double areas of the triangles
 * between the ray and each edge, which are the weights of the place. The fourth corner of the tet
 * behind splits the face into three; signs of areas tell which of them the ray leaves by. */
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 2) readonly buffer verts_block {
    vec4 verts[];
};
layout(std430, binding = 3) readonly buffer tets_block {
    uvec4 tets[];
};
layout(std430, binding = 4) readonly buffer behind_block {
    uint behind[]; /* 4 * tet + face: the face of the tet behind it */
};
layout(std430, binding = 5) readonly buffer layer_heads_block {
    uint layer_counts[4];
    uint layer_heads[];
};
layout(std430, binding = 6) readonly buffer layer_nodes_block {
    uint layer_nodes[];
};
layout(std430, binding = 7) readonly buffer layer_colors_block {
    vec4 layer_colors[];
};
layout(rgba32f) uniform writeonly image2D picture;
uniform sampler2D back_color, back_depth; /* what is behind, where rays end */
uniform sampler2D gradients;              /* of vertices, in lengths from which on opacity is full */
uniform mat3 axes;                        /* right, up, forward in axes of the mesh */
uniform ivec2 size;
uniform int first_row; /* of this band of rays */
uniform vec2 clear; /* of tets with all values up to the first or from the second on nothing is seen */
uniform bool has_volume, has_layers;

/* A ray comes in again no nearer than this, relative to the depth where it went out. */
const float SAME_DEPTH = 1e-5;
/* Steps without getting farther, as around a vertex, after which a ray goes in circles: between
 * inverted tets, or where a place is not finite. And steps of a ray at all: a card that waits for
 * one forever is reset. */
const int STALLED_MAX = 4096, STEPS_MAX = 1 << 20;

vec2 ray;                /* place of the pixel */
vec3 view;               /* direction, of length 1, in axes of the mesh */
float ray_end, ray_length; /* depth; mesh units by depth */
vec4 seen = vec4(0.0);   /* colour and opacity gathered so far */
uint next_layer, next_door;
float stop; /* depth of the next layer, or ray_end */

/* The face passed last, and the place there. */
uvec3 ids;
vec4 corners[3];
vec3 slopes[3]; /* gradients of the corners */
vec3 areas;     /* opposite to the corners */
float depth, value;
vec3 slope;
integrals sums_here; /* at value */
uint at;             /* 4 * tet + face that it is in */

void next_stop()
{
    stop = next_layer == NONE ? ray_end : uintBitsToFloat(layer_nodes[3u * next_layer + 1u]);
}

void add_layer_behind()
{
    seen += (1.0 - seen.a) * layer_colors[next_layer];
    next_layer = layer_nodes[3u * next_layer];
    next_stop();
}

void load_corner(int i, uint id)
{
    corners[i] = beside(verts[id], ray);
    if (has_light) slopes[i] = texelFetch(gradients, place(int(id)), 0).xyz;
}

/* Puts the ray at a door; false if it only touches it. */
bool enter(uint door)
{
    ids = face_of(tets[door >> 2u], door & 3u);
    load_corner(0, ids.x);
    load_corner(1, ids.y);
    load_corner(2, ids.z);
    areas = vec3(area_of(corners[1], corners[2]), area_of(corners[2], corners[0]),
                 area_of(corners[0], corners[1]));
    vec3 w = max(areas, 0.0);
    float sum = w.x + w.y + w.z;
    if (!(sum > 0.0)) return false;
    w /= sum;
    depth = dot(w, vec3(corners[0].z, corners[1].z, corners[2].z));
    value = dot(w, vec3(corners[0].w, corners[1].w, corners[2].w));
    if (has_light) slope = w.x * slopes[0] + w.y * slopes[1] + w.z * slopes[2];
    sums_here = sums_at(value);
    at = door;
    return true;
}

/* The next door that is not nearer than where the ray is; false: there is none. */
bool go_on()
{
    float from = depth - SAME_DEPTH * abs(depth);
    while (next_door != NONE) {
        uint door = nodes[3u * next_door + 2u];
        float z = uintBitsToFloat(nodes[3u * next_door + 1u]);
        next_door = nodes[3u * next_door];
        if (z >= ray_end) return false;
        if (z >= from && enter(door)) {
            while (next_layer != NONE && stop <= depth) add_layer_behind();
            return true;
        }
    }
    return false;
}

/* Moves to the face by which the ray leaves its tet; d: the corner that is not on the face it came
 * by. Returns the corner that is not on the new one. */
uint leave(vec4 d, uint id)
{
    vec3 edges = vec3(area_of(d, corners[0]), area_of(d, corners[1]), area_of(d, corners[2]));
    vec3 d_slope = has_light ? texelFetch(gradients, place(int(id)), 0).xyz : vec3(0.0);
    uint lost;
    if (edges.x >= 0.0 && edges.y < 0.0) {
        lost = ids.z;
        areas = vec3(-edges.y, edges.x, areas.z);
        corners[2] = d;
        ids.z = id;
        slopes[2] = d_slope;
    } else if (edges.y >= 0.0 && edges.z < 0.0) {
        lost = ids.x;
        areas = vec3(areas.x, -edges.z, edges.y);
        corners[0] = d;
        ids.x = id;
        slopes[0] = d_slope;
    } else {
        lost = ids.y;
        areas = vec3(edges.z, areas.y, -edges.x);
        corners[1] = d;
        ids.y = id;
        slopes[1] = d_slope;
    }
    return lost;
}

void add_piece(float a, integrals at_a, float b, integrals at_b, float len)
{
    seen += (1.0 - seen.a) * piece(a, at_a, b, at_b, len * ray_length);
}

/* What is seen up to a depth, in front of the camera, and a value, with the layers in between. */
void see(float to, float to_value, integrals sums_there)
{
    float from = depth, from_value = value, rise = (to_value - value) / (to - depth);
    integrals sums_from = sums_here;
    if (from < 0.0) {
        from_value -= rise * from;
        sums_from = sums_at(from_value);
        from = 0.0;
    }
    while (stop <= to && seen.a < opacity_end) {
        if (stop > from) {
            float last = from_value + rise * (stop - from);
            integrals sums_last = sums_at(last);
            add_piece(from_value, sums_from, last, sums_last, stop - from);
            from = stop;
            from_value = last;
            sums_from = sums_last;
        }
        if (next_layer == NONE) return;
        add_layer_behind();
    }
    if (to > from) add_piece(from_value, sums_from, to_value, sums_there, to - from);
}

/* Through a tet; false if the ray is out of what is seen of the mesh. */
bool pass_tet(inout int stalled)
{
    uvec4 tet = tets[at >> 2u];
    uint id = tet.x ^ tet.y ^ tet.z ^ tet.w ^ ids.x ^ ids.y ^ ids.z;
    vec4 d = beside(verts[id], ray);
    vec4 s = vec4(corners[0].w, corners[1].w, corners[2].w, d.w);
    bool is_clear = all(lessThanEqual(s, clear.xxxx)) || all(greaterThanEqual(s, clear.yyyy));
    if (is_clear && !any(isnan(s))) return false; /* all() may be made of comparisons that fail */
    uint lost = leave(d, id);
    uint face = lost == tet.y ? 1u : lost == tet.z ? 2u : lost == tet.w ? 3u : 0u;
    at = behind[(at & ~3u) + face];

    vec3 w = max(areas, 0.0);
    float sum = w.x + w.y + w.z, to = depth, to_value = value;
    vec3 to_slope = slope;
    if (sum > 0.0) { /* else along an edge, where it stays */
        w /= sum;
        to = dot(w, vec3(corners[0].z, corners[1].z, corners[2].z));
        to_value = dot(w, vec3(corners[0].w, corners[1].w, corners[2].w));
        if (has_light) to_slope = w.x * slopes[0] + w.y * slopes[1] + w.z * slopes[2];
    }
    integrals sums_there = sums_at(to_value);
    bool farther = to > depth;
    if (farther && to > 0.0) {
        float kept = ray_length;
        if (has_light) ray_length *= shade((slope + to_slope) / 2.0, view);
        see(to, to_value, sums_there);
        ray_length = kept;
    }
    stalled = farther ? 0 : stalled + 1;
    if (farther) depth = to;
    value = to_value;
    slope = to_slope;
    sums_here = sums_there;
    return at != NONE;
}

void follow()
{
    int stalled = 0;
    depth = -1e38;
    bool inside = go_on();
    for (int i = 0; inside && i <= STEPS_MAX; i++) {
        inside = pass_tet(stalled) ? depth < ray_end && seen.a < opacity_end
                                   : depth < ray_end && seen.a < opacity_end && go_on();
        if (stalled > STALLED_MAX || i == STEPS_MAX) {
            atomicAdd(given_up, 1u);
            return;
        }
    }
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
    if (any(greaterThanEqual(pixel, size))) return;
    uint i = uint(pixel.y * size.x + pixel.x);
    ray = vec2(pixel) + 0.5 - pixel_middle;
    vec2 beside_middle = parallel ? vec2(0.0) : ray / scale;
    ray_length = unit * sqrt(1.0 + dot(beside_middle, beside_middle));
    ray_end = texelFetch(back_depth, pixel, 0).r;
    next_layer = has_layers ? layer_heads[i] : NONE;
    next_door = has_volume ? heads[i] : NONE;
    if (has_light) view = normalize(axes * vec3(beside_middle, 1.0));
    next_stop();
    if (next_door != NONE) follow();
    while (next_layer != NONE && seen.a < 1.0) add_layer_behind();
    imageStore(picture, pixel, seen + (1.0 - seen.a) * texelFetch(back_color, pixel, 0));
}
