/* One tet at one pixel. From where the ray leaves it, which the rasterizer knows, it goes back to
 * where the first of the other parts is used up: there it came in. All is a mean of the corners'
 * numbers with weights that are not negative, so that flat tets do no harm. Between the two places
 * the value is linear, and colour and extinction are differences of the transfer function's
 * integrals, as in draw_cast.inc.h: both are to be changed together. */
uniform sampler2D near_depth, far_depth; /* the slab of depth that is drawn */
uniform sampler2D sums, bases;           /* of the transfer function */
uniform float step_depth, opacity_end;

in vec4 part;
flat in vec4 rate, depths, values;
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

void add_layer(inout vec4 light, vec4 change, float depth)
{
    float weight = (1.0 - light.a) * absorbed(depth);
    light += vec4(change.rgb * (weight / change.a), weight);
}

/* Colour times extinction, and extinction, of values around one. */
vec4 mean_at(float value)
{
    return difference(sums_at(value + 0.5), sums_at(value - 0.5));
}

/* A thick piece between two values, in parts that are thin. */
vec4 in_parts(float a, float b, float depth, float len)
{
    vec4 light = vec4(0.0);
    float count = min(ceil(depth / step_depth), PARTS_MAX);
    integrals before = sums_at(a);
    for (float i = 1.0; i <= count && light.a < opacity_end; i += 1.0) {
        integrals now = sums_at(i == count ? b : a + (b - a) * (i / count));
        vec4 change = difference(now, before);
        float thick = change.a / (b - a) * len;
        before = now;
        if (thick > 0.0) add_layer(light, change, min(thick, 1.0));
    }
    return light;
}

vec4 piece(float a, float b, float len)
{
    float rise = b - a;
    bool same = abs(rise) <= SAME_VALUE;
    vec4 change = same ? mean_at(b) : difference(sums_at(b), sums_at(a));
    float depth = change.a / (same ? 1.0 : rise) * len;
    vec4 light = vec4(0.0);
    if (!(depth > 0.0)) return light;
    if (depth > step_depth && !same) return in_parts(a, b, depth, len);
    float weight = depth > step_depth ? 1.0 - exp(-depth) : absorbed(depth);
    return vec4(change.rgb * (weight / change.a), weight);
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
    color = piece(s0, s1, len);
}
