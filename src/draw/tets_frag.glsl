/* One tet at one pixel. From where the ray leaves it, which the rasterizer knows, it goes back to
 * where the first of the other parts is used up: there it came in. All is a mean of the corners'
 * numbers with weights that are not negative, so that flat tets do no harm. */
uniform sampler2D limits[SLABS + 1];     /* depths between slabs, far ones first */
uniform sampler2D gradients;             /* of vertices, in lengths from which on opacity is full */
uniform mat3 axes;                       /* right, up, forward in axes of the mesh */

in vec4 part;
flat in vec4 rate, depths, values;
flat in uvec4 ids;
/* SLABS is defined before this text: 1 or 4. */
layout(location = 0) out vec4 slabs[SLABS];

/* Light by the mean of the gradients where the ray comes in and leaves; both [4] weights of the
 * corners. Returns the factor of extinction. */
float shade_mean(vec4 enter, vec4 leave)
{
    vec4 share = (enter + leave) / 2.0;
    vec3 n = vec3(0.0);
    for (int i = 0; i < 4; i++) n += share[i] * texelFetch(gradients, place(int(ids[i])), 0).xyz;
    vec2 at = parallel ? vec2(0.0) : (gl_FragCoord.xy - pixel_middle) / scale;
    return shade(n, normalize(axes * vec3(at, 1.0)));
}

/* What a slab of depths has of the piece between z0 and z1. */
vec4 between(float z0, float s0, float z1, float s1, float slope, float low, float high,
             float by_depth)
{
    float from = max(z0, low), to = min(z1, high);
    if (!(to > from)) return vec4(0.0);
    float a = from > z0 ? s0 + slope * (from - z0) : s0;
    float b = to < z1 ? s1 + slope * (to - z1) : s1;
    return piece(a, sums_at(a), b, sums_at(b), (to - from) * by_depth);
}

void main()
{
    vec4 leave = max(part, 0.0);
    leave /= dot(leave, vec4(1.0));
    vec4 rise = parallel ? rate : leave - rate;
    float way = 3e38;
    for (int i = 0; i < 4; i++)
        if (rise[i] > 0.0) way = min(way, leave[i] / rise[i]);
    vec4 enter = max(leave - way * rise, 0.0);
    float sum = dot(enter, vec4(1.0));
    if (!(sum > 0.0) || isinf(sum)) discard;
    enter /= sum;

    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z0 = dot(enter, depths), z1 = dot(leave, depths);
    float s0 = dot(enter, values), s1 = dot(leave, values);
    float ends[SLABS + 1];
    ends[0] = texelFetch(limits[0], pixel, 0).r;
    ends[SLABS] = max(texelFetch(limits[SLABS], pixel, 0).r, 0.0);
    if (!(z1 > z0) || !(ends[0] > z0) || !(z1 > ends[SLABS])) discard;
    vec2 at = (gl_FragCoord.xy - pixel_middle) / scale;
    float by_depth = unit * (parallel ? 1.0 : sqrt(1.0 + dot(at, at)));
    if (has_light) by_depth *= shade_mean(enter, leave);
    float slope = (s1 - s0) / (z1 - z0);
#if SLABS == 1
    slabs[0] = between(z0, s0, z1, s1, slope, ends[1], ends[0], by_depth);
#else
    ends[1] = max(texelFetch(limits[1], pixel, 0).r, 0.0);
    ends[2] = max(texelFetch(limits[2], pixel, 0).r, 0.0);
    ends[3] = max(texelFetch(limits[3], pixel, 0).r, 0.0);
    slabs[0] = slabs[1] = slabs[2] = slabs[3] = vec4(0.0);
    int i = int(ends[1] >= z1) + int(ends[2] >= z1) + int(ends[3] >= z1);
    for (bool more = true; more; i++) { /* most tets are in one slab */
        float high = i == 0 ? ends[0] : i == 1 ? ends[1] : i == 2 ? ends[2] : ends[3];
        float low = i == 0 ? ends[1] : i == 1 ? ends[2] : i == 2 ? ends[3] : ends[4];
        vec4 own = between(z0, s0, z1, s1, slope, low, high, by_depth);
        if (i == 0) slabs[0] = own;
        if (i == 1) slabs[1] = own;
        if (i == 2) slabs[2] = own;
        if (i == 3) slabs[3] = own;
        more = i < 3 && low > z0;
    }
#endif
}
