/* A surface at one pixel: colour, and light from the camera to both sides. */
uniform sampler2D limit;  /* what is not nearer is not seen */
uniform sampler2D colors; /* of values */
uniform bool parallel, has_values, lit;
uniform vec3 rgb;
uniform vec4 light; /* ambient, diffuse, specular, shininess */
uniform float opacity;
uniform vec2 depths; /* of the nearest and farthest that there may be */

in vec3 normal, at;
in float value;
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 depth;

const float STEPS = 4096.0;

ivec2 place(int i)
{
    return ivec2(i & 4095, i >> 12);
}

vec3 color_of(float steps)
{
    if (isnan(steps)) return vec3(0.5);
    float s = clamp(steps, 0.0, STEPS);
    int i = int(min(floor(s), STEPS - 1.0));
    return mix(texelFetch(colors, place(i), 0).rgb, texelFetch(colors, place(i + 1), 0).rgb,
               s - float(i));
}

void main()
{
    if (!(at.z > depths.x) || at.z >= texelFetch(limit, ivec2(gl_FragCoord.xy), 0).r) discard;
    vec3 seen = has_values ? color_of(value) : rgb;
    if (lit) {
        vec3 view = parallel ? vec3(0.0, 0.0, 1.0) : normalize(at);
        float c = dot(normal, normal) > 0.0 ? abs(dot(normalize(normal), view)) : 1.0;
        c = min(c, 1.0);
        seen = min(seen * (light.x + light.y * c) + light.z * pow(c, light.w), 1.0);
    }
    color = vec4(seen * opacity, opacity);
    depth = vec4(at.z, 0.0, 0.0, 1.0);
    gl_FragDepth = (at.z - depths.x) / (depths.y - depths.x);
}
