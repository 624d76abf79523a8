/* What lies between two places of a ray: value linear, colour and extinction as differences of the
 * transfer function's integrals, as in draw_cast_light.inc.h: both are to be changed together. */
uniform sampler2D sums, bases; /* of the transfer function */
uniform float step_depth, opacity_end;
uniform bool has_light, dims; /* light or gradient opacity; the latter */
uniform vec4 light;           /* ambient, diffuse, specular, shininess */

const int STEPS = 4096;
const float SAME_VALUE = 0.05, PARTS_MAX = 256.0;

struct integrals {
    vec4 base, rest;
};

integrals sums_at(float value)
{
    float at = value + 1.0;
    int i = at >= 0.0 ? int(min(floor(at), float(STEPS + 1))) : 0;
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

/* Between values a and b, with the integrals there, over a length. */
vec4 piece(float a, integrals at_a, float b, integrals at_b, float len)
{
    float rise = b - a;
    bool same = abs(rise) <= SAME_VALUE;
    vec4 change = same ? mean_at(b) : difference(at_b, at_a);
    float depth = change.a / (same ? 1.0 : rise) * len;
    if (!(depth > 0.0)) return vec4(0.0);
    if (depth > step_depth && !same) return in_parts(a, b, depth, len);
    float weight = depth > step_depth ? 1.0 - exp(-depth) : absorbed(depth);
    return vec4(lit(change.rgb / change.a) * weight, weight);
}

/* Light by a gradient on what is seen along a direction of length 1, both in axes of the mesh.
 * Returns the factor of extinction. */
float shade(vec3 gradient, vec3 view)
{
    float len = length(gradient), cosine = 1.0;
    if (len > 0.0) cosine = min(abs(dot(gradient, view)) / len, 1.0);
    tone = light.x + light.y * cosine;
    if (light.z > 0.0) white = light.z * pow(cosine, light.w);
    return dims ? min(len, 1.0) : 1.0;
}
