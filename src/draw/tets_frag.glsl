/* One tet at one pixel. From where the ray leaves it, which the rasterizer knows, it goes back to
 * where the first of the other parts is used up: there it came in. All is a mean of the corners'
 * numbers with weights that are not negative, so that flat tets do no harm. */
uniform sampler2D near_depth, far_depth; /* the slab of depth that is drawn */
uniform sampler2D gradients;             /* of vertices, in lengths from which on opacity is full */
uniform mat3 axes;                       /* right, up, forward in axes of the mesh */

in vec4 part;
flat in vec4 rate, depths, values;
flat in uvec4 ids;
out vec4 color;

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
    float low = max(texelFetch(near_depth, pixel, 0).r, 0.0);
    float high = texelFetch(far_depth, pixel, 0).r;
    if (!(z1 > z0) || !(high > z0) || !(z1 > low)) discard;
    float slope = (s1 - s0) / (z1 - z0);
    if (z1 > high) {
        s1 += slope * (high - z1);
        z1 = high;
    }
    if (z0 < low) {
        s0 += slope * (low - z0);
        z0 = low;
    }
    vec2 at = (gl_FragCoord.xy - pixel_middle) / scale;
    float len = (z1 - z0) * unit * (parallel ? 1.0 : sqrt(1.0 + dot(at, at)));
    if (has_light) len *= shade_mean(enter, leave);
    color = piece(s0, sums_at(s0), s1, sums_at(s1), len);
}
