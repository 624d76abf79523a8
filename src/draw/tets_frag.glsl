/* One tet at one pixel. From where the ray leaves it, which the rasterizer knows, it goes back to
 * where the first of the other parts is used up: there it came in. All is a mean of the corners'
 * numbers with weights that are not negative, so that flat tets do no harm. Between the two places
 * the value is linear, and colour and extinction are differences of the transfer function's
 * integrals, as in draw_cast_light.inc.h: both are to be changed together. */
uniform sampler2D near_depth, far_depth; /* the slab of depth that is drawn */
uniform sampler2D sums, bases;           /* of the transfer function */
uniform float step_depth, opacity_end;
uniform bool has_light, dims; /* light or gradient opacity; the latter */
uniform sampler2D gradients;  /* of vertices, in lengths from which on opacity is full */
uniform mat3 axes;            /* right, up, forward in axes of the mesh */
uniform vec4 light;           /* ambient, diffuse, specular, shininess */

in vec4 part;
flat in vec4 rate, depths, values;
flat in uvec4 ids;
out vec4 color;

const int STEPS = 4096;
const float SAME_VALUE = 0.05, PARTS_MAX = 256.0;

struct integrals {
    vec4 base, rest;
};

integrals sums_at(float value)
{
    float at = value + 1.0;
    int i = int(clamp(floor(at), 0.0, float(STEPS + 1)));
    int entry = i + (i >> 6);
    vec4 a = texelFetch(sums, place(entry), 0), b = texelFetch(sums, place(entry + 1), 0);
    return integrals(texelFetch(bases, ivec2(i >> 6, 0), 0), a + (at - float(i)) * (b - a));
}

vec4 difference(integrals b, integrals a)
{
    return (b.base - a.base) + (b.rest - a.rest);
}

float absorbed(float x)
{
    return x * (1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))));
}

/* What light does to the colours of the piece: a factor, white that is added. */
float tone = 1.0, white = 0.0;

vec3 lit(vec3 color)
{
    return has_light ? min(color * tone + white, 1.0) : color;
}

void add_layer(inout vec4 seen, vec4 change, float depth)
{
    float weight = (1.0 - seen.a) * absorbed(depth);
    seen += vec4(lit(change.rgb / change.a) * weight, weight);
}

/* Colour times extinction, and extinction, of values around one. */
vec4 mean_at(float value)
{
    return difference(sums_at(value + 0.5), sums_at(value - 0.5));
}

/* A thick piece between two values, in parts that are thin. */
vec4 in_parts(float a, float b, float depth, float len)
{
    vec4 seen = vec4(0.0);
    float count = min(ceil(depth / step_depth), PARTS_MAX);
    integrals before = sums_at(a);
    for (float i = 1.0; i <= count && seen.a < opacity_end; i += 1.0) {
        integrals now = sums_at(i == count ? b : a + (b - a) * (i / count));
        vec4 change = difference(now, before);
        float thick = change.a / (b - a) * len;
        before = now;
        if (thick > 0.0) add_layer(seen, change, min(thick, 1.0));
    }
    return seen;
}

vec4 piece(float a, float b, float len)
{
    float rise = b - a;
    bool same = abs(rise) <= SAME_VALUE;
    vec4 change = same ? mean_at(b) : difference(sums_at(b), sums_at(a));
    float depth = change.a / (same ? 1.0 : rise) * len;
    if (!(depth > 0.0)) return vec4(0.0);
    if (depth > step_depth && !same) return in_parts(a, b, depth, len);
    float weight = depth > step_depth ? 1.0 - exp(-depth) : absorbed(depth);
    return vec4(lit(change.rgb / change.a) * weight, weight);
}

/* Light by the mean of the gradients where the ray comes in and leaves; both [4] weights of the
 * corners. Returns the factor of extinction. */
float shade(vec4 enter, vec4 leave)
{
    vec4 share = (enter + leave) / 2.0;
    vec3 n = vec3(0.0);
    for (int i = 0; i < 4; i++) n += share[i] * texelFetch(gradients, place(int(ids[i])), 0).xyz;
    vec2 at = parallel ? vec2(0.0) : (gl_FragCoord.xy - pixel_middle) / scale;
    float len = length(n), cosine = 1.0;
    if (len > 0.0) cosine = min(abs(dot(n, normalize(axes * vec3(at, 1.0)))) / len, 1.0);
    tone = light.x + light.y * cosine;
    if (light.z > 0.0) white = light.z * pow(cosine, light.w);
    return dims ? min(len, 1.0) : 1.0;
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
    if (has_light) len *= shade(enter, leave);
    color = piece(s0, s1, len);
}
