/* Slices of tets: vertex 6 * tet + k is the k-th corner of the two triangles that a slice may have
 * there (Ponchio and Hormann 2008, section 7: no triangle leaves the card when the value changes).
 */
uniform usampler2D corners;       /* of tets */
uniform sampler2D verts, normals; /* place and scalar; gradient and value */
uniform mat3 turn;
uniform vec3 offset;
uniform float level; /* of the scalar, 0 to 1 over its range */

out vec3 normal, at;
out float value;

/* Edges of the two triangles, a + 4 b of corners a and b, by which corners are at or above the
 * level; 0: none. */
const int EDGES[96] = int[96](
    0, 0, 0, 0, 0, 0, 4, 8, 12, 0, 0, 0, 4, 9, 13, 0, 0, 0, 8, 12, 13, 8, 13, 9,
    8, 9, 14, 0, 0, 0, 4, 12, 14, 4, 14, 9, 4, 13, 14, 4, 14, 8, 12, 13, 14, 0, 0, 0,
    12, 13, 14, 0, 0, 0, 4, 8, 14, 4, 14, 13, 4, 9, 14, 4, 14, 12, 8, 9, 14, 0, 0, 0,
    8, 9, 13, 8, 13, 12, 4, 9, 13, 0, 0, 0, 4, 8, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0);

void main()
{
    uvec4 ids = texelFetch(corners, place(gl_VertexID / 6), 0);
    vec4 s;
    for (int i = 0; i < 4; i++) s[i] = texelFetch(verts, place(int(ids[i])), 0).w;
    bvec4 above = greaterThanEqual(s, vec4(level));
    int mask = int(above.x) + 2 * int(above.y) + 4 * int(above.z) + 8 * int(above.w);
    int edge = EDGES[6 * mask + gl_VertexID % 6];
    float sum = dot(s, vec4(1.0));
    gl_Position = NOT_SEEN;
    normal = at = vec3(0.0);
    value = 0.0;
    if (edge == 0 || isnan(sum) || isinf(sum)) return;
    int a = edge & 3, b = edge >> 2;
    float part = clamp((level - s[a]) / (s[b] - s[a]), 0.0, 1.0);
    vec4 gradient = mix(texelFetch(normals, place(int(ids[a])), 0),
                        texelFetch(normals, place(int(ids[b])), 0), part);
    at = turn * mix(texelFetch(verts, place(int(ids[a])), 0).xyz,
                    texelFetch(verts, place(int(ids[b])), 0).xyz, part) + offset;
    normal = turn * gradient.xyz;
    value = gradient.w;
    gl_Position = clip_of(vec3(at.xy * scale, at.z));
}
