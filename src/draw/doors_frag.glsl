/* Whether the ray of a pixel comes in by a face: then it is listed there. */
uniform sampler2D far_depth; /* where rays end */
uniform int row_pixels;

flat in vec3 a, b, c;
flat in uint door;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 at = gl_FragCoord.xy - pixel_middle;
    vec4 pa = beside(vec4(a, 0.0), at), pb = beside(vec4(b, 0.0), at), pc = beside(vec4(c, 0.0), at);
    vec3 areas = vec3(area_of(pb, pc), area_of(pc, pa), area_of(pa, pb));
    float sum = dot(areas, vec3(1.0)), z = dot(areas, vec3(a.z, b.z, c.z)) / sum;
    if (!(sum > 0.0) || any(lessThan(areas, vec3(0.0)))) return;
    if (z < texelFetch(far_depth, pixel, 0).r) list_add(uint(pixel.y * row_pixels + pixel.x), z, door);
}
