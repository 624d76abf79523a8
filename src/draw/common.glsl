/* What all shaders share: the view, and tables whose rows have 4,096 numbers. */
uniform bool parallel;
uniform vec2 half_size;    /* of the picture, pixels */
uniform vec2 aside;        /* from its middle to where x = y = 0, pixels */
uniform vec2 pixel_middle; /* gl_FragCoord of x = y = 0 */
uniform float scale, unit; /* pixels of a unit length; mesh units of a depth of 1 */
uniform vec2 depth_range;  /* nothing is nearer or farther */

ivec2 place(int i)
{
    return ivec2(i & 4095, i >> 12);
}

/* Where a place of the frame is drawn: x, y in pixels, of a perspective view times depth. The depth
 * buffer is written by fragments alone. */
vec4 clip_of(vec3 at)
{
    float w = parallel ? 1.0 : at.z;
    return vec4((at.xy + aside * w) / half_size, 0.0, w);
}

const vec4 NOT_SEEN = vec4(0.0, 0.0, 2.0, 1.0);
