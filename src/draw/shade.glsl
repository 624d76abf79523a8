/* What fragments of surfaces, lines and points share: colour, light from the camera. */
uniform sampler2D limit;  /* what is not nearer is not seen */
uniform sampler2D colors; /* of values */
uniform bool has_values, lit;
uniform bool translucent; /* which of the fragments are drawn */
uniform vec3 rgb;
uniform vec3 nan_rgb; /* of values that are NaN */
uniform vec4 light; /* ambient, diffuse, specular, shininess */
uniform float opacity;

const float STEPS = 4096.0;

vec3 color_of(float steps)
{
    if (!has_values) return rgb;
    if (isnan(steps)) return nan_rgb;
    float s = clamp(steps, 0.0, STEPS);
    int i = int(min(floor(s), STEPS - 1.0));
    return mix(texelFetch(colors, place(i), 0).rgb, texelFetch(colors, place(i + 1), 0).rgb,
               s - float(i));
}

/* From the camera to a pixel, in right, up, forward. */
vec3 view_of(vec2 pixel)
{
    return vec3(parallel ? vec2(0.0) : pixel / scale, 1.0);
}

/* Cosine of the angle between two directions of any length; 1 where there is none. */
float cosine_of(vec3 a, vec3 b)
{
    float lengths = length(a) * length(b);
    return lengths > 0.0 ? min(abs(dot(a, b)) / lengths, 1.0) : 1.0;
}

vec3 lighten(vec3 seen, float cosine)
{
    return min(seen * (light.x + light.y * cosine) + light.z * pow(cosine, light.w), 1.0);
}
