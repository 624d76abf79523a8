/* Squares around points: vertex 6 * i + k is a corner of the two triangles of point i. */
uniform sampler2D verts, normals; /* place and die; normal and value */
uniform mat3 turn;
uniform vec3 offset;
uniform float radius_px, radius; /* pixels; units of the frame where above 0 */
uniform float nearest;           /* depth of the nearest point where far ones are fewer, else 0 */

flat out vec4 disc;   /* x, y in pixels, depth, radius in pixels */
flat out vec3 normal; /* right, up, forward */
flat out float value;

const float SHARE_MIN = 0.1;

void main()
{
    int i = gl_VertexID / 6, k = gl_VertexID % 6;
    vec4 vert = texelFetch(verts, place(i), 0), carried = texelFetch(normals, place(i), 0);
    vec3 at = turn * vert.xyz + offset;
    float w = parallel ? 1.0 : at.z, share = nearest / at.z;
    disc = vec4(at.xy * scale / w, at.z, radius > 0.0 ? radius * scale / w : radius_px);
    normal = turn * carried.xyz;
    value = carried.w;
    vec2 corner = vec2(k == 1 || k == 2 || k == 4, k == 2 || k == 4 || k == 5) * 2.0 - 1.0;
    bool kept = nearest == 0.0 || vert.w < max(share * share, SHARE_MIN);
    bool seen = at.z > 0.0 && kept && !isinf(dot(disc, vec4(1.0)));
    gl_Position = seen ? vec4((disc.xy + corner * (disc.w + 1.0) + aside) / half_size, 0.0, 1.0)
                       : NOT_SEEN;
}
